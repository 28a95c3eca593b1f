"""Which storage a bag has: MCAP, or what else rosbag2 writes; a bare file or a folder."""

from pathlib import Path

from active_recon.bags.storage.compression import PACKINGS, StoredFiles
from active_recon.bags.storage.files import mcap_files
from active_recon.bags.storage.mcap_bag import McapBag
from active_recon.bags.storage.metadata import yaml_mapping
from active_recon.bags.storage.raw import Bag
from active_recon.bags.storage.rosbag2 import OtherBag
from active_recon.errors import DataError
from mcap.writer import MCAP0_MAGIC

_STORAGES = ('mcap', 'sqlite3')


def open_bag(path: Path) -> Bag:
    """Return the bag in a file or a rosbag2 folder; DataError where there is none."""
    if not path.exists():
        raise DataError(f'{path}: no bag there: there is no such file or folder')
    if not path.is_dir():
        alone = StoredFiles([path])
        return McapBag(path, alone) if _is_mcap(path) else OtherBag(path, alone)
    if (path / 'metadata.yaml').exists():
        storage, named = _described(path)
        return McapBag(path, named) if storage == 'mcap' else OtherBag(path, named)
    files = mcap_files(path)
    if not files:
        raise DataError(f'{path}: no bag in this folder: it has neither a metadata.yaml nor an '
                        'MCAP file')
    return McapBag(path, StoredFiles(files))


def _is_mcap(path: Path) -> bool:
    try:
        with path.open('rb') as file:
            return file.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC
    except OSError as error:
        raise DataError(f'{path}: cannot be read: {error.strerror}') from error


def _described(folder: Path) -> tuple[str, StoredFiles]:
    """Return the storage that metadata.yaml tells, and the files that it names."""
    path = folder / 'metadata.yaml'
    try:
        information = yaml_mapping(path.read_bytes(), str(path))['rosbag2_bagfile_information']
        storage = str(information['storage_identifier'])
        packed = str(information.get('compression_mode') or '').lower().replace('none', '')
        files = [folder / Path(str(name)).name for name in information['relative_file_paths']]
    except OSError as error:
        raise DataError(f'{path}: cannot be read: {error.strerror}') from error
    except (KeyError, TypeError, AttributeError) as error:
        raise DataError(f"{path}: another description than rosbag2's of a bag: it lacks "
                        f'{error}') from error
    for file in files:
        if not file.is_file():
            raise DataError(f'{file}: missing, though {path.name} names it')
    if storage not in _STORAGES or packed not in PACKINGS:
        raise DataError(f'{path}: a storage {storage!r}, packed {packed!r}: expected '
                        f"{' or '.join(_STORAGES)}, packed by file, by message or not at all")
    return storage, StoredFiles(files, packed)
