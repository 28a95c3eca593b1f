"""A bag in rosbag2's storage sqlite3."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import closing, contextmanager, ExitStack
from pathlib import Path
from shutil import copyfile
import sqlite3
from tempfile import TemporaryDirectory

from active_recon.bags.storage.bag import bag_summary, BagSummary, RawMessage
from active_recon.bags.storage.compression import StoredFiles
from active_recon.bags.storage.message_types import require_standard
from active_recon.bags.storage.metadata import (
    Contents,
    DURABILITIES,
    QosProfile,
    RELIABILITIES,
    Topic,
)
from active_recon.errors import ActiveReconError, DataError
from active_recon.reporting import Reporting, silent
from rosbags.interfaces import Connection, MessageDefinitionFormat
from rosbags.rosbag2 import Reader


class Sqlite3Bag:
    """Consecutive databases of the bag at a path, read by rosbags."""

    def __init__(self, path: Path, files: StoredFiles) -> None:
        self._path = path
        self._files = files

    def summary(self, reporting: Reporting = silent) -> BagSummary:
        """Return what is in the databases, all of which are read."""
        contents = Contents()
        topics: dict[str, Topic] = {}
        with self._readers() as readers, reporting(
                'checking the bag', sum(reader.message_count for reader in readers)) as advance:
            for reader in readers:
                topics |= {each.topic: Topic(each.topic, each.msgtype, _offered(each))
                           for each in reader.connections}
                for connection, received, data in reader.messages():
                    self._files.decompressed_message(data)
                    contents.add(connection.topic, received)
                    advance(1, '')
        return bag_summary(topics.values(), contents, {}, {})

    def messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        """Yield the messages of the topics, file after file, in the order of receive times."""
        with self._readers() as readers:
            for reader in readers:
                wanted = [each for each in reader.connections if each.topic in topics]
                for connection, received, data in reader.messages(wanted) if wanted else ():
                    yield RawMessage(connection.topic, connection.msgtype,
                                     self._files.decompressed_message(data), received, received)

    @contextmanager
    def _readers(self) -> Iterator[list[Reader]]:
        """Open a reader of each file; its errors are raised as DataError."""
        try:
            with (self._files.decompressed() as stored, _complete(stored) as files,
                  ExitStack() as stack):
                readers = [stack.enter_context(Reader(file)) for file in files]
                for connection in (each for reader in readers for each in reader.connections):
                    if connection.msgdef.format == MessageDefinitionFormat.MSG:
                        require_standard(
                            connection.msgtype, connection.msgdef.data.encode(), self._path)
                yield readers
        except ActiveReconError as error:
            reason = str(error)
            raise DataError(reason if reason.startswith(str(self._path))
                            else f'{self._path}: {reason}', error.kind) from error
        except Exception as error:  # the library raises all kinds of errors on damaged bytes
            raise DataError(f'{self._path}: no readable rosbag2 bag (MCAP or sqlite3): '
                            f'{" ".join(str(error).split())}') from error


@contextmanager
def _complete(files: Sequence[Path]) -> Iterator[list[Path]]:
    """
    Yield databases with all that was recorded, in the files' order.

    SQLite's log holds the last of it after a recorder was killed; it is taken in by a copy.
    """
    with TemporaryDirectory() as folder:
        yield [_with_logs(file, logs, Path(folder)) if (logs := _logs(file)) else file
               for file in files]


def _logs(file: Path) -> list[Path]:
    logs = (file.with_name(file.name + ending) for ending in ('-wal', '-journal'))
    return [log for log in logs if log.is_file() and log.stat().st_size]


def _with_logs(file: Path, logs: Sequence[Path], folder: Path) -> Path:
    for each in (file, *logs):
        copyfile(each, folder / each.name)
    with closing(sqlite3.connect(folder / file.name)) as database:
        database.execute('PRAGMA wal_checkpoint(TRUNCATE)')
    return folder / file.name


def _offered(connection: Connection) -> tuple[QosProfile, ...]:
    profiles = getattr(connection.ext, 'offered_qos_profiles', ())
    named = ((profile.reliability.name.lower(), profile.durability.name.lower())
             for profile in profiles)
    return tuple(QosProfile(reliability, durability) for reliability, durability in named
                 if reliability in RELIABILITIES and durability in DURABILITIES)
