"""
Write the SROS2 policies of the running nodes, or check the existing file against them.

    python security/generate.py             # writes security/policies.xml
    python security/generate.py --check     # prints the differences, exit code 1 if there are any

Starts every node, with each parameter that changes its topics or services, on a free domain.
"""

import argparse
from collections.abc import Iterator
import os
from pathlib import Path
from tempfile import TemporaryDirectory
import time

from active_recon.geometry.cameras import orbit_camera
from active_recon.launching.loop_client import joined_domain
from active_recon.launching.processes import NodeProcesses, private_environment
from active_recon.nodes.runtime.graph_access import (
    Access,
    differences,
    joined,
    live_access,
    read_policies,
    write_policies,
)
from active_recon.parameters.recorder import TOPICS
from msg_tools.cameras import pose_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
from PIL import Image
from rclpy.node import Node, NodeNameNonExistentError
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Header

POLICIES = Path(__file__).with_name('policies.xml')
LOOP = '/policies_0'
RECORDED = '/policies_2'
"""Every recorded topic has a publisher here: the recorder subscribes to no others."""
OBSERVER = 'policies'
MESH = Path(__file__).parents[1] / 'active_recon' / 'objects' / 'chair.glb'
SETTLED_S = 5.0
"""Discovery is complete when all are ready and nothing has changed for so long."""
BUDGET_S = 150.0
_POLL_S = 0.25


def starts(folder: Path) -> dict[str, dict[str, dict[str, object]]]:
    """Return the nodes to start and their parameters, by namespace; the first is a whole loop."""
    pose = pose_to_msg(orbit_camera(0.0).pose, Header()).pose
    position, turn = pose.position, pose.orientation
    return {
        LOOP: {'recorder': {'output_dir': folder}, 'turntable_camera': {'mesh': MESH},
               'reconstructor': {'output_dir': folder}, 'view_planner': {}, 'viewer': {'port': 0}},
        '/policies_1': {'reconstructor': {
            'output_dir': folder, 'background': 'mask', 'publish_mesh': True,
            'use_depth': True, 'pose_source': 'turntable_joint',
            'camera_position': [position.x, position.y, position.z],
            'camera_orientation': [turn.x, turn.y, turn.z, turn.w]},
            'turntable_camera': {'mesh': MESH, 'follows': 'view'}},
        RECORDED: {'recorder': {'output_dir': folder}},
        '/policies_3': {'camera': {'source': folder}}}


def live_accesses() -> Iterator[tuple[bool, dict[str, Access]]]:
    """
    Start all nodes; yield repeatedly whether all are ready, and each node's access so far.

    Ends after BUDGET_S.
    """
    environment = private_environment()
    os.environ.update(environment)  # for the observer in this process
    with (TemporaryDirectory() as folder, joined_domain(OBSERVER) as (observer, _),
          NodeProcesses(Path(folder), environment) as nodes):
        Image.new('RGB', (64, 48)).save(Path(folder, 'image.png'))
        clock = observer.create_publisher(Clock, '/clock', 10)
        for topic in TOPICS:
            if not topic.startswith('/'):
                observer.create_publisher(Header, f'{RECORDED}/{topic}', 10)
        waiting = list(starts(Path(folder)).items())
        seen: dict[str, list[Access]] = {}
        deadline = time.monotonic() + BUDGET_S
        while time.monotonic() < deadline:
            nodes.check()
            clock.publish(Clock(clock=stamp_from_nanoseconds(time.time_ns())))
            for namespace, parameters in starts(Path(folder)).items():
                for name in parameters:
                    seen.setdefault(name, []).extend(_access(observer, name, namespace))
            known = {name: joined(each) for name, each in seen.items()}
            seen = {name: [access] for name, access in known.items()}
            ready = all(']: ready' in log.read_text() for log in Path(folder).glob('*.txt'))
            if ready and waiting:  # after the loop, since a viewer follows the first that it finds
                namespace, parameters = waiting.pop(0)
                for name, values in parameters.items():
                    nodes.start(name, {'use_sim_time': True, **values}, namespace)
                ready = False
            yield ready, known
            time.sleep(_POLL_S)


def _access(observer: Node, name: str, namespace: str) -> Iterator[Access]:
    try:
        access = live_access(observer, name, namespace)
        yield {kind: frozenset(each for each in names if not each.startswith(f'/{OBSERVER}/'))
               for kind, names in access.items()}
    except NodeNameNonExistentError:  # it is still starting
        return


def main() -> None:
    """Write the policies, or check them."""
    parser = argparse.ArgumentParser(description='The SROS2 policies of the nodes.')
    parser.add_argument('--check', action='store_true', help='compare without writing')
    parser.add_argument('--namespace', default='/', help='namespace of the loop in the policies')
    parser.add_argument('--file', type=Path, default=POLICIES)
    options = parser.parse_args()
    wanted = read_policies(options.file) if options.check else None
    settled_since, last = time.monotonic(), {}
    for ready, live in live_accesses():
        if not ready or live != last:
            settled_since, last = time.monotonic(), live
        if time.monotonic() - settled_since > SETTLED_S and wanted in (None, live):
            break
    if wanted is None:
        write_policies(options.file, last, options.namespace)
    elif found := differences(wanted, last):
        print('\n'.join(found))  # noqa: T201
        raise SystemExit(1)


if __name__ == '__main__':
    main()
