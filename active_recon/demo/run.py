"""The demo from start to end: start the nodes, observe the loop, save the results."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
import os
from pathlib import Path
from tempfile import TemporaryDirectory
import time

from active_recon.demo.table import loop_table, motion_line
from active_recon.errors import ActiveReconError
from active_recon.geometry.cameras import wrap_azimuth
from active_recon.interrupts import held_interrupts
from active_recon.launching.demo_monitor import demo_monitor, DemoMonitor
from active_recon.launching.processes import NodeProcesses, private_environment
from active_recon.models.weights_files import find_weights
from active_recon.policies import AUTO_POLICY, policy_in_use
from active_recon.report.words import counted
from active_recon.runtimes.precision import require_precision
from active_recon.viewer.address import free_port, HOST, is_served
from active_recon.viewer.view_result import ViewResult
import numpy as np
from rich.console import Console, RenderableType
from rich.live import Live

_LAST = 'reconstructor'  # to become active: the bag is to hold all that it hears and tells
_SPEED = 2.0  # rad/s of the turntable, twice as fast as by default: it is what most time goes to
_START_S = 60.0  # also where the machine is busy
_VIEW_S = 60.0
_ANSWER_S = 60.0
_LATE_S = 2.0  # for views that arrive after the planner's end


@dataclass(frozen=True)
class Demo:
    """
    What to show: a mesh file, the number of views, the policy that chooses them, and its seed.

    `model` is a weights file, or a model whose weights ship; None: the default. `precision` is
    that of the network. With `view` the loop is shown in the browser, too, and runs until Ctrl-C.
    """

    mesh: Path
    views: int = 5
    policy: str = AUTO_POLICY
    seed: int = 0
    output_dir: Path = Path('bags')
    view: bool = False
    model: str | None = None
    precision: str = 'auto'


def run_demo(demo: Demo, console: Console) -> Path:
    """
    Run the loop and return the folder with its bag, its mesh and its picture.

    Raises MeshError where the file is no mesh, NodeError where a node ends, ActiveReconError
    where the loop stalls. The nodes are stopped and the bag is closed in any case.
    """
    # An error here is clearer than one in two nodes
    require_precision(demo.precision)
    in_use = policy_in_use(demo.policy, find_weights(demo.model))
    if in_use.warning:
        console.print(in_use.warning, soft_wrap=True)
    demo = replace(demo, policy=in_use.name)
    environment = private_environment()
    os.environ.update(environment)  # for the observer in this process
    # A name that is longer would leave the picture
    title = f'{demo.mesh.stem:.40}: {counted(demo.views, "view")}, policy {demo.policy}'
    with (held_interrupts() as raise_if_asked, TemporaryDirectory() as logs,
          NodeProcesses(Path(logs), environment) as nodes):
        _start_loop(nodes, demo)
        # They start meanwhile: what reads and draws meshes takes a second to import, once here
        from active_recon.demo.known_object import KnownObject

        nodes.fork('turntable_camera', {'mesh': demo.mesh, 'speed': _SPEED,
                                        'start_azimuth': _start_azimuth(demo)})
        known = KnownObject(demo.mesh)
        console.print('starting the recorder, the turntable camera, the reconstructor and the '
                      f'view planner on ROS domain {environment["ROS_DOMAIN_ID"]}')

        def check() -> None:
            raise_if_asked()
            nodes.check()

        with demo_monitor(known.occupied) as monitor, ThreadPoolExecutor(1) as beside:
            folder = Path(monitor.trigger('start', _START_S, check))
            monitor.set_parameter(_LAST, 'output_dir', str(folder), _START_S, check)
            if demo.view:
                _open_page(nodes, monitor, console, check)
            monitor.until(monitor.is_recorded, _START_S, 'the recorder to subscribe', check)

            def save_mesh() -> None:
                saved = Path(monitor.trigger('save_mesh', _ANSWER_S, check))
                saved.replace(folder / f'{demo.mesh.stem}{saved.suffix}')

            def on_view(view: ViewResult) -> None:
                beside.submit(known.draw, view)
                if len(monitor.state.views) == 1:
                    # A node's first mesh takes longest: it is made while the turntable moves
                    with suppress(ActiveReconError):  # of one view there may be no surface yet
                        save_mesh()

            try:
                if not monitor.change_state(_LAST, 'activate', _START_S, check):
                    raise nodes.failure(_LAST, 'failed to activate')
                follow_loop(monitor, demo, title, console, check, on_view)
            finally:  # what there is of a run that was interrupted, too
                picture = beside.submit(known.save_picture, folder / 'run.png', title,
                                        monitor.state.views)
            save_mesh()
            monitor.trigger('stop', _ANSWER_S, check)
            picture.result()
            if demo.view:
                _keep_running(nodes, console)
    return demo.output_dir / folder.name


def _start_loop(nodes: NodeProcesses, demo: Demo) -> None:
    """Start the loop's nodes but its camera; one waits, configured, for the recorder."""
    network = {'precision': demo.precision, **({'weights': demo.model} if demo.model else {})}
    # Goals only: `auto` takes views by separation until it has discovered the planner.
    nodes.fork(_LAST, {'activate_at_start': False, 'take_views': 'at_goal', **network})
    nodes.fork('recorder', {'output_dir': demo.output_dir.absolute(),
                            'record_at_start': False})
    # A tolerance of 0 prevents an early end: all requested views are taken.
    nodes.fork('view_planner', {'policy': demo.policy, 'seed': demo.seed,
                                'max_views': demo.views, 'entropy_tolerance': 0.0, **network})


