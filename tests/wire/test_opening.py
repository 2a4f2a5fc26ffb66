"""Opening a rig: what is asked for by name is looked at first, and nothing is left open."""

from __future__ import annotations

import os

import pytest

from hil.config.load import load_scenario
from hil.core.errors import BadInput, HilError, RigFault
from hil.rigs.opening import open_rig
from hil.rigs.serial import SerialRig

pty = pytest.importorskip("pty")


def test_a_port_that_is_not_there_is_named_before_the_camera() -> None:
    """Both are wrong: the port is what --on says."""
    with pytest.raises(RigFault, match=r"port /dev/nothing: no such port"):
        open_rig("serial:/dev/nothing", load_scenario("scenario-1"), "no-such-video.mkv", 1)


def test_a_camera_that_cannot_be_opened_gives_the_port_back() -> None:
    """The port is taken for this process alone; after the refusal it can be taken again."""
    board, port = pty.openpty()
    try:
        target = f"serial:{os.ttyname(port)}"
        with pytest.raises(HilError, match="no-such-video"):
            open_rig(target, load_scenario("scenario-1"), "no-such-video.mkv", 1)
        rig = SerialRig(os.ttyname(port), 57_600, None)
        with pytest.raises(RigFault, match="in use by another program"):
            SerialRig(os.ttyname(port), 57_600, None)
        rig.close()
    finally:
        os.close(board)
        os.close(port)


@pytest.mark.parametrize(
    ("start_x_m", "start_y_m", "seen"), [(0.0, 0.0, True), (1.6, 0.0, False), (0.0, -1.0, False)]
)
def test_a_rendered_start_that_the_camera_does_not_see_is_refused(
    start_x_m: float, start_y_m: float, seen: bool
) -> None:
    """The camera of the laboratory sees some 3 m x 2 m; drawn poses are seen anywhere."""
    where = [f"start.x_m={start_x_m}", f"start.y_m={start_y_m}"]
    scenario = load_scenario("scenario-1", where)
    open_rig("twin", scenario, "pose", 1).close()
    if seen:
        open_rig("twin", scenario, "rendered", 1).close()
        return
    with pytest.raises(BadInput, match=r"does not see the robot there.*--camera pose"):
        open_rig("twin", scenario, "rendered", 1)
