"""A scenario as a Gymnasium environment: one outer tick is one step (`hil.make_env`).

Estimator, board, link, camera and clock are those of a run; only the law is missing, and the actions stand
in its place. So the same seed and the same commands give the same rows as a run whose law sends them.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import gymnasium
import numpy as np

from hil.analysis.costs import COST_WEIGHTS, USUAL, Cost
from hil.config.fit import check_fit
from hil.core.errors import BadInput, RigFault
from hil.core.types import OuterCommand, wrap_pi
from hil.record.memory import MemoryRecorder
from hil.record.schema import SAMPLE_NAMES
from hil.rigs.opening import is_simulated, open_rig, simulated_targets
from hil.runs.assembly import make_parts
from hil.runs.execute import RunSpec, checked
from hil.runs.parts import Ending, closed
from hil.runs.session import Session
from hil.wire.identity import board_hashes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.core.rig import Rig
    from hil.core.types import Estimate, ReferenceState
    from hil.record.reader import RunRecord
    from hil.runs.parts import Parts, Situation

    Vector = NDArray[np.float64]

# Name of the law in records of an environment.
OUTER = "environment"
_ROW = {name: place for place, name in enumerate(SAMPLE_NAMES)}
_SEEDS = 2**31


class Quantity(NamedTuple):
    """One number of an observation; beyond `bound` either way it is clipped."""

    name: str
    unit: str
    bound: float
    meaning: str


OBSERVATION = (
    Quantity("x_m", "m", 100.0, "estimated centre of mass, world X"),
    Quantity("y_m", "m", 100.0, "estimated centre of mass, world Y"),
    Quantity("theta_rad", "rad", math.pi, "estimated heading, wrapped, counter-clockwise from +X"),
    Quantity("eta1_m_s", "m/s", 10.0, "estimated forward speed"),
    Quantity("theta_dot_rad_s", "rad/s", 100.0, "estimated turn rate, counter-clockwise"),
    Quantity("z1_x_m", "m", 100.0, "estimated flat output z1, world X"),
    Quantity("z1_y_m", "m", 100.0, "estimated flat output z1, world Y"),
    Quantity("z2_x_m_s", "m/s", 100.0, "estimated rate of z1, world X"),
    Quantity("z2_y_m_s", "m/s", 100.0, "estimated rate of z1, world Y"),
    Quantity("ref_z1_x_m", "m", 100.0, "reference z1*, world X"),
    Quantity("ref_z1_y_m", "m", 100.0, "reference z1*, world Y"),
    Quantity("ref_z1_dot_x_m_s", "m/s", 100.0, "first derivative of z1*, world X"),
    Quantity("ref_z1_dot_y_m_s", "m/s", 100.0, "first derivative of z1*, world Y"),
    Quantity("ref_z1_ddot_x_m_s2", "m/s^2", 1e3, "second derivative of z1*, world X"),
    Quantity("ref_z1_ddot_y_m_s2", "m/s^2", 1e3, "second derivative of z1*, world Y"),
    Quantity("ref_z1_dddot_x_m_s3", "m/s^3", 1e4, "third derivative of z1*, world X"),
    Quantity("ref_z1_dddot_y_m_s3", "m/s^3", 1e4, "third derivative of z1*, world Y"),
)
_BOUNDS = np.array([quantity.bound for quantity in OBSERVATION])


class GivenCommand:
    """An outer law that gives what it was told last."""

    def __init__(self) -> None:
        self.command = OuterCommand(0.0, 0.0, {})

    def reset(self, reference: ReferenceState, estimate: Estimate) -> None:
        """Keep what was told: there is no state."""

    def step(self, reference: ReferenceState, estimate: Estimate, dt_s: float) -> OuterCommand:  # noqa: ARG002
        """Return what was told."""
        return self.command


class HilEnv(gymnasium.Env["Vector", "Vector"]):
    """One scenario on a simulated rig, stepped by the one who decides the commands.

    - **Step**: one outer tick (`scenario.control.rate_hz`). The episode has as many steps as a run has ticks.
    - **Observation**: 17 float64 numbers (`OBSERVATION` has name, unit, bound and meaning of each): the
      estimate at the instant at which the next command takes effect, and the reference then.
    - **Action**: forward speed, m/s, and turn rate, rad/s (counter-clockwise), within the scenario's
      `control.limits`; beyond them it is clipped. Not finite: BadInput.
    - **Reward**: minus what the step adds to the cost of `hil tune`: error over time and variation of the
      commands as they come, the rest with the last step. The rewards of an episode add up to minus the
      run's cost; that of an episode which a fault ends is the cost's `failed`. Another cost than the usual
      one is a number of the whole run: all of it comes with the last step.
    - **End**: truncated after the scenario's duration; terminated by a fault (geofence, robot lost from
      sight, link lost), which `info["detail"]` names. The observation of the end is the last one there was.
    - **Seed**: `reset(seed=S)` is the run with seed S; without one the first episode has the
      environment's own and later ones have seeds drawn from it. `info["seed"]` says which.

    After the end, and in the middle, `record()` is the run so far, as `hil.run` would have it.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium declares it

    def __init__(self, spec: RunSpec, cost: Cost = USUAL) -> None:
        """Take the run to step and what it costs; raises BadInput for a target that is not simulated."""
        if not is_simulated(spec.target):
            raise BadInput(
                f"environment on {spec.target!r}: a real robot does not wait for a learner; "
                f"choose {' or '.join(simulated_targets())}"
            )
        check_fit(spec.scenario)
        limits = spec.scenario.control.limits
        fastest = np.array([limits.eta1_max_m_s, limits.theta_dot_max_rad_s])
        self.action_space = gymnasium.spaces.Box(-fastest, fastest, dtype=np.float64)
        self.observation_space = gymnasium.spaces.Box(-_BOUNDS, _BOUNDS, dtype=np.float64)
        self._spec = spec
        self._cost = cost
        self._episode: _Episode | None = None
        self._begun = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Vector, dict[str, Any]]:
        """Begin an episode: connect, find the robot, arm; return its first observation.

        Raises BadInput for a seed out of range, RigFault when the rig cannot be made ready.
        """
        if seed is not None and not 0 <= seed < _SEEDS:
            raise BadInput(f"seed = {seed}: must be from 0 to {_SEEDS - 1}")
        first = self._spec.seed if not self._begun else None
        super().reset(seed=first if seed is None else seed, options=options)
        if seed is None:
            seed = int(self.np_random.integers(_SEEDS)) if first is None else first
        self._begun = True
        self.close()
        self._episode = _Episode(replace(self._spec, seed=seed), self._cost)
        return self._episode.observation, self._episode.info()

    def step(self, action: Vector) -> tuple[Vector, float, bool, bool, dict[str, Any]]:
        """Send the command of this tick; return the observation of the next one.

        Raises BadInput for an action that is no pair of finite numbers, and without a reset before.
        """
        if self._episode is None or self._episode.record is not None:
            raise BadInput("environment: no episode under way; call reset first")
        command = np.asarray(action, dtype=np.float64)
        if command.shape != (2,) or not np.isfinite(command).all():
            raise BadInput(f"action = {action!r}: two finite numbers are needed (m/s, rad/s)")
        box = self.action_space
        assert isinstance(box, gymnasium.spaces.Box)
        reward = self._episode.advance(np.clip(command, box.low, box.high))
        ending = self._episode.session.ending
        done = self._episode.record is not None
        failed = done and ending.outcome == "fault"
        return self._episode.observation, reward, failed, done and not failed, self._episode.info()

    def record(self) -> RunRecord:
        """Return the episode so far as a run record in memory; raises BadInput before a reset."""
        if self._episode is None:
            raise BadInput("environment: no episode yet; call reset first")
        return self._episode.record or self._episode.as_record(Ending("interrupted", "under way"))

    def close(self) -> None:
        """Stop the robot and release the rig; safe to call twice."""
        if self._episode is not None:
            self._episode.close()


