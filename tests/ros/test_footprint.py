"""The brain on a robot: what it takes with its ear, its vocabulary and DDS."""

import json
import subprocess
import sys

import pytest

MEASURE = """
import json, sys
from w2b_hw.bench_ros import footprint
print(json.dumps(footprint(sys.argv[1], 2.0, 'physical_twin')))
"""


@pytest.mark.timeout(180)
def test_the_brain_takes_at_most_120_mb(tmp_path):
    """After a word never heard, an unknown one and a sentence; its own process, as `make bench`."""
    done = subprocess.run([sys.executable, '-c', MEASURE, str(tmp_path)], capture_output=True,
                          text=True, timeout=150, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert 20 < found['brain_rss_mb'] <= 120, found
