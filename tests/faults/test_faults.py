"""Every fault, on the pulses that the emulated chip puts out, within its bounds."""

import pytest

from tests.faults.catalogue import FAULTS


@pytest.mark.parametrize('fault', FAULTS, ids=lambda fault: fault.name)
def test_the_robot_is_safe_within_the_bounds(fault):
    outcome = fault.run()
    assert outcome.frames <= fault.most_frames
    assert outcome.ms <= fault.most_ms + 1e-6
