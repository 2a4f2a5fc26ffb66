"""An estimator made ready for a run; one from outside with the answers that every run asks for.

One that only takes reports, poses and commands and says where the robot is believes every pose: its
agreement is as old as the last pose, nothing was refused, and its scales are those it was told.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from hil.config.control import ControlConfig, EstimatorConfig
from hil.core.registries import ESTIMATORS

if TYPE_CHECKING:
    from hil.control.estimators.geometry import BelievedGeometry
    from hil.core.types import Estimate, Estimator, PoseMeasurement, WheelSample

_ASKED = ("agreement_age_s", "refused", "scales")


def make_estimator(
    name: str, config: ControlConfig | EstimatorConfig, geometry: BelievedGeometry
) -> Estimator:
    """Return the estimator `name` for a robot of the believed geometry; raises BadInput.

    It is given what every estimator assumes and the geometry; one with settings of its own gets them
    too: those of the outer loop where that is given, else their defaults.
    """
    entry = ESTIMATORS.get(name)
    fusion = config if isinstance(config, EstimatorConfig) else config.fusion
    own = config.own_settings_of(entry) if isinstance(config, ControlConfig) else None
    if entry.settings is not None and own is None:
        own = entry.settings()
    given = (fusion, geometry) if own is None else (fusion, geometry, own)
    made: Estimator = _completed(entry.factory(*given))
    return made


class _Completed:
    """Passes everything on to an estimator, and answers for it what it does not say itself."""

    def __init__(self, estimator: Any) -> None:
        self._own = estimator
        self._t_pose_s = -math.inf

    def on_wheels(self, sample: WheelSample) -> None:
        """Take one wheel report."""
        self._own.on_wheels(sample)

    def on_pose(self, t_exposure_s: float, measurement: PoseMeasurement) -> bool:
        """Take a pose; an estimator that does not say whether it was believed believed it."""
        believed = self._own.on_pose(t_exposure_s, measurement)
        believed = measurement.pose is not None if believed is None else bool(believed)
        if believed:
            self._t_pose_s = max(self._t_pose_s, t_exposure_s)
        return believed

    def on_command(self, t_effect_s: float, eta1_m_s: float, theta_dot_rad_s: float) -> None:
        """Take the body speeds in effect from `t_effect_s` on."""
        self._own.on_command(t_effect_s, eta1_m_s, theta_dot_rad_s)

    def estimate_at(self, t_host_s: float) -> Estimate | None:
        """Return the state predicted to `t_host_s`."""
        made: Estimate | None = self._own.estimate_at(t_host_s)
        return made

    def agreement_age_s(self, t_host_s: float) -> float:
        """Return the time since a pose was last believed; inf before the first."""
        if hasattr(self._own, "agreement_age_s"):
            return float(self._own.agreement_age_s(t_host_s))
        return t_host_s - self._t_pose_s

    @property
    def refused(self) -> tuple[float, float, float]:
        """The last pose not believed minus the one expected; zero where the estimator does not say."""
        own: tuple[float, float, float] = getattr(self._own, "refused", (0.0, 0.0, 0.0))
        return own

    @property
    def scales(self) -> tuple[float, float]:
        """What the camera sees of a metre and a radian of the wheels; 1 where it does not say."""
        own: tuple[float, float] = getattr(self._own, "scales", (1.0, 1.0))
        return own


def _completed(estimator: Any) -> Any:
    """Return the estimator itself where it answers everything, else with the rest answered for it."""
    return estimator if all(hasattr(estimator, name) for name in _ASKED) else _Completed(estimator)
