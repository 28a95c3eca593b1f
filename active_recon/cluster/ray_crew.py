"""Work on the machines of a Ray cluster."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from importlib import import_module
import os
from pathlib import Path
import socket
import sys
import time
from typing import Any

from active_recon import __version__
from active_recon.cluster.bundles import attempt_all, Bundle, Bundles, Done
from active_recon.cluster.results import ATTEMPTS, DIED, Outcome, Result
from active_recon.cluster.storage import SharedFolder, Storage
from active_recon.cluster.stores import Place
from active_recon.errors import ConfigError, WorkError

_AHEAD = 3
"""Bundles given out for each CPU: enough that none waits for the driver, few enough to hold."""
_LOOK_EVERY = 5.0  # seconds
_ANSWERS_WITHIN = 10.0  # seconds
_LOOPBACK = '127.0.0.1'


def connect(address: str, workers: int | None) -> tuple[Any, str]:
    """
    Return Ray's module, connected to a cluster or to one begun here, and its dashboard's address.

    Raises ConfigError where Ray is not installed or there is no such cluster.
    """
    os.environ.setdefault('RAY_USAGE_STATS_ENABLED', '0')
    try:
        ray = import_module('ray')
    except ImportError as error:
        raise ConfigError('--cluster: no Ray here: expected it installed: pip install '
                          f'active_recon[cluster] ({error})') from error
    if address == 'auto':
        address = os.environ.get('RAY_ADDRESS') or address
    _require_listener(address)
    own: dict[str, Any] = {}
    if address == 'local':
        own = {'num_cpus': workers, 'dashboard_host': _LOOPBACK, '_node_ip_address': _LOOPBACK}
    elif address.startswith('127.') and not address.startswith(_LOOPBACK):
        # Ray reads 127.0.0.1 as this machine's address to others; the other loopback addresses
        # keep a cluster on this machine
        own['_node_ip_address'] = address.partition(':')[0]
    try:
        context = ray.init(address, logging_level='ERROR', log_to_driver=False, **own)
    except (ConnectionError, TimeoutError, RuntimeError, ValueError, ImportError,
            ray.exceptions.RayError) as error:
        reason = (str(error).splitlines() or [''])[0]
        raise ConfigError(_nobody(address, reason)) from error
    shown = context.dashboard_url
    return ray, f'http://{shown}' if shown else ''


def _require_listener(address: str) -> None:
    """Raise ConfigError where nothing listens at HOST:PORT, for which Ray would look minutes."""
    host, _, port = address.removeprefix('ray://').rpartition(':')
    if not port.isdecimal():
        return
    try:
        socket.create_connection((host, int(port)), _ANSWERS_WITHIN).close()
    except (OSError, OverflowError) as error:
        raise ConfigError(_nobody(address, str(error))) from error


def _nobody(address: str, reason: str) -> str:
    return (f'--cluster: no cluster at {address}: expected a Ray that runs there (`ray start '
            f'--head`; with RAY_AUTH_MODE=token, if it asks for a token), got: {reason}')


class RayCrew:
    """
    The CPUs of a Ray cluster, each with one item at a time.

    - dashboard: the address of Ray's dashboard, '' where it has none
    """

    def __init__(self, address: str, workers: int | None) -> None:
        self._ray, self.dashboard = connect(address, workers)
        self._most = workers

    @property
    def workers(self) -> int:
        """The CPUs that take items: those of the cluster now, or fewer where that was asked."""
        return min(self._cpus(), self._most or sys.maxsize)

    def map(self, function: Callable[[Any], Any], items: Iterable[Any],
            shared: Place | None = None, reads: Sequence[Place] = ()) -> Iterator[Result]:
        """Yield the results in the order of their completion; see `crew.Crew`."""
        ray = self._ray
        folder = None if shared is None else SharedFolder.of(shared)
        storage = Storage(folder, tuple(
            place.absolute() if isinstance(place, Path) else place for place in reads))
        function = partial(_seeing, storage, function)
        held = [ray.put(function)]
        task = ray.remote(_work)
        bundles = Bundles(items)
        pending: dict[Any, Bundle] = {}
        at_once, looked = self._at_once(), time.monotonic()
        try:
            while True:
                if time.monotonic() - looked > _LOOK_EVERY:  # machines come and go
                    at_once, looked = self._at_once(), time.monotonic()
                while len(pending) < at_once and (bundle := bundles.draw()):
                    retries = ATTEMPTS - 1 if len(bundle) == 1 else 0
                    spread = task.options(num_cpus=1, max_retries=retries,
                                          scheduling_strategy='SPREAD')
                    pending[spread.remote(held, __version__, [item for _, item in bundle])
                            ] = bundle
                if not pending:
                    return
                ready, _ = ray.wait(list(pending), num_returns=1)
                for ref in ready:
                    done, bundle = self._done(ref), pending.pop(ref)
                    if done is not None:
                        bundles.learn(done)
                        bundles.separate(bundle[len(done.outcomes):])
                        for (index, _), outcome in zip(bundle, done.outcomes, strict=False):
                            yield outcome.result(index)
                    elif len(bundle) > 1:
                        bundles.separate(bundle)
                    else:
                        yield DIED.result(bundle[0][0])
        finally:
            if ray.is_initialized():  # else an error of the caller's has ended the crew before
                for ref in pending:
                    ray.cancel(ref, force=True)
            if folder is not None:
                folder.forget()

    def close(self) -> None:
        """Leave the cluster; one that was started here ends."""
        self._ray.shutdown()

    def _cpus(self) -> int:
        return int(self._ray.cluster_resources().get('CPU', 0))

    def _at_once(self) -> int:
        """Return how many items may be given out; one that has to wait brings a worker."""
        cpus = self._cpus()
        return self._most if self._most and self._most < cpus else max(cpus, 1) * _AHEAD

    def _done(self, ref: Any) -> Done | None:
        """Return what became of a bundle; None: its worker died as often as it was begun."""
        errors = self._ray.exceptions
        try:
            done: Done = self._ray.get(ref)
        except (errors.WorkerCrashedError, errors.OutOfMemoryError, errors.NodeDiedError,
                errors.LocalRayletDiedError, errors.ObjectLostError):
            return None
        except errors.RayError as error:
            # Of a task that failed outside its function, for example for want of active_recon
            reason = str(getattr(error, 'cause', None) or error).splitlines() or ['']
            raise WorkError(f'--cluster: a worker failed: {reason[0]}') from error
        return done


_functions: dict[str, Callable[[Any], Any]] = {}


def _work(held: list[Any], version: str, items: list[Any]) -> Done:
    """Do a bundle in a worker, which keeps the function for the next."""
    if version != __version__:
        other = Outcome(refusal=f'{os.uname().nodename}: another active_recon: expected {version} '
                                f'as in the driver, got {__version__}', kind='version', stop=True)
        return Done([other] * len(items), 0.0)
    key = held[0].hex()
    if key not in _functions:
        _functions.clear()
        _functions[key] = import_module('ray').get(held[0])
    return attempt_all(_functions[key], items)


def _seeing(storage: Storage, function: Callable[[Any], Any], item: Any) -> Any:
    storage.require()
    return function(item)
