"""`hil bringup --floor`: whether this robot turns on this floor, on twins that do and do not."""

from __future__ import annotations

import pytest

from hil.cli.bringup import Nobody
from hil.config.camera import CameraConfig
from hil.config.link import LinkConfig
from hil.core.types import Pose
from hil.tools.bringup.procedure import BringUp, Plan
from sim_twin.twin import Twin, TwinSetup
from tests.bringup.rigs import NEEDED_RAD_S
from tests.twin.rigs import robot


def turned(friction_ratio, **changes):
    """Return the turn checks of a twin on a floor of this friction, and the twin."""
    floor = robot().floor.model_copy(update={"friction_ratio": friction_ratio})
    plant = robot(**changes).model_copy(update={"floor": floor})
    setup = TwinSetup(plant, LinkConfig(), CameraConfig(), Pose(0.0, 0.0, 0.0), 1)
    twin = Twin(setup)
    report = BringUp(twin, Nobody(), Plan(robot(), NEEDED_RAD_S, 0.0, 2.5), lambda _: None).run()
    return [check for check in report.checks if check.name.startswith("turn")], twin


def test_a_robot_that_turns_passes_both_ways_and_stands_at_the_end():
    """On the usual floor (0.4) a turn begins well below the limit, and is faster than laws ask for."""
    checks, twin = turned(0.4)
    assert [check.name for check in checks] == ["turn to the left", "turn to the right"]
    assert {check.state for check in checks} == {"ok"}
    before = twin.truth().pose.theta_rad
    twin.wait(twin.now_s() + 0.5)
    assert twin.truth().pose.theta_rad == pytest.approx(before, abs=1e-3)


@pytest.mark.parametrize(("friction", "changes"), [(0.95, {}), (0.4, {"mass_kg": 7.5})])
def test_a_floor_with_too_much_grip_or_too_much_weight_is_told(friction, changes):
    """Negative control: friction 0.95, or 7.5 kg: both ways fail, with what to do."""
    checks, _ = turned(friction, **changes)
    assert {check.state for check in checks} == {"fail"}
    assert {check.fault for check in checks} <= {"no_turn", "weak_turn"}
    assert all("less grip" in check.remedy for check in checks)
