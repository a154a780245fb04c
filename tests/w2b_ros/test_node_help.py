"""`--help` of the nodes teaches: every parameter with its default and what it means."""

import subprocess
import sys

import pytest

rclpy = pytest.importorskip('rclpy')

NODES = {'brain': ('w2b_controller.brain', 'w2b_controller.brain_node'),
         'sim': ('w2b_sim.sim', 'w2b_sim.sim_node'),
         'hardware': ('w2b_hw.node', 'w2b_hw.hardware_node')}


@pytest.mark.parametrize('executable', NODES)
@pytest.mark.parametrize('option', ['-h', '--help'])
def test_help_names_every_parameter_and_starts_nothing(executable, option):
    module, node_module = NODES[executable]
    done = subprocess.run(
        [sys.executable, '-c', f'from {module} import main; raise SystemExit(main())', option],
        capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    parameters = __import__(node_module, fromlist=['PARAMETERS']).PARAMETERS
    assert len(parameters) > 5
    for parameter in parameters:
        assert parameter.name in done.stdout
        assert parameter.description.split()[0] in done.stdout
    assert f'{executable} --ros-args' in done.stdout
