"""A fitted twin finds what the record's robot was made of, and says how far it can be trusted."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from hil.config.load import build
from hil.config.scenario import Scenario
from hil.core.errors import BadInput
from hil.record.source import read_source
from hil.replays.fit import Fit, Rehearsal, fit_twin, median_angle_rad
from hil.replays.what_if import what_if
from tests.replay.records import record

# Gains of its own: what a fit can tell shall not change with each tuning.
GAINS = {
    "control": {
        "gains": {"tuned": {"pid": {"kp_s3": 24.0, "ki_s4": 0.01, "kd1_s2": 26.0, "kd2_s": 9.0}}}
    }
}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a run to the point, of a robot some 10 % off what the host believes."""
    folder = tmp_path_factory.mktemp("fit") / "run"
    return record(folder, ("duration_s=7",), GAINS, outer="pid").path


@pytest.fixture(scope="module")
def fit(made: Path) -> Fit:
    """Fit it."""
    source = read_source(made)
    return fit_twin(Rehearsal(source, build(Scenario, source.manifest.scenario, "record")))


def test_parameters_of_the_recorded_robot_are_found(fit: Fit) -> None:
    """The scenarios' robot has wheels 10 % larger, a track 10 % narrower and 10 % more friction.

    Torque and speed constants are 10 % lower and the winding's resistance, which is not fitted,
    10 % higher; k/R is what a record can tell: 0.9/1.1 = 0.82. Friction is seen weakly: it takes up
    what the values that are not fitted do.
    """
    found = {name: value for name, (value, _, _) in fit.ratios.items()}
    assert found["wheel radius"] == pytest.approx(1.10, abs=0.03)
    assert found["track"] == pytest.approx(0.90, abs=0.05)
    assert found["motor constants"] == pytest.approx(0.82, abs=0.06)
    assert 0.6 < found["motor friction"] < 1.5
    assert -0.03 < fit.camera_tie_s < 0.06


def test_intervals_hold_where_the_model_does(fit: Fit) -> None:
    """Wheel radius 1.10, track 0.90 and k/R 0.9/1.1 lie in their intervals.

    Floor friction takes up what the values that are not fitted do, and is told to no 10 %: named.
    """
    for group, true in (("wheel radius", 1.10), ("track", 0.90), ("motor constants", 0.9 / 1.1)):
        _, low, high = fit.ratios[group]
        assert low <= true <= high, (group, low, high)
        assert fit.identifiable(group) == (0.5 * (high - low) <= 0.1)
    assert fit.identifiable("wheel radius")
    assert not fit.identifiable("floor friction")


def test_a_ratio_at_the_end_of_the_search_is_not_told(fit: Fit) -> None:
    """An interval that goes beyond what was searched, or is wide, is named in text and JSON."""
    beyond = dataclasses.replace(fit, ratios=fit.ratios | {"wheel radius": (1.598, 1.55, 1.65)})
    assert not beyond.identifiable("wheel radius")
    assert not beyond.to_json()["ratios"]["wheel radius"]["identifiable"]
    wide = dataclasses.replace(fit, ratios=fit.ratios | {"track": (1.0, 0.85, 1.15)})
    assert not wide.identifiable("track")


def test_middle_of_headings_about_half_a_turn() -> None:
    """+3.14 and -3.14 are a hundredth apart: their middle is pi, not 0."""
    rng = np.random.default_rng(1)
    for heading in (math.pi, -math.pi + 0.001, 0.0, 1.5, -3.0):
        seen = heading + 0.003 * rng.normal(size=28)
        wrapped = np.remainder(seen + math.pi, 2 * math.pi) - math.pi
        away = median_angle_rad(wrapped) - heading
        assert abs(math.remainder(away, 2 * math.pi)) < 0.003, heading


def test_closed_loop_starts_as_the_record_does(tmp_path: Path) -> None:
    """A robot that stands at theta = pi, half of the frames on either side of the wrap."""
    path = record(tmp_path / "run", ("duration_s=3", "start.theta_rad=3.14159265"), seed=7).path
    source = read_source(path)
    rehearsal = Rehearsal(source, build(Scenario, source.manifest.scenario, "record"))
    theta_rad = rehearsal.start_pose()[2]
    assert abs(math.remainder(theta_rad - math.pi, 2 * math.pi)) < 0.01


def test_fit_holds_on_parts_it_has_not_seen(fit: Fit) -> None:
    """On windows held out the fitted twin is several times closer than the unfitted one."""
    assert fit.windows_held_out >= 3
    for name in ("wheel speed", "pwm", "forward", "turn"):
        assert fit.residual_held_out[name] < 0.5 * fit.residual_unfitted[name], name


def test_answer_carries_its_checks(made: Path, fit: Fit, monkeypatch: pytest.MonkeyPatch) -> None:
    """The recorded law on the fitted twin does about what it did in the record."""
    monkeypatch.setattr("hil.replays.what_if.SEEDS", 3)
    answer = what_if(made, "asg-ism", fit=fit)
    ise = answer.answers["ise_m2_s"]
    assert ise.baseline_mean == pytest.approx(answer.in_record["ise_m2_s"], rel=0.1)
    assert ise.pairs == 3
    assert "held out" in answer.text()
    # Without a word on the laws it is the other outer law; --inner is another wheel law.
    monkeypatch.setattr("hil.replays.what_if.SEEDS", 2)
    other = what_if(made, None, fit=fit)
    assert (other.recorded_law, other.other_law) == ("pid", "asg-ism")
    assert other.answers["ise_m2_s"].mean != 0.0
    wheels = what_if(made, None, fit=fit, inner="pid")
    assert (wheels.recorded_law, wheels.other_law) == ("pid over asg-ism", "pid over pid")
    assert wheels.answers["ise_m2_s"].mean != 0.0
    assert wheels.answers["ise_m2_s"].baseline_mean == other.answers["ise_m2_s"].baseline_mean
    assert answer.to_json()["fit"]["residual_rms"]["forward"]["held_out_parts"] > 0


def test_ratio_at_the_edge_of_the_box_is_told(fit: Fit) -> None:
    """As is a search that its budget ended; a ratio well inside is not."""
    inside = dataclasses.replace(fit, converged=True)
    assert not any("wheel radius" in line for line in inside.notes)
    value = (1.598, 1.222, 1.974)
    edge = dataclasses.replace(fit, ratios=fit.ratios | {"wheel radius": value}, converged=False)
    assert edge.notes[0].startswith("wheel radius = 1.598 lies at the edge of what is searched")
    assert "budget of 15 evaluations" in edge.notes[-1]
    assert edge.to_json()["notes"] == list(edge.notes)


def test_record_of_a_robot_at_rest_is_refused(tmp_path: Path) -> None:
    """Nothing can be fitted where nothing moves."""
    start = ("duration_s=1", "start.x_m=-0.03", "start.y_m=0", "start.theta_rad=0")
    path = record(tmp_path / "run", (*start, "control.limits.hold_enter_m=0.9",
                                     "control.limits.hold_leave_m=1")).path  # fmt: skip
    with pytest.raises(BadInput, match="moves"):
        what_if(path, "pid")
