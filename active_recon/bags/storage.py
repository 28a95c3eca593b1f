"""Which storage a bag has: MCAP, or what else rosbag2 writes; a bare file or a folder."""

from pathlib import Path

from active_recon.bags.files import mcap_files
from active_recon.bags.mcap_bag import McapBag
from active_recon.bags.metadata import yaml_mapping
from active_recon.bags.raw import Bag
from active_recon.bags.rosbag2 import OtherBag
from active_recon.errors import DataError
from mcap.writer import MCAP0_MAGIC


def open_bag(path: Path) -> Bag:
    """Return the bag in a file or a rosbag2 folder; DataError where there is none."""
    if not path.exists():
        raise DataError(f'{path}: expected a bag, but there is nothing')
    if not path.is_dir():
        return McapBag(path, [path]) if _is_mcap(path) else OtherBag(path)
    files = mcap_files(path)
    if (path / 'metadata.yaml').exists():
        named = _named_files(path)
        if named is None:
            return OtherBag(path)
        files = named
    if not files:
        raise DataError(f'{path}: expected a folder with a bag, got neither a metadata.yaml nor '
                        'an MCAP file')
    return McapBag(path, files)


def _is_mcap(path: Path) -> bool:
    try:
        with path.open('rb') as file:
            return file.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC
    except OSError as error:
        raise DataError(f'{path}: cannot be read: {error.strerror}') from error


def _named_files(folder: Path) -> list[Path] | None:
    """Return the MCAP files that metadata.yaml names; None where rosbag2 stored otherwise."""
    path = folder / 'metadata.yaml'
    try:
        information = yaml_mapping(path.read_bytes(), str(path))['rosbag2_bagfile_information']
        if information['storage_identifier'] != 'mcap' or information.get('compression_mode'):
            return None
        files = [folder / Path(str(name)).name for name in information['relative_file_paths']]
    except OSError as error:
        raise DataError(f'{path}: cannot be read: {error.strerror}') from error
    except (KeyError, TypeError, AttributeError) as error:
        raise DataError(f"{path}: expected rosbag2's description of a bag, got another "
                        f'({error})') from error
    for file in files:
        if not file.is_file():
            raise DataError(f'{file}: expected the file that {path.name} names, but it is missing')
    return files
