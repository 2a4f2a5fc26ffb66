"""What the report needs of the numerical evaluation of section 8.9 (the circle, ideal sensing)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

Pairs = Sequence[tuple[float, float]]


class Signals(Protocol):
    """Signals of one ideal run, one entry a control step (`hil.study.ideal_circle.IdealRun`)."""

    @property
    def t_s(self) -> Sequence[float]:
        """Time."""

    @property
    def z1_m(self) -> Pairs:
        """Flat output, world X and Y."""

    @property
    def z1_ref_m(self) -> Pairs:
        """Desired flat output."""

    @property
    def delta1_m(self) -> Pairs:
        """Error z1 - z1*."""

    @property
    def s(self) -> Pairs:
        """Sliding variable in m/s^2, NaN for a law without one."""

    @property
    def u(self) -> Pairs:
        """Control (zeta, u2) in m/s^2."""


@dataclass(frozen=True, slots=True)
class CircleRun:
    """One law on the circle, as arrays: times (N,), vectors (N, 2), world axes, SI."""

    t_s: Array
    z1_m: Array
    z1_ref_m: Array
    delta1: Array
    s: Array
    u: Array

    @classmethod
    def of(cls, signals: Signals) -> CircleRun:
        """Return the arrays of one ideal run."""
        lists = (signals.z1_m, signals.z1_ref_m, signals.delta1_m, signals.s, signals.u)
        return cls(np.asarray(signals.t_s, float), *(np.asarray(pairs, float) for pairs in lists))

    @property
    def ise_m2_s(self) -> float:
        """Return the integral of |delta1|^2."""
        return float((self.delta1**2).sum() * (self.t_s[1] - self.t_s[0]))

    def worst_mm(self, last_s: float) -> float:
        """Return the largest |delta1| of the last `last_s`, in mm."""
        late = self.t_s > self.t_s[-1] - last_s
        return float(np.hypot(self.delta1[late, 0], self.delta1[late, 1]).max() * 1e3)

    @property
    def s_norm_max_m_s2(self) -> float:
        """Return the largest ||s||; NaN for a law without a sliding variable."""
        return float(np.hypot(self.s[:, 0], self.s[:, 1]).max())


@dataclass(frozen=True, slots=True)
class CircleStudy:
    """Section 8.9: the runs by law, the layer eps, and the disturbance in words."""

    runs: Mapping[str, CircleRun]
    layer_m_s2: float
    disturbance: str

    @classmethod
    def of(cls, runs: Mapping[str, Signals], layer_m_s2: float, disturbance: str) -> CircleStudy:
        """Return the study of ideal runs by law name, "pid" first as in every figure."""
        ordered = sorted(runs, key=lambda law: (law != "pid", law))
        return cls({law: CircleRun.of(runs[law]) for law in ordered}, layer_m_s2, disturbance)

    def findings(self) -> list[str]:
        """Return plain sentences on the layer and on the error integral."""
        lines = []
        for law, run in self.runs.items():
            if np.isfinite(run.s_norm_max_m_s2):
                inside = run.s_norm_max_m_s2 <= self.layer_m_s2
                word = "stays in" if inside else "LEAVES"
                lines.append(
                    f"{law}: ‖s‖ {word} the layer ε = {self.layer_m_s2:g} m/s² from the first "
                    f"instant on; its largest value is {run.s_norm_max_m_s2:.3g} m/s²."
                )
        told = ", ".join(f"{law} {run.ise_m2_s:.3g} m²·s" for law, run in self.runs.items())
        worst = ", ".join(f"{law} {run.worst_mm(10.0):.3g} mm" for law, run in self.runs.items())
        lines.append(f"∫|δ1|² dt: {told}{self._factor()}.")
        lines.append(f"Worst |δ1| of the last 10 s: {worst}.")
        return lines

    def _factor(self) -> str:
        if set(self.runs) != {"pid", "asg-ism"}:
            return ""
        ratio = self.runs["pid"].ise_m2_s / self.runs["asg-ism"].ise_m2_s
        who = "asg-ism" if ratio > 1 else "pid"
        return f"; {who} is better by a factor of {max(ratio, 1 / ratio):.2g}"
