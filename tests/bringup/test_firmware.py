"""The bring-up over the firmware's own ELF on a simulated ATmega2560."""

from __future__ import annotations

import pytest

from hil.config.camera import CameraConfig
from hil.config.events import Fault
from hil.config.link import LinkConfig
from hil.core.types import Pose
from sim_twin.pil import Pil
from sim_twin.twin import TwinSetup
from tests.bringup.rigs import bring_up
from tests.bringup.test_procedure import DEAD_DUTY, DEAD_DUTY_ERROR, TOP_SPEED_RAD_S
from tests.pil.rigs import needs_toolchain
from tests.twin.rigs import robot


@needs_toolchain
def test_the_firmware_itself_is_brought_up():
    """Swapped phases left are named; the sound right side has the plant's dead zone and speed."""
    setup = TwinSetup(
        robot(variant="lifted"), LinkConfig(), CameraConfig(), Pose(0.0, 0.0, 0.0), 1,
        faults=(Fault(kind="swapped_phases", side="left"),),
    )  # fmt: skip
    report, _ = bring_up(Pil(setup), turns=0.0)
    assert report.faults == [("left encoder", "swapped_phases")]
    found = report.measured
    assert found.dead_duty_forward is not None
    assert found.dead_duty_forward[1] == pytest.approx(DEAD_DUTY, abs=DEAD_DUTY_ERROR)
    assert found.top_speed_forward_rad_s is not None
    # One side alone: 0.035 V more battery.
    assert found.top_speed_forward_rad_s[1] == pytest.approx(TOP_SPEED_RAD_S + 0.1, abs=0.1)
