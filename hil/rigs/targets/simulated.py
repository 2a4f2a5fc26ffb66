"""The targets `twin` and `pil`: the simulated robot, with the board's core or its own binary."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from hil.core.errors import BadInput
from hil.core.registries import TARGETS
from hil.core.types import Pose

if TYPE_CHECKING:
    from hil.config.scenario import Scenario
    from hil.core.rig import Rig
    from hil.rigs.asked import Asked
    from hil.wire.signing import Key


@TARGETS.register("twin", summary="the simulated robot and the board's core", simulated=True)
def twin(asked: Asked) -> Rig:
    """Return the twin; raises BadInput for a camera that a simulated robot is not seen by."""
    from sim_twin.twin import Twin  # noqa: PLC0415 - loads the renderer

    setup = replace(twin_setup(asked.scenario, asked.seed, asked.key), wired=asked.usb)
    return _signed(Twin(setup, _frame_maker(asked)), asked)


@TARGETS.register(
    "pil",
    summary="the simulated robot and the board's own binary under simavr",
    simulated=True,
    order=1,
)
def pil(asked: Asked) -> Rig:
    """Return the twin under the board's binary; raises BadInput where its simulator is missing."""
    from sim_twin.pil import Pil  # noqa: PLC0415 - needs simavr

    setup = twin_setup(asked.scenario, asked.seed, asked.key)
    uart = "0" if asked.usb else "1"
    return _signed(Pil(setup, _frame_maker(asked), uart=uart), asked)


def _signed(rig: Rig, asked: Asked) -> Rig:
    from hil.rigs.signed import SignedRig  # noqa: PLC0415

    return rig if asked.key is None else SignedRig(rig, asked.key)


def twin_setup(scenario: Scenario, seed: int, key: Key | None = None) -> Any:
    """Return what the simulated rig is made of; its board's storage holds the `key`."""
    from hil.board._firmware import stored_key  # noqa: PLC0415
    from hil.config.mismatch import true_robot  # noqa: PLC0415 - so that targets are known early
    from sim_twin.twin import TwinSetup  # noqa: PLC0415

    start = scenario.start
    return TwinSetup(
        robot=true_robot(scenario),
        link=scenario.link,
        camera=scenario.camera,
        start=Pose(start.x_m, start.y_m, start.theta_rad),
        seed=seed,
        disturbances=scenario.disturbances,
        faults=scenario.faults,
        eeprom=b"" if key is None else stored_key(key.secret, 0),
    )


def _frame_maker(asked: Asked) -> Any:
    """Return the renderer, or None for `--camera pose`; raises BadInput for anything else."""
    if asked.camera == "pose":
        return None
    if asked.camera != "rendered":
        raise BadInput(
            f"camera {asked.camera!r}: a simulated robot is seen by rendered or pose only"
        )
    from sim_twin.camera_sim import RenderedCamera  # noqa: PLC0415

    _refuse_out_of_view(asked.scenario)
    return RenderedCamera(asked.scenario.camera, asked.seed)


def _refuse_out_of_view(scenario: Scenario) -> None:
    """Raise BadInput where the camera does not see the robot's middle at the start: no run can begin so."""
    from vision.camera_setup import camera_model  # noqa: PLC0415 - with the renderer

    camera, start = scenario.camera, scenario.start
    model, (width, height) = camera_model(camera), (camera.width_px, camera.height_px)
    u_px, v_px = model.project_point(start.x_m, start.y_m, camera.marks.height_m)
    if 0.0 <= u_px < width and 0.0 <= v_px < height:
        return
    corners = model.floor_points([(0, 0), (width, 0), (width, height), (0, height)])
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    raise BadInput(
        f"start ({start.x_m:g}, {start.y_m:g}) m: the rendered camera does not see the robot there, but X "
        f"{x0:.2f} to {x1:.2f} m and Y {y0:.2f} to {y1:.2f} m of the floor; take --camera pose, or set "
        "start.x_m, start.y_m or camera.pose.eye_m"
    )
