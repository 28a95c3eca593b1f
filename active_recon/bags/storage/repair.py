"""Repair of an incomplete bag: its index, summary and metadata.yaml."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
import fcntl
import os
from pathlib import Path
from typing import Any

from active_recon.bags.storage.compression import is_packed
from active_recon.bags.storage.files import (
    free_name,
    numbered_files,
    sync_folder,
    write_atomically,
)
from active_recon.bags.storage.mcap_rewriter import McapRewriter
from active_recon.bags.storage.metadata import (
    bag_information,
    Contents,
    metadata_yaml,
    qos_from_yaml,
    Topic,
    yaml_mapping,
)
from active_recon.bags.storage.salvage import Salvage
from active_recon.errors import DataError
from mcap.records import Channel, Message, Schema

_OF_THE_RECORDER = ('compression_format', 'compression_mode', 'ros_distro', 'custom_data')
"""What metadata.yaml says that the files do not: messages may be compressed, each alone."""


@dataclass
class Repair:
    """
    The outcome for one file of a bag.

    - packed: whether its messages are compressed, each by itself
    - lost: what could not be read, in words
    - kept_as: the path of the original file; None if it was intact and was left unchanged
    """

    path: Path
    contents: Contents = field(default_factory=Contents)
    topics: dict[str, Topic] = field(default_factory=dict)
    packed: bool = False
    lost: list[str] = field(default_factory=list)
    kept_as: Path | None = None


def repair_bag(bag: Path, advance: Callable[[str], None] = lambda name: None
               ) -> tuple[list[Repair], bool]:
    """
    Repair a bag: a folder, or one MCAP file, whose metadata.yaml is then left unchanged.

    Intact files are left unchanged. A damaged one is rewritten to a temporary file that replaces
    it once it is on the disk; the original is kept as `<name>.damaged`. `advance` is called with
    the name of each finished file. Returns the files and whether metadata.yaml was written.
    Raises DataError if there is no bag, it is still being recorded, or the disk is full, which
    names the files that were repaired before.
    """
    files = bag_files(bag)
    repairs: list[Repair] = []
    try:
        found = [_open_finished(file) for file in files]
        for each in found:
            repairs.append(_repair_file(each))
            advance(each.path.name)
        return repairs, bag.is_dir() and _repair_metadata(bag, repairs)
    except OSError as error:
        done = ', '.join(each.path.name for each in repairs if each.kept_as)
        raise DataError(f'{bag}: cannot be repaired: {error}; '
                        f'{f"only {done} was repaired" if done else "nothing was changed"}',
                        'not_repaired') from error


def bag_files(bag: Path) -> list[Path]:
    """Return a bag's files in the order of recording; raises DataError if there is no bag."""
    if bag.is_file():
        return [bag]
    files = numbered_files(bag)
    if not files:
        raise DataError(f'{bag}: no bag there to repair: expected a folder of MCAP files, or one '
                        'MCAP file; sqlite3 bags are read as they are',
                        'no_bag')
    return files


def _open_finished(path: Path) -> Salvage:
    """Return a file for reading; raises DataError if it is not MCAP or still being recorded."""
    with path.open('rb') as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise DataError(f'{path}: still being recorded; stop the recorder first',
                            'still_recorded') from error
    return Salvage(path)


def _repair_file(found: Salvage) -> Repair:
    path = found.path
    begun = path.stat().st_size
    repair = _survey(found)
    if found.indexed and not repair.lost:
        return repair
    rewritten = McapRewriter(path.with_name(f'.{path.name}.part'))
    try:
        for record in found.records():
            rewritten.add(record)
        if path.stat().st_size != begun:  # rosbag2's recorder has no lock
            raise DataError(f'{path}: still being recorded, since it grew meanwhile; stop the '
                            'recorder first', 'still_recorded')
        rewritten.finish()
    except BaseException:
        rewritten.discard()
        raise
    repair.kept_as = _replace(path, rewritten.path)
    return repair


def _survey(found: Salvage) -> Repair:
    repair = Repair(found.path)
    types: dict[int, str] = {}
    topics: dict[int, str] = {}
    unknown = 0
    for record in found.records():
        if isinstance(record, Schema):
            types[record.id] = record.name
        elif isinstance(record, Channel):
            topics[record.id] = record.topic
            repair.topics[record.topic] = Topic(
                record.topic, types.get(record.schema_id, ''),
                qos_from_yaml(record.metadata.get('offered_qos_profiles', '')))
        elif isinstance(record, Message):
            repair.packed |= is_packed(record.data)
            if record.channel_id in topics:
                repair.contents.add(topics[record.channel_id], record.log_time)
            else:
                unknown += 1
    repair.lost = found.lost + [f'{unknown} messages of unknown topics'] * (unknown > 0)
    return repair


def _replace(path: Path, repaired: Path) -> Path:
    """Replace a file and return the path of the original; one of them exists at any time."""
    kept = _keep(path)
    repaired.replace(path)
    sync_folder(path.parent)
    return kept


def _keep(path: Path) -> Path:
    """Return another path of a file that is to be replaced, under which it stays."""
    kept = free_name(path, 'damaged')
    try:
        os.link(path, kept)
    except OSError:  # a file system without hard links
        path.rename(kept)
    return kept


def _repair_metadata(folder: Path, repairs: Sequence[Repair]) -> bool:
    """Write metadata.yaml if it is missing or wrong; return whether it was written."""
    path = folder / 'metadata.yaml'
    topics = {name: topic for repair in repairs for name, topic in repair.topics.items()}
    information = bag_information(
        [(repair.path.name, repair.contents) for repair in repairs], topics.values())
    if any(repair.packed for repair in repairs):
        information |= {'compression_format': 'zstd', 'compression_mode': 'MESSAGE'}
    if path.exists():
        before = _read_information(path)
        packed = str(before.get('compression_mode')).lower() == 'file'  # the files are not, now
        if _essence(before) == _essence(information) and not packed:
            return False
        information |= {key: before[key] for key in _OF_THE_RECORDER if key in before
                        and not (packed and key.startswith('compression_'))}
        _keep(path)
    write_atomically(path, metadata_yaml(information))
    return True


def _read_information(path: Path) -> dict[str, Any]:
    """Return what a metadata.yaml says of its bag; nothing if it cannot be read."""
    try:
        return dict(yaml_mapping(path.read_bytes(), str(path))['rosbag2_bagfile_information'])
    except (DataError, KeyError, TypeError, ValueError):
        return {}


def _essence(information: dict[str, Any]) -> object:
    """Return the files and message counts that a metadata.yaml tells; None if it lacks some."""
    try:
        return (
            [Path(name).name for name in information['relative_file_paths']],
            {topic['topic_metadata']['name']: topic['message_count']
             for topic in information['topics_with_message_count'] if topic['message_count']})
    except (KeyError, TypeError):
        return None
