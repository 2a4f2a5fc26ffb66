"""Targets: what stands below the byte stream and the camera frame, chosen by name."""

from __future__ import annotations

from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.config.load import build
from hil.config.robot import RobotConfig
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
        from hil.config.scenario import Scenario as Recorded  # noqa: PLC0415
        from hil.replays.exact import open_replay, read_source, refuse_other_task  # noqa: PLC0415

        source = read_source(Path(target.removeprefix(REPLAY)))
        recorded = build(Recorded, source.manifest.scenario, str(source.path))
        refuse_other_task(scenario, recorded, source.path)
        return open_replay(source, recorded)
    raise BadInput(f"target {target!r}: unknown; choose twin, pil, serial:DEV[@BAUD] or replay:RUN")


def true_robot(scenario: Scenario) -> RobotConfig:
    """Return the robot as it really is: the believed one with the scenario's mismatch applied."""
    tree = scenario.robot.model_dump()
    for key, ratio in scenario.mismatch.items():
        *path, leaf = key.split(".")
        try:
            table: dict[str, Any] = reduce(lambda node, part: node[part], path, tree)
            table[leaf] = float(table[leaf]) * ratio
        except (KeyError, TypeError, ValueError):
            raise BadInput(f"mismatch.{key}: not a number of the robot's file") from None
    return build(RobotConfig, tree, "mismatch")


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
