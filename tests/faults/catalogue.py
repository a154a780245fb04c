"""Every fault scenario, in the order of the table."""

from __future__ import annotations

from importlib import import_module

from tests.faults.scenarios import SCENARIOS

# Each module enters its scenarios as it is imported.
for _topic in ('bus_scenarios', 'target_scenarios', 'imu_scenarios', 'supply_scenarios',
               'posture_scenarios', 'processes', 'word_scenarios'):
    import_module(f'tests.faults.{_topic}')

FAULTS = tuple(SCENARIOS)
