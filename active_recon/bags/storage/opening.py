"""Opening a bag: a file or a rosbag2 folder, in MCAP or sqlite3."""

from pathlib import Path

from active_recon.bags.storage.bag import Bag
from active_recon.bags.storage.compression import COMPRESSION_MODES, StoredFiles
from active_recon.bags.storage.files import numbered_files
from active_recon.bags.storage.mcap_bag import McapBag
from active_recon.bags.storage.metadata import yaml_mapping
from active_recon.errors import DataError
from mcap.writer import MCAP0_MAGIC

_STORAGES = ('mcap', 'sqlite3')


def open_bag(path: Path) -> Bag:
    """Return the bag in a file or a rosbag2 folder; raises DataError if there is none."""
    if not path.exists():
        raise DataError(f'{path}: no bag there: no such file or folder')
    if not path.is_dir():
        if not path.is_file():  # opening a named pipe waits for its writer
            raise DataError(f'{path}: no bag: expected a file or a folder, got a pipe or a device')
        alone = StoredFiles([path], 'file' if path.suffix == '.zstd' else '')
        return McapBag(path, alone) if _is_mcap(path) else _sqlite3_bag(path, alone)
    if (path / 'metadata.yaml').exists():
        storage, named = _described(path)
        return McapBag(path, named) if storage == 'mcap' else _sqlite3_bag(path, named)
    if files := numbered_files(path):
        return McapBag(path, StoredFiles(files))
    if files := numbered_files(path, '.db3'):
        return _sqlite3_bag(path, StoredFiles(files))
    raise DataError(f'{path}: no bag in this folder: it has neither metadata.yaml nor an MCAP or '
                    'sqlite3 file')


def _sqlite3_bag(path: Path, files: StoredFiles) -> Bag:
    # What reads databases takes as long to import as a bag of MCAP to read
    from active_recon.bags.storage.sqlite3_bag import Sqlite3Bag

    return Sqlite3Bag(path, files)


def _is_mcap(path: Path) -> bool:
    if path.suffix == '.zstd':
        return path.stem.endswith('.mcap')
    try:
        with path.open('rb') as file:
            return file.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC
    except OSError as error:
        raise DataError(f'{path}: cannot be read: {error.strerror}') from error


def _described(folder: Path) -> tuple[str, StoredFiles]:
    """Return the storage that metadata.yaml states, and the files that it lists."""
    path = folder / 'metadata.yaml'
    try:
        information = yaml_mapping(path.read_bytes(), str(path))['rosbag2_bagfile_information']
        storage = str(information['storage_identifier'])
        compression = str(information.get('compression_mode') or '').lower().replace('none', '')
        files = [folder / Path(str(name)).name for name in information['relative_file_paths']]
    except OSError as error:
        raise DataError(f'{path}: cannot be read: {error.strerror}') from error
    except (KeyError, TypeError, AttributeError) as error:
        raise DataError(f"{path}: not rosbag2's description of a bag: it lacks {error}"
                        ) from error
    for file in files:
        if not file.is_file():
            raise DataError(f'{file}: missing, though {path.name} lists it')
    if storage not in _STORAGES or compression not in COMPRESSION_MODES:
        raise DataError(f'{path}: unknown storage: expected {" or ".join(_STORAGES)}, compressed '
                        f'by file, by message or not at all, got {storage!r} and {compression!r}')
    return storage, StoredFiles(files, compression)