class _Episode:
    """One run under way."""

    def __init__(self, spec: RunSpec, cost: Cost) -> None:
        self.seed = spec.seed
        self._cost = cost
        parameters, _, manifest = checked(spec)
        self._recorder = MemoryRecorder(manifest.model_copy(update={"outer": OUTER, "plugins": []}))
        self._law = GivenCommand()
        self._rig: Rig = open_rig(spec.target, spec.scenario, spec.camera, spec.seed)
        self._parts: Parts = make_parts(spec, self._rig, self._recorder, self._law)
        self.session = Session(spec.scenario, self._parts, parameters, board_hashes)
        self._steps = self.session.steps()
        self.record: RunRecord | None = None
        self._spent = 0.0
        self._situation = next(self._steps, None)
        if self._situation is None:
            self.close()
            raise RigFault(self.session.ending.detail)
        self.observation = observation(self._situation)

    def advance(self, command: Vector) -> float:
        """Send a command, go on to the next tick or the end; return the reward."""
        self._law.command = OuterCommand(float(command[0]), float(command[1]), {})
        self._situation = next(self._steps, None)
        if self._situation is not None:
            self.observation = observation(self._situation)
            cost = self._cost_of_tick()
        else:
            self.close()
            cost = self._cost_of_end()
        self._spent += cost
        return -cost

    def info(self) -> dict[str, Any]:
        """Return time, seed and, at the end, how it ended and the run's figures."""
        info: dict[str, Any] = {"seed": self.seed}
        if self._situation is not None:
            info["t_s"] = self._situation.t_s
        if self.record is not None:
            manifest = self.record.manifest
            info |= {"outcome": manifest.outcome, "detail": manifest.outcome_detail}
            info["figures"] = self.record.figures().values
        return info

    def close(self) -> None:
        """Stop the robot where it still moves, keep the record, release the rig."""
        if self.record is not None:
            return
        self._steps.close()
        self._rig.close()
        self.record = self.as_record(self.session.ending)
        if self.session.ending == Ending("interrupted", "Ctrl-C"):
            raise KeyboardInterrupt

    def as_record(self, ending: Ending) -> RunRecord:
        """Return what was recorded so far."""
        return closed(self._recorder, ending, self._parts.link)

    def _cost_of_tick(self) -> float:
        """Return what the newest row adds to the cost: error over time, change of the command."""
        if not self._cost.is_usual:
            return 0.0
        now = self._recorder.rows[-1]
        before = self._recorder.rows[-2] if len(self._recorder.rows) > 1 else now

        def change(name: str) -> float:
            return float(now[_ROW[name]] - before[_ROW[name]])

        cost = COST_WEIGHTS["iae_m_s"] * 0.5 * (_error_m(now) + _error_m(before)) * change("t_s")
        for name, figure in (
            ("eta1_cmd_m_s", "eta1_variation_m_s"),
            ("theta_dot_cmd_rad_s", "theta_dot_variation_rad_s"),
        ):
            cost += COST_WEIGHTS[figure] * abs(change(name))
        return cost

    def _cost_of_end(self) -> float:
        """Return what is missing to the cost of the whole run."""
        assert self.record is not None
        complete = self.record.manifest.outcome == "complete"
        return self._cost.of(self.record.figures().values if complete else {}) - self._spent


def _error_m(row: Any) -> float:
    """Return |delta1| of a row, from the truth where there is one."""
    prefix = "true_delta1" if math.isfinite(row[_ROW["true_delta1_x_m"]]) else "delta1"
    return math.hypot(row[_ROW[f"{prefix}_x_m"]], row[_ROW[f"{prefix}_y_m"]])


def observation(situation: Situation) -> Vector:
    """Return what is observed at a tick, in the order of OBSERVATION."""
    estimate, reference = situation.estimate, situation.reference
    values = (
        estimate.pose.x_m,
        estimate.pose.y_m,
        wrap_pi(estimate.pose.theta_rad),
        estimate.eta1_m_s,
        estimate.theta_dot_rad_s,
        *estimate.z1_m,
        *estimate.z2_m_s,
        *reference.z1_m,
        *reference.z1_dot_m_s,
        *reference.z1_ddot_m_s2,
        *reference.z1_dddot_m_s3,
    )
    return np.clip(np.array(values, dtype=np.float64), -_BOUNDS, _BOUNDS)


__all__ = ["OBSERVATION", "OUTER", "HilEnv", "Quantity"]
