"""Every fault x instant x law on the twin: stopped in time or recovered, bounded, told by its name.

The robot's true motion is watched between the ticks too, and on after the host has let go. World
frame, SI units; times are host times.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil.config.load import load_scenario
from hil.core.errors import HilError
from hil.core.types import wrap_pi
from hil.replays.exact import replay
from hil.rigs.opening import open_rig
from hil.runs.execute import RunSpec, execute, execute_in_memory
from hil.study.fault_kinds import CLOSING, INSTANTS, ROWS, FaultRow
from sim_twin.twin import Twin

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hil.core.rig import Frame
    from hil.core.types import Pose
    from hil.record.reader import RunRecord

SCENARIO, DURATION_S = "scenario-1", 14.0
LAWS = ("pid", "asg-ism")
# Limits of a cell. The drive is off REST_S after the stop at the latest; what is left is the robot's
# own coasting against its friction, which takes 0.8 to 1.7 m/s^2 off its speed on the shipped robot.
REST_S, COAST_M_S2, PEAK_M_S = 0.25, 0.7, 1.0
# Slower than this is rest.
_REST_M_S, _REST_RAD_S = 0.02, 0.1
_AFTERWARDS_S = 0.6
# A wait of more than this is none that the host asked for; meanwhile the motion is looked at so often.
_AWAY_S, _LOOK_S = 0.2, 0.02


@dataclass(frozen=True, slots=True)
class Cell:
    """What one fault at one instant came to; `flaws` is empty where the cell is met."""

    fault: str
    instant: str
    law: str
    outcome: str
    said: str
    rest_s: float  # from detection to rest; 0 for a run that was not stopped
    peak_m_s: float  # true speed from the fault on
    travel_m: float  # true path from the fault to the stop's end
    detected_s: float  # from the fault to the stop; NaN for a run that was not stopped
    flaws: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Return the cell with null where there is no figure."""
        tree = dataclasses.asdict(self) | {"met": not self.flaws}
        bare = {k: v for k, v in tree.items() if not (isinstance(v, float) and math.isnan(v))}
        return dict.fromkeys(tree) | bare


@dataclass(frozen=True, slots=True)
class Motion:
    """The robot's true motion at one time of the world."""

    at_s: float
    pose: Pose
    eta1_m_s: float
    theta_dot_rad_s: float

    @property
    def moves(self) -> bool:
        """True where this is no rest."""
        return abs(self.eta1_m_s) > _REST_M_S or abs(self.theta_dot_rad_s) > _REST_RAD_S


class WatchedRig:
    """A twin that keeps the true motion at every wait, and through those in which the host is kept away.

    Times are the world's (`Twin.world_s`), whatever the host's clock says.
    """

    def __init__(self, rig: Twin) -> None:
        self._rig = rig
        self.stream = rig.stream
        self.now_s, self.poll_frame, self.truth = rig.now_s, rig.poll_frame, rig.truth
        self.begin_s = math.nan
        self.motion: list[Motion] = []
        self.away_s: list[tuple[float, float]] = []

    def wait(self, until_s: float) -> None:
        """Wait, then look."""
        before_s = self._rig.world_s()
        self._rig.wait(until_s)
        now_s, truth = self._rig.world_s(), self._rig.truth()
        if now_s - before_s > _AWAY_S:
            self.away_s.append((before_s, now_s))
            self._look_back(before_s, now_s)
        self.motion.append(Motion(now_s, truth.pose, truth.eta1_m_s, truth.theta_dot_rad_s))

    def _look_back(self, from_s: float, to_s: float) -> None:
        """Work out the motion of the last seconds, at most three of them, from the poses."""
        at_s = max(from_s, to_s - 3.0)
        before = self._rig.pose_at(at_s)
        while at_s + _LOOK_S < to_s:
            at_s += _LOOK_S
            pose = self._rig.pose_at(at_s)
            speed_m_s = math.hypot(pose.x_m - before.x_m, pose.y_m - before.y_m) / _LOOK_S
            turn_rad_s = wrap_pi(pose.theta_rad - before.theta_rad) / _LOOK_S
            self.motion.append(Motion(at_s, pose, speed_m_s, turn_rad_s))
            before = pose

    def begin(self, t_start_s: float) -> None:
        """Note where the controlled part begins."""
        self.begin_s = self._rig.world_s()
        self._rig.begin(t_start_s)

    def close(self) -> None:
        """Watch on after the host has let go, then release the rig."""
        end_s = self._rig.world_s() + _AFTERWARDS_S
        while self._rig.world_s() < end_s:
            self.wait(self._rig.now_s() + 0.005)
            while self._frame_is_there():
                pass
        self._rig.close()

    def _frame_is_there(self) -> Frame | None:
        frame: Frame | None = self._rig.poll_frame()
        return frame


