"""Robots and rigs the twin's tests are made with."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from importlib.resources import files
from typing import Any

from hil.config.camera import CameraConfig
from hil.config.events import Disturbance, Fault
from hil.config.link import LinkConfig
from hil.config.robot import RobotConfig
from hil.core.types import Pose
from hil.wire import handshake
from hil.wire.link import BoardLink, WheelReport
from sim_twin import _native
from sim_twin.camera_faults import FrameMaker
from sim_twin.setup import plant_params
from sim_twin.twin import Twin, TwinSetup

NO_LOADS = [0.0] * len(_native.LOADS)
# Nothing between host and board but a fast wire: for tests of the robot, not of the link.
FAST_LINK = LinkConfig(baud=1_000_000, latency_s=0.001, latency_jitter_s=0.0)


def robot(**changes: Any) -> RobotConfig:
    """Return the thesis robot with values replaced: `motor_coulomb_n_m=0` or `mass_kg=3`."""
    text = (files("hil") / "data" / "robots" / "thesis-4wd.toml").read_text(encoding="utf-8")
    tree = tomllib.loads(text)
    for name, value in changes.items():
        group, _, rest = name.partition("_")
        if isinstance(tree.get(group), dict):
            tree[group][rest] = value
        else:
            tree[name] = value
    return RobotConfig.model_validate(tree)


def ideal_robot(**changes: Any) -> RobotConfig:
    """Return the robot without any friction, drop, battery resistance or gear loss."""
    lossless = {
        "motor_coulomb_n_m": 0.0,
        "motor_stiction_n_m": 0.0,
        "motor_viscous_n_m_s_rad": 0.0,
        "motor_gear_efficiency_ratio": 1.0,
        "bridge_drop_v": 0.0,
        "bridge_resistance_ohm": 0.0,
        "battery_resistance_ohm": 0.0,
        "floor_rolling_ratio": 0.0,
        "floor_friction_ratio": 0.0,
    }
    return robot(**(lossless | changes))


def plant(config: RobotConfig) -> _native.Plant:
    """Return the robot's plant at rest at the origin."""
    return _native.Plant(plant_params(config))


def settle(
    model: _native.Plant,
    left: float,
    right: float,
    seconds: float = 3.0,
    loads: Sequence[float] = NO_LOADS,
    step_s: float = 1e-4,
) -> dict[str, float]:
    """Run the plant at constant duty and return its state by name."""
    model.run(round(seconds / step_s), step_s, left, right, loads)
    return named(model.state)


def named(state: Sequence[float]) -> dict[str, float]:
    """Return a state by name."""
    return dict(zip(_native.STATES, state, strict=True))


def loads(**values: float) -> list[float]:
    """Return a load vector: `loads(slope_x_rad=0.1)`."""
    return [values.get(name, 0.0) for name in _native.LOADS]


class Drive:
    """A twin with its board brought up, driven at constant wheel speeds without an outer loop."""

    def __init__(
        self,
        config: RobotConfig | None = None,
        *,
        link: LinkConfig = FAST_LINK,
        seed: int = 1,
        start: Pose = Pose(0.0, 0.0, 0.0),  # noqa: B008
        disturbances: tuple[Disturbance, ...] = (),
        faults: tuple[Fault, ...] = (),
        maker: FrameMaker | None = None,
    ) -> None:
        setup = TwinSetup(
            config or robot(), link, CameraConfig(), start, seed, disturbances, faults
        )
        self.twin = Twin(setup, maker)
        self.link = BoardLink(self.twin.stream)
        self.reports: list[WheelReport] = []

    def arm(self) -> None:
        """Bring the board up and arm it."""
        handshake.finish(self.link, self.twin, handshake.read_info(self.link))
        info = self.link.info
        arming = handshake.arm(self.link, info.dialect_hash, info.parameter_hash)
        handshake.finish(self.link, self.twin, arming)

    def run(
        self, seconds: float, left_rad_s: float, right_rad_s: float, *, speak: bool = True
    ) -> list[WheelReport]:
        """Send set-points at 30 Hz for a while; return the wheel reports of that while."""
        first = len(self.reports)
        begin_s = self.twin.now_s()
        for tick in range(round(30 * seconds)):
            if speak:
                self.link.send_setpoint(self.twin.now_s(), left_rad_s, right_rad_s)
            self._until(begin_s + (tick + 1) / 30)
        return self.reports[first:]

    def _until(self, until_s: float) -> None:
        while self.twin.now_s() < until_s:
            self.twin.wait(until_s)
            self.reports += self.link.poll(self.twin.now_s())


def armed(**arguments: Any) -> Drive:
    """Return a Drive that is armed and whose events count from now."""
    drive = Drive(**arguments)
    drive.arm()
    drive.twin.begin(drive.twin.now_s())
    return drive


def first(reports: Sequence[WheelReport], holds: Callable[[Any], bool]) -> Any:
    """Return the first wheel state for which `holds` is true, or None."""
    return next((report.wire for report in reports if holds(report.wire)), None)
