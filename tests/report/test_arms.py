"""Arms of repeated runs: told apart by law, gains and what else differs; nothing dropped unsaid."""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
from pathlib import Path

import pytest

from hil.core.errors import BadInput
from hil.record.reader import RunRecord
from hil.report.repeats import repeats_of
from hil.study.experiment import study
from tests.record.synthetic import make_run, scenario


def run(folder: Path, law: str, seed: int, rate_hz: float, **changes: object) -> RunRecord:
    """Return a run whose manifest has gains as a real one, and `changes` in it."""
    made = make_run(folder, law, seed, rate_hz=rate_hz)
    path = folder / "manifest.json"
    tree = json.loads(path.read_text(encoding="utf-8"))
    tree |= {"gains": {"set": "tuned", "outer": {"k1_s": 2.0}, "board": {"LAW": 0.0}}}
    path.write_text(json.dumps(tree | changes), encoding="utf-8")
    from hil.record.reader import read_run  # noqa: PLC0415 - reads what was just written

    assert made.path == folder
    return read_run(folder)


THESIS = {"set": "thesis", "outer": {"k1_s": 0.5}, "board": {"LAW": 0.0}}


@pytest.fixture(scope="module")
def nine(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[RunRecord]]:
    """PID, ASG-ISM and ASG-ISM with the gains of the thesis, three seeds each."""
    folder = tmp_path_factory.mktemp("nine")
    return {
        "pid": [run(folder / f"p{s}", "pid", s, 2.0 + 0.01 * s) for s in (1, 2, 3)],
        "tuned": [run(folder / f"t{s}", "asg-ism", s, 2.6 + 0.02 * s) for s in (1, 2, 3)],
        "thesis": [
            run(folder / f"o{s}", "asg-ism", s, 1.4 + 0.03 * s, gains=THESIS) for s in (1, 2, 3)
        ],
    }


def test_gains_make_an_arm_and_the_order_of_the_runs_makes_nothing(
    nine: dict[str, list[RunRecord]],
) -> None:
    """Three arms of three, the same statistics for every order of the nine runs."""
    told = set()
    for order in itertools.permutations(nine):
        found = repeats_of([one for name in order for one in nine[name]])
        assert found is not None
        assert found.arms == {"pid": 3, "asg-ism, gains tuned": 3, "asg-ism, gains thesis": 3}
        told.add(json.dumps(found.to_json()))
    assert len(told) == 1
    ise = [contrast.results["ise_m2_s"].mean for contrast in found.contrasts]
    assert ise[0] < 0 < ise[1]  # the faster decay has the smaller integral


def test_one_gain_that_differs_is_named(tmp_path: Path) -> None:
    """Sets of one name with other values are told apart by the value."""
    other = {"set": "tuned", "outer": {"k1_s": 3.0}, "board": {"LAW": 0.0}}
    runs = [run(tmp_path / f"a{s}", "asg-ism", s, 2.0 + 0.01 * s) for s in (1, 2)]
    runs += [run(tmp_path / f"b{s}", "asg-ism", s, 2.5 + 0.01 * s, gains=other) for s in (1, 2)]
    found = repeats_of(runs)
    assert found is not None
    assert set(found.arms) == {"asg-ism, k1_s 2", "asg-ism, k1_s 3"}


def test_other_conditions_of_one_seed_are_an_arm_each(tmp_path: Path) -> None:
    """PID, and ASG-ISM with two masses under the same seeds: three arms, the mass in their names."""
    heavy = scenario() | {"robot": {"wheel_radius_m": 0.0482, "mass_kg": 3.1}}
    runs = [run(tmp_path / f"p{s}", "pid", s, 2.0 + 0.01 * s) for s in (1, 2)]
    runs += [run(tmp_path / f"l{s}", "asg-ism", s, 2.4 + 0.01 * s) for s in (1, 2)]
    runs += [run(tmp_path / f"h{s}", "asg-ism", s, 2.2 + 0.01 * s, scenario=heavy) for s in (1, 2)]
    found = repeats_of(runs)
    assert found is not None
    assert set(found.arms) == {"pid", "asg-ism, robot.mass_kg 2.8", "asg-ism, robot.mass_kg 3.1"}
    assert sum(found.arms.values()) == 6


def test_copies_are_refused_with_their_names(nine: dict[str, list[RunRecord]]) -> None:
    """One run given twice, or two repeats of one seed, cannot be paired: both are named."""
    runs = [*nine["pid"], *nine["tuned"]]
    with pytest.raises(BadInput, match=r"t1 and .*t1: both are asg-ism, seed 1"):
        study([*runs, nine["tuned"][0]])
    # Side by side, without statistics, a run may be looked at beside itself.
    assert study([nine["pid"][0], nine["pid"][0]]).repeats is None


def test_replays_and_stopped_runs_drop_their_pairs_by_name(tmp_path: Path) -> None:
    """Neither has figures that speak of its law; the notes count them."""
    runs = [run(tmp_path / f"p{s}", "pid", s, 2.0 + 0.01 * s) for s in (1, 2, 3)]
    runs += [run(tmp_path / f"a{s}", "asg-ism", s, 2.4 + 0.01 * s) for s in (1, 2)]
    runs.append(run(tmp_path / "a3", "asg-ism", 3, 2.4, target="replay:x"))
    found = repeats_of(runs)
    assert found is not None
    assert found.contrasts[0].results["ise_m2_s"].pairs == 2
    assert any("1 replays (open loop)" in line for line in found.warnings)


def test_command_gives_one_answer_for_every_order(nine: dict[str, list[RunRecord]]) -> None:
    """`hil compare --json` on all nine runs, the last law first: what any order gives."""
    paths = [str(one.path) for name in ("thesis", "pid", "tuned") for one in nine[name]]
    done = subprocess.run(
        [sys.executable, "-m", "hil", "compare", *paths, "--json"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    alone = repeats_of([*nine["pid"], *nine["tuned"], *nine["thesis"]])
    assert alone is not None
    assert json.loads(done.stdout)["statistics"] == json.loads(json.dumps(alone.to_json()))
