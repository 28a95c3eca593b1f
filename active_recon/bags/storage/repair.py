"""A bag that was cut off, made whole again: index, summary and metadata.yaml."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
import fcntl
import os
from pathlib import Path
from typing import Any

from active_recon.bags.storage.files import free_name, mcap_files, sync_folder, write_whole
from active_recon.bags.storage.metadata import (
    bag_information,
    Contents,
    metadata_yaml,
    qos_from_yaml,
    Topic,
)
from active_recon.bags.storage.rewriting import Rewriting
from active_recon.bags.storage.salvage import Salvage
from active_recon.errors import DataError
from mcap.records import Channel, Message, Schema
import yaml


@dataclass
class Repair:
    """
    What was found in one file of a bag, and what became of it.

    - lost: what could not be read, in words
    - kept_as: where the file as it was found stands now; None where it was whole and is untouched
    """

    path: Path
    contents: Contents = field(default_factory=Contents)
    topics: dict[str, Topic] = field(default_factory=dict)
    lost: list[str] = field(default_factory=list)
    kept_as: Path | None = None


def repair_bag(bag: Path, advance: Callable[[str], None] = lambda name: None
               ) -> tuple[list[Repair], bool]:
    """
    Make a bag whole: a folder, or one MCAP file, whose metadata.yaml is then left alone.

    Whole files are not touched. What is not whole is written anew beside, and takes the file's
    name only when it is on the disk; the file as it was is kept as `<name>.damaged`. `advance` is
    told each file that is done. Returns the files and whether metadata.yaml was written. Raises
    DataError where there is no bag, where it is still being recorded, or the disk is full; what
    was there before is there then too.
    """
    files = bag_files(bag)
    try:
        found = [_open_finished(file) for file in files]
        repairs = []
        for each in found:
            repairs.append(_repair_file(each))
            advance(each.path.name)
        return repairs, bag.is_dir() and _repair_metadata(bag, repairs)
    except OSError as error:
        raise DataError(f'{bag}: cannot be repaired: {error}; what was there is untouched',
                        'not_repaired') from error


def bag_files(bag: Path) -> list[Path]:
    """Return a bag's files in the order in which they were recorded; DataError on no bag."""
    if bag.is_file():
        return [bag]
    files = mcap_files(bag)
    if not files:
        raise DataError(f'{bag}: no bag there: expected a folder of MCAP files, or one of '
                        'them', 'no_bag')
    return files


def _open_finished(path: Path) -> Salvage:
    """Refuse what is no MCAP, and a file that its writer has still locked."""
    with path.open('rb') as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise DataError(f'{path}: still being recorded; stop the recorder first',
                            'still_recorded') from error
    return Salvage(path)


def _repair_file(found: Salvage) -> Repair:
    path = found.path
    repair = _survey(found)
    if found.indexed and not repair.lost:
        return repair
    written = Rewriting(path.with_name(f'.{path.name}.part'))
    try:
        for record in found.records():
            written.add(record)
        written.finish()
    except BaseException:
        written.drop()
        raise
    repair.kept_as = _exchange(path, written.path)
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
            if record.channel_id in topics:
                repair.contents.add(topics[record.channel_id], record.log_time)
            else:
                unknown += 1
    repair.lost = found.lost + [f'{unknown} messages whose topic is not known'] * (unknown > 0)
    return repair


def _exchange(path: Path, repaired: Path) -> Path:
    """Put a file in another's place; return where the other is kept. Never is there neither."""
    kept = free_name(path, 'damaged')
    try:
        os.link(path, kept)
    except OSError:  # a disk that knows no second name of a file
        path.rename(kept)
    repaired.replace(path)
    sync_folder(path.parent)
    return kept


def _repair_metadata(folder: Path, repairs: Sequence[Repair]) -> bool:
    """Write metadata.yaml where it is missing or says what is not so; return whether."""
    path = folder / 'metadata.yaml'
    topics = {name: topic for repair in repairs for name, topic in repair.topics.items()}
    information = bag_information(
        [(repair.path.name, repair.contents) for repair in repairs], topics.values())
    if path.exists():
        if _told(path) == _essence(information):
            return False
        path.rename(free_name(path, 'damaged'))
    write_whole(path, metadata_yaml(information))
    return True


def _told(path: Path) -> object:
    """Return what a metadata.yaml says of files and messages; None where it cannot be read."""
    try:
        return _essence(yaml.safe_load(path.read_text())['rosbag2_bagfile_information'])
    except (yaml.YAMLError, UnicodeError, KeyError, TypeError):
        return None


def _essence(information: dict[str, Any]) -> object:
    return (
        [Path(name).name for name in information['relative_file_paths']],
        {topic['topic_metadata']['name']: topic['message_count']
         for topic in information['topics_with_message_count'] if topic['message_count']})
