"""An outer law of your own: what the robot shall do next, from where it is and where it should be.

    hil run scenario-1 --outer ./my-thing.py
    hil check law my-thing.py
    hil tune --outer ./my-thing.py
    hil experiment --outer ./my-thing.py --outer pid --outer asg-ism

World frame: X right and Y up on the floor; theta counter-clockwise from +X; SI units and radians.
"""

import math
from collections.abc import Sequence

import numpy as np

import hil


class Gains(hil.Section):
    """What may be set with --set control.gains.tuned.my_thing.KEY=VALUE, and is tuned."""

    speed_s: float = hil.quantity("1/s", "speed per distance to the point", 1.0, gt=0, le=20)
    turn_rad_s: float = hil.quantity("rad/s", "turn rate when it lies abeam", 2.0, gt=0, le=20)


@hil.outer_law(
    "my-thing",
    settings=Gains,
    search={"speed_s": (0.2, 1.0, 5.0), "turn_rad_s": (0.5, 2.0, 10.0)},
    colour="#009e73",
    trace={"abeam_m_s": ("m/s", "wanted speed across the heading, left positive")},
)
class MyThing:
    """Drives towards the point and turns its nose to it; one instance runs one robot."""

    def __init__(self, gains: Gains, limits: hil.OuterLimits, d0_m: float) -> None:  # noqa: ARG002
        self._gains = gains
        self._limits = limits
        self._forward_m_s = 0.0

    def reset(self, reference: hil.ReferenceState, estimate: hil.Estimate) -> None:  # noqa: ARG002
        """Start anew from this estimate: no state of an earlier run may be left."""
        self._forward_m_s = estimate.eta1_m_s

    def step(
        self, reference: hil.ReferenceState, estimate: hil.Estimate, dt_s: float
    ) -> hil.OuterCommand:
        """Return forward speed and turn rate for the next `dt_s`, and what is worth plotting."""
        limits, gains = self._limits, self._gains
        (x_m, y_m), (x_ref_m, y_ref_m) = estimate.z1_m, reference.z1_m
        wish_x = reference.z1_dot_m_s[0] + gains.speed_s * (x_ref_m - x_m)
        wish_y = reference.z1_dot_m_s[1] + gains.speed_s * (y_ref_m - y_m)
        cos, sin = math.cos(estimate.pose.theta_rad), math.sin(estimate.pose.theta_rad)
        ahead, abeam = cos * wish_x + sin * wish_y, cos * wish_y - sin * wish_x
        most_m_s = min(limits.eta1_max_m_s, limits.approach_speed_m_s or math.inf)
        ahead = min(max(ahead, -most_m_s), most_m_s)
        change = limits.zeta_max_m_s2 * dt_s  # no faster, or the wheels slip
        self._forward_m_s += min(max(ahead - self._forward_m_s, -change), change)
        self._forward_m_s = min(max(self._forward_m_s, -most_m_s), most_m_s)
        turn = gains.turn_rad_s * abeam / (math.hypot(wish_x, wish_y) + 0.02)
        turn = min(max(turn, -limits.theta_dot_max_rad_s), limits.theta_dot_max_rad_s)
        return hil.OuterCommand(self._forward_m_s, turn, {"abeam_m_s": abeam})

    @classmethod
    def batch(cls, laws: Sequence["MyThing"]) -> "MyThings":
        """Return what steps many runs at once; leave it out, and campaigns ask `step` run by run."""
        return MyThings(laws)


class MyThings:
    """The same law for many runs side by side: arrays with one number a run, each its own gains."""

    def __init__(self, laws: Sequence[MyThing]) -> None:
        gains, limits = [law._gains for law in laws], [law._limits for law in laws]
        self._speed_s = np.array([one.speed_s for one in gains])
        self._turn_rad_s = np.array([one.turn_rad_s for one in gains])
        fastest = [min(one.eta1_max_m_s, one.approach_speed_m_s or math.inf) for one in limits]
        self._most_m_s = np.array(fastest)
        self._zeta_m_s2 = np.array([one.zeta_max_m_s2 for one in limits])
        self._turn_most_rad_s = np.array([one.theta_dot_max_rad_s for one in limits])
        self._forward_m_s = np.zeros(len(laws))

    def reset_batch(
        self,
        where: np.ndarray,
        reference: hil.ReferenceBatch,  # noqa: ARG002
        estimate: hil.EstimateBatch,
    ) -> None:
        """Start those at the places `where` anew."""
        self._forward_m_s[where] = estimate.eta1_m_s

    def step_batch(
        self,
        where: np.ndarray,
        reference: hil.ReferenceBatch,
        estimate: hil.EstimateBatch,
        dt_s: np.ndarray,
    ) -> hil.CommandBatch:
        """Return the commands of those at `where`, whose tick it is; the arrays have their order."""
        (x_m, y_m), (x_ref_m, y_ref_m) = estimate.z1_m, reference.z1_m
        speed_s, most_m_s = self._speed_s[where], self._most_m_s[where]
        wish_x = reference.z1_dot_m_s[0] + speed_s * (x_ref_m - x_m)
        wish_y = reference.z1_dot_m_s[1] + speed_s * (y_ref_m - y_m)
        cos, sin = np.cos(estimate.pose.theta_rad), np.sin(estimate.pose.theta_rad)
        ahead, abeam = cos * wish_x + sin * wish_y, cos * wish_y - sin * wish_x
        ahead = np.minimum(np.maximum(ahead, -most_m_s), most_m_s)
        change = self._zeta_m_s2[where] * dt_s
        forward_m_s = self._forward_m_s[where]
        forward_m_s = forward_m_s + np.minimum(np.maximum(ahead - forward_m_s, -change), change)
        forward_m_s = np.minimum(np.maximum(forward_m_s, -most_m_s), most_m_s)
        self._forward_m_s[where] = forward_m_s
        turn = self._turn_rad_s[where] * abeam / (np.hypot(wish_x, wish_y) + 0.02)
        turn_most = self._turn_most_rad_s[where]
        turn = np.minimum(np.maximum(turn, -turn_most), turn_most)
        return hil.CommandBatch(forward_m_s, turn, {"abeam_m_s": abeam})
