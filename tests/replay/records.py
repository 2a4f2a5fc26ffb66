"""Short run records for the replay's tests, and ways to damage them."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from random import Random
from typing import Any

from hil.config.load import load_scenario, merge
from hil.config.scenario import Scenario
from hil.core.rig import Frame, Rig, Truth
from hil.record.reader import RunRecord
from hil.rigs.opening import open_rig
from hil.runs.execute import RunSpec, execute


def spec(
    out: Path,
    overrides: Sequence[str] = ("duration_s=3",),
    extra: dict[str, Any] | None = None,
    **changes: Any,
) -> RunSpec:
    """Return a short run of scenario 1 on the twin."""
    scenario = load_scenario("scenario-1", overrides)
    if extra:
        scenario = Scenario.model_validate(merge(scenario.model_dump(mode="json"), extra))
    values: dict[str, Any] = {
        "target": "twin", "camera": "pose", "outer": "asg-ism", "inner": "asg-ism", "seed": 1,
        "rerun": False,
    }  # fmt: skip
    return RunSpec(scenario=scenario, out=out, **(values | changes))


def record(out: Path, *args: Any, **changes: Any) -> RunRecord:
    """Run it."""
    return execute(spec(out, *args, **changes))


class WallClock:
    """The twin behind a clock that never shows the same time twice, as a real host's."""

    def __init__(self, rig: Rig, seed: int, stop: BaseException | None = None) -> None:
        self._rig = rig
        self._stop = stop
        self._rng = Random(seed)
        self._last_s = 0.0
        self._start_s = math.inf
        self.stream = rig.stream

    def now_s(self) -> float:
        """Return the twin's clock and up to 40 us of computing per reading on top of it."""
        self._last_s = max(self._last_s, self._rig.now_s()) + 4e-5 * self._rng.random()
        return self._last_s

    def wait(self, until_s: float) -> None:
        """Let the twin go on; the stop, if any, comes once, a second after the start."""
        self._rig.wait(until_s)
        if self._stop is not None and self._rig.now_s() > self._start_s + 1.0:
            stop, self._stop = self._stop, None
            raise stop

    def poll_frame(self) -> Frame | None:
        """Return the twin's frame."""
        return self._rig.poll_frame()

    def begin(self, t_start_s: float) -> None:
        """Pass on."""
        self._rig.begin(t_start_s)
        self._start_s = t_start_s

    def truth(self) -> Truth | None:
        """Know nothing, as on a real rig."""
        return None

    def close(self) -> None:
        """Pass on."""
        self._rig.close()


def record_on_wall_clock(out: Path, stop: BaseException | None = None) -> RunRecord:
    """Run it on the twin behind a wall clock; `stop` is raised in mid-run."""
    own = spec(out)
    twin = open_rig("twin", own.scenario, own.camera, own.seed)
    return execute(own, rig=WallClock(twin, 5, stop))


def unclose(folder: Path) -> None:
    """Make a closed record look like one whose process died: no digests, outcome running."""
    path = folder / "manifest.json"
    tree = json.loads(path.read_text(encoding="utf-8"))
    tree |= {"outcome": "running", "files": {}}
    path.write_text(json.dumps(tree), encoding="utf-8")


def cut(path: Path, share: float) -> None:
    """Leave the first part of a file."""
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
