"""Three marks on the robot: found as well as by two, and not lost when one is covered."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hil.config.camera import CameraConfig
from hil.config.load import build, load_scenario, merge
from hil.config.scenario import Scenario
from hil.core.errors import BadInput
from hil.core.registries import LOCALISERS
from hil.runs.execute import RunSpec, execute_in_memory
from sim_twin.camera_sim import RenderedCamera
from tests.vision.scenes import errors, near, random_poses

RED, GREEN, BLUE = [0.07, 0.06, 0.62], [0.12, 0.42, 0.08], [0.60, 0.16, 0.05]
MARKS = {
    "front": {"colour": RED, "x_m": 0.09, "y_m": 0.045},
    "rear": {"colour": GREEN, "x_m": -0.09},
    "more": [{"colour": BLUE, "x_m": 0.09, "y_m": -0.045}],
}
PLACES = [(0.09, 0.045), (-0.09, 0.0), (0.09, -0.045)]


def camera(covered: int | None = None, marks: dict = MARKS) -> CameraConfig:
    """Return a camera over a robot with three marks, one of them under a sheet that rides along."""
    tree: dict = {"marks": marks}
    if covered is not None:
        x, y = PLACES[covered]
        bar = {"frame": "body", "start_m": [x - 0.035, y], "end_m": [x + 0.035, y],
               "width_m": 0.07, "height_m": 0.11}  # fmt: skip
        tree["scene"] = {"bars": [bar]}
    return build(CameraConfig, tree, "camera")


def seen_by(config: CameraConfig, shown: CameraConfig, count: int, *, predicted: bool = True):
    """Return errors of the poses that a localiser of `config` finds in frames of `shown`."""
    find = LOCALISERS.get("marks").factory(config)
    renderer, rng = RenderedCamera(shown, 1), np.random.default_rng(2)
    found = []
    for index, pose in enumerate(random_poses(count, seed=11)):
        frame = renderer.make(index, [(pose.x_m, pose.y_m, pose.theta_rad)] * 2)
        seen = find.locate(frame, near(pose, rng) if predicted else None, 0.06)
        found.append((seen, errors(seen.pose, pose) if seen.pose else None))
    return found


def rms_of(found) -> tuple[float, float]:
    xy = [math.hypot(error[0], error[1]) for _, error in found if error]
    turn = [error[2] for _, error in found if error]
    return float(np.sqrt(np.mean(np.square(xy)))), float(np.sqrt(np.mean(np.square(turn))))


@pytest.mark.parametrize("predicted", [True, False])
def test_three_marks_are_found_within_half_a_millimetre(predicted):
    """All three count in every frame, with and without a prediction."""
    found = seen_by(camera(), camera(), 25, predicted=predicted)
    assert [seen.details.get("marks") for seen, _ in found] == [3.0] * 25
    xy_m, turn_rad = rms_of(found)
    assert xy_m < 0.0005
    assert turn_rad < 0.005


@pytest.mark.parametrize("predicted", [True, False])
@pytest.mark.parametrize("covered", [0, 1, 2])
def test_one_covered_mark_does_not_lose_the_robot(covered, predicted):
    """The two that are left give the pose, in every frame; a robot of two marks is lost without one."""
    found = seen_by(camera(), camera(covered), 12, predicted=predicted)
    assert all(seen.pose is not None for seen, _ in found)
    assert [seen.details["marks"] for seen, _ in found] == [2.0] * 12
    xy_m, turn_rad = rms_of(found)
    assert xy_m < 0.003
    assert turn_rad < 0.03
    if covered < 2 and predicted:
        two = camera(marks={key: MARKS[key] for key in ("front", "rear")})
        assert all(seen.pose is None for seen, _ in seen_by(two, camera(covered), 4))


def test_two_covered_marks_lose_it_with_a_reason():
    """One mark alone is no pose."""
    tree = camera(0).model_dump()
    tree["scene"]["bars"] = [*tree["scene"]["bars"], *camera(1).model_dump()["scene"]["bars"]]
    shown = CameraConfig.model_validate(tree)
    for seen, _ in seen_by(camera(), shown, 4):
        assert seen.pose is None
        assert seen.reason


@pytest.mark.parametrize(
    ("mark", "said"),
    [
        ({"colour": BLUE, "x_m": 0.09, "y_m": 0.0}, "more.0 lies on the mark at (0.09, 0.045) m"),
        ({"colour": RED, "x_m": 0.0, "y_m": 0.0}, "more.0 has the colour of the mark"),
    ],
)
def test_marks_that_cannot_be_told_apart_are_refused(mark, said):
    with pytest.raises(BadInput) as refused:
        camera(marks=MARKS | {"more": [mark]})
    assert said in str(refused.value)


def test_a_run_with_a_covered_mark_reaches_its_point():
    """The whole loop, rendered, with the rear mark under a sheet from the first frame on."""
    scenario = load_scenario("scenario-1", ["duration_s=5"])
    tree = merge(scenario.model_dump(mode="json"),
                 {"camera": {"marks": MARKS, "scene": {"bars": [
                     bar.model_dump(mode="json") for bar in camera(2).scene.bars]}}})  # fmt: skip
    record = execute_in_memory(
        RunSpec(Scenario.model_validate(tree), "twin", "rendered", "pid", "asg-ism", 1, Path())
    )
    assert record.manifest.outcome == "complete", record.manifest.outcome_detail
    assert [verdict.text() for verdict in record.verdicts() if not verdict.holds] == []
