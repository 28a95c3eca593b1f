"""The SROS2 policies allow each node what it really has on the live graph, and no more."""

import os
from pathlib import Path
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

from active_recon.errors import DataError
from active_recon.nodes.runtime.graph_access import (
    differences,
    joined,
    read_policies,
    write_policies,
)
import pytest

from .processes import ROOT

pytestmark = pytest.mark.ros
POLICIES = ROOT / 'security' / 'policies.xml'
NODES = {path.name for path in (ROOT / 'scripts').iterdir()
         if path.name not in ('active-recon', 'composed')}


@pytest.mark.slow
def test_the_policies_name_what_the_live_nodes_have_and_no_more():
    done = subprocess.run(
        [sys.executable, 'security/generate.py', '--check'], cwd=ROOT, text=True,
        env={**os.environ, 'PYTHONPATH': str(ROOT)}, capture_output=True)
    assert done.returncode == 0, f'{done.stdout}{done.stderr}\nrun python security/generate.py'


def test_every_node_has_an_enclave_of_its_own_and_no_name_is_a_pattern():
    enclaves = ElementTree.parse(POLICIES).getroot().findall('enclaves/enclave')
    assert {each.get('path') for each in enclaves} == {f'/active_recon/{name}' for name in NODES}
    for enclave in enclaves:
        profile, = enclave.findall('profiles/profile')
        assert enclave.get('path') == f'/active_recon/{profile.get("node")}'
    names = [each.text for each in ElementTree.parse(POLICIES).getroot().iter()
             if each.tag in ('topic', 'service')]
    assert not [name for name in names if set('*?[]') & set(name)]


@pytest.mark.parametrize('namespace', ['/', '/cell_1'])
def test_policies_come_back_as_they_were_written(tmp_path, namespace):
    policies = read_policies(POLICIES)
    write_policies(tmp_path / 'policies.xml', policies, namespace)
    assert read_policies(tmp_path / 'policies.xml') == policies
    profiles = ElementTree.parse(tmp_path / 'policies.xml').getroot().iter('profile')
    assert {profile.get('ns') for profile in profiles} == {namespace}


def test_what_is_missing_or_too_much_is_named():
    allowed = {'camera': joined([{('topic', 'publish'): frozenset({'image', 'old'})}])}
    live = {'camera': joined([{('topic', 'publish'): frozenset({'image'}),
                               ('service', 'reply'): frozenset({'reset'})}])}
    assert differences(allowed, live) == [
        'camera: may publish the topic old, but does not',
        'camera: does reply the service reset, but may not']
    assert not differences(live, live)


@pytest.mark.parametrize('text', ['', '<policy>', '<policy><enclaves><enclave><profiles><profile/>'
                                  '</profiles></enclave></enclaves></policy>'])
def test_a_file_that_is_no_policy_is_refused(tmp_path, text):
    path = Path(tmp_path, 'policies.xml')
    path.write_text(text)
    with pytest.raises(DataError, match='not readable: expected SROS2 policies'):
        read_policies(path)