def cells(
    faults: Sequence[str] = (), instants: Sequence[str] = (), laws: Sequence[str] = ()
) -> list[tuple[str, str, str]]:
    """Return the (fault, instant, law) of the matrix, or of the part that is named."""
    names = [row.name for row in ROWS]
    return [
        (fault, instant, law)
        for fault in (faults or names)
        for instant in (instants or tuple(INSTANTS))
        for law in (laws or LAWS)
    ]


def run_cell(
    fault: str, instant: str, law: str, seed: int = 1, scratch: Path | None = None
) -> Cell:
    """Run one cell and judge it; at speed the record is written (to `scratch`), read and replayed too."""
    row = next(row for row in ROWS if row.name == fault)
    start_s = INSTANTS[instant] + (DURATION_S + 0.02 if instant == CLOSING else 0.0)
    scenario = load_scenario(SCENARIO, [f"duration_s={DURATION_S:g}", *row.overrides(start_s)])
    with tempfile.TemporaryDirectory(dir=scratch) as folder:
        spec = RunSpec(
            scenario, "twin", row.camera, law, "asg-ism", seed, Path(folder) / "run", rerun=False
        )
        twin = open_rig("twin", scenario, row.camera, seed)
        assert isinstance(twin, Twin)
        rig = WatchedRig(twin)
        flaws: list[str] = []
        if instant == "at speed":
            record = execute(spec, rig=rig)
            flaws += _replay_flaws(spec.out)
        else:
            record = execute_in_memory(spec, rig)
    return _judged(row, instant, law, record, rig, start_s, flaws)


def _replay_flaws(folder: Path) -> list[str]:
    try:
        report = replay(folder)
    except HilError as error:
        return [f"record not replayable: {error}"]
    return [] if report.identical else [f"replay differs first in {report.first}"]


def _judged(
    row: FaultRow, instant: str, law: str, record: RunRecord, rig: WatchedRig, start_s: float,
    flaws: list[str],
) -> Cell:  # fmt: skip
    manifest, t_s = record.manifest, record.samples["t_s"]
    said = "; ".join([manifest.outcome_detail, *record.diagnoses()]).strip("; ")
    stopped = manifest.outcome != "complete"
    begin_s = rig.begin_s if rig.begin_s == rig.begin_s else math.inf
    ended_s = _ended_s(begin_s, t_s, rig)
    after = [motion for motion in rig.motion if motion.at_s >= begin_s + start_s]
    peak_m_s = max((abs(motion.eta1_m_s) for motion in after), default=0.0)
    travel_m = sum(
        math.hypot(b.pose.x_m - a.pose.x_m, b.pose.y_m - a.pose.y_m)
        for a, b in itertools.pairwise(after if stopped else [])
    )
    rest_s = max(
        (motion.at_s - ended_s for motion in rig.motion if motion.at_s > ended_s and motion.moves),
        default=0.0,
    )
    speeds_m_s = [abs(motion.eta1_m_s) for motion in rig.motion if motion.at_s <= ended_s + REST_S]
    limit_s = REST_S + max(speeds_m_s[-1:] or [0.0]) / COAST_M_S2
    if rest_s > limit_s:
        flaws.append(f"moves until {rest_s:.3f} s after the stop (limit {limit_s:.3f} s)")
    if peak_m_s > PEAK_M_S:
        flaws.append(f"reaches {peak_m_s:.2f} m/s (limit {PEAK_M_S:g} m/s)")
    if travel_m > row.travel_m:
        flaws.append(f"travels {travel_m:.2f} m after the fault (limit {row.travel_m:g} m)")
    holds = all(verdict.holds for verdict in record.verdicts()) if t_s.size else False
    noticed = stopped or not holds
    if noticed and not re.search(row.named, said):
        flaws.append(f"not told by its name: {said or 'nothing said'}")
    if not stopped and not holds and not row.slow:
        flaws.append("the run goes on and misses its requirements")
    detected_s = ended_s - (begin_s + max(start_s, 0.0)) if stopped and t_s.size else math.nan
    return Cell(
        row.name, instant, law, manifest.outcome, said, rest_s, peak_m_s, travel_m, detected_s,
        tuple(flaws),
    )  # fmt: skip


def _ended_s(begin_s: float, t_s: NDArray[np.float64], rig: WatchedRig) -> float:
    """Return the time of the world at which the host gave up: its last tick, or when it was back."""
    if not t_s.size:
        return begin_s
    last_s = begin_s + float(t_s[-1])
    return max([last_s, *(to_s for from_s, to_s in rig.away_s if from_s <= last_s + 0.1 < to_s)])
