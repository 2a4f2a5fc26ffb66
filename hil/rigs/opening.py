"""Targets: what stands below the byte stream and the camera frame, chosen by name."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.config.mismatch import true_robot
from hil.core.errors import BadInput

if TYPE_CHECKING:
    from hil.config.scenario import Scenario
    from hil.core.rig import Rig

SIMULATED = ("twin", "pil")
REPLAY = "replay:"


def open_rig(target: str, scenario: Scenario, camera: str, seed: int) -> Rig:
    """Return the rig that `target` names, ready to be talked to; raises BadInput or RigFault."""
    # Each target's own packages are imported only when it is the one asked for.
    if target == "twin":
        from sim_twin.twin import Twin  # noqa: PLC0415

        return Twin(twin_setup(scenario, seed), frame_maker(scenario, camera, seed))
    if target == "pil":
        from sim_twin.pil import Pil  # noqa: PLC0415

        return Pil(twin_setup(scenario, seed), frame_maker(scenario, camera, seed))
    if target.startswith("serial:"):
        from hil.rigs.frames import open_source  # noqa: PLC0415
        from hil.rigs.serial import SerialRig, parse_target  # noqa: PLC0415

        device, baud = parse_target(target)
        return SerialRig(device, baud, open_source(camera, scenario.camera))
    if target.startswith(REPLAY):
        from hil.record.source import read_source, recorded_scenario  # noqa: PLC0415
        from hil.rigs.replay import open_replay, refuse_other_task  # noqa: PLC0415

        source = read_source(Path(target.removeprefix(REPLAY)))
        recorded = recorded_scenario(source.manifest, source.path)
        refuse_other_task(scenario, recorded, source.path)
        return open_replay(source, recorded)
    raise BadInput(f"target {target!r}: unknown; choose twin, pil, serial:DEV[@BAUD] or replay:RUN")


def twin_setup(scenario: Scenario, seed: int) -> Any:
    """Return what the simulated rig is made of."""
    from hil.core.types import Pose  # noqa: PLC0415
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
    )


def frame_maker(scenario: Scenario, camera: str, seed: int) -> Any:
    """Return the renderer, or None for `--camera pose`; raises BadInput for anything else."""
    if camera == "pose":
        return None
    if camera != "rendered":
        raise BadInput(f"camera {camera!r}: a simulated robot is seen by rendered or pose only")
    from sim_twin.camera_sim import RenderedCamera  # noqa: PLC0415

    return RenderedCamera(scenario.camera, seed)