def _open_page(nodes: NodeProcesses, monitor: DemoMonitor, console: Console,
               check: Callable[[], None]) -> None:
    """Wait for the page: views taken before would be missing on it."""
    port = free_port()
    nodes.start('viewer', {'port': port})
    monitor.until(lambda: is_served(port), _START_S, 'the page', check)
    console.print(f'the page is at http://{HOST}:{port}')


def _keep_running(nodes: NodeProcesses, console: Console) -> None:
    """Keep the loop and its page running until Ctrl-C."""
    console.print('the bag is closed; the loop and its page run until Ctrl-C')
    with suppress(KeyboardInterrupt), held_interrupts() as raise_if_asked:
        while True:
            raise_if_asked()
            nodes.check()
            time.sleep(0.1)


def _start_azimuth(demo: Demo) -> float:
    """Return the camera's first azimuth, drawn with the seed."""
    return wrap_azimuth(np.random.default_rng(demo.seed).uniform(0, 2 * np.pi))


def follow_loop(monitor: DemoMonitor, demo: Demo, title: str, console: Console,
                check: Callable[[], None], on_view: Callable[[ViewResult], object]) -> None:
    """
    Show each view as it is taken, until the planner is done; call `on_view` with it.

    A view may be missed: views are latched one at a time, and nodes of a busy machine may
    discover each other only after the first.
    """
    began = time.monotonic()

    def table() -> RenderableType:
        state = monitor.state
        now = (f'done ({state.done}) after {time.monotonic() - began:.0f} s' if state.done
               else motion_line(state.camera, state.goal))
        return loop_table(title, state.views, now)

    def has_ended_or(number: int) -> bool:
        return monitor.is_done() or monitor.has_views(number)

    try:
        with Live(console=console, get_renderable=table, refresh_per_second=10):
            for number in range(1, demo.views + 1):
                monitor.until(partial(has_ended_or, number), _VIEW_S, f'view {number}', check)
                for view in monitor.state.views[number - 1:number]:
                    on_view(view)
            monitor.until(monitor.is_done, _ANSWER_S, 'the planner to be done', check)
            monitor.within(partial(monitor.has_views, demo.views), _LATE_S, check)
    finally:
        if not console.is_terminal:  # there `Live` does not end its last line
            console.line()
    received = len(monitor.state.views)
    if monitor.state.done == 'max_views' and received < demo.views:
        console.print(f'{demo.views - received} of the {demo.views} views did not reach the '
                      'table and the picture, since the machine is busy: they are in the bag',
                      soft_wrap=True)
