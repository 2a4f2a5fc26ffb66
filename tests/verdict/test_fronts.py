"""Fronts: who is on one, its hypervolume, which points of it are taken, and the search."""

import numpy as np
import pytest
from scipy.stats import qmc

from hil.analysis.fronts import front_of, hypervolume, share_of_box
from hil.study.front_search import Candidate, Front, search_front, single_best
from hil.study.suite import Scores


def test_hypervolume_by_hand():
    """Two overlapping boxes of 2 and 3 with 1 in common; a point beyond the reference adds nothing."""
    assert hypervolume([(1.0, 0.0), (0.0, 1.5)], (2.0, 2.0)) == pytest.approx(2.0 + 1.0 - 0.5)
    assert hypervolume([(0.0, 0.0, 0.0)], (2.0, 3.0, 4.0)) == pytest.approx(24.0)
    assert hypervolume([(3.0, 0.0)], (2.0, 2.0)) == 0.0
    assert hypervolume([], (1.0, 1.0)) == 0.0


def test_hypervolume_agrees_with_counting_points():
    """In three scores, with points that hide behind others: within 1 % of 2^15 counted points."""
    points = np.random.default_rng(2).random((12, 3))
    counted = qmc.Sobol(3, rng=1).random_base2(15)
    share = (counted[:, None, :] >= points[None, :, :]).all(-1).any(-1).mean()
    assert hypervolume(points.tolist(), (1.0, 1.0, 1.0)) == pytest.approx(share, rel=0.01)


def test_front_leaves_out_what_is_beaten_and_doubles():
    """Of equal points the first stays."""
    assert front_of([(1, 3), (2, 2), (2, 2), (3, 1), (3, 3)]) == [0, 1, 3]


def test_share_of_the_box():
    """A point at the geometric middle of each score fills an eighth; the best possible all of it."""
    assert share_of_box([(1.0, 1.0, 1.0)], 0.1, 10.0) == pytest.approx(0.125)
    assert share_of_box([(0.01, 0.1, 0.1)], 0.1, 10.0) == pytest.approx(1.0)
    assert share_of_box([(10.0, 1.0, 1.0)], 0.1, 10.0) == 0.0


def candidate(accuracy, calm, effort=1.0):
    return Candidate({"k": accuracy}, Scores(accuracy, calm, effort))


def test_single_best_set_is_picked_by_the_rule():
    """The most accurate of those as calm as the yardstick; the calmest where none is."""
    front = [candidate(0.5, 2.0), candidate(0.8, 0.9), candidate(1.5, 0.4)]
    assert single_best(front).scores.accuracy == 0.8
    assert single_best([front[0], candidate(0.4, 3.0)]).scores.accuracy == 0.5


def test_points_to_judge_span_the_front():
    """The calmest and the most accurate are among them; one that only its effort keeps is not."""
    tried = [candidate(1 / x, x) for x in np.geomspace(0.2, 5.0, 30)]
    tried.append(Candidate({"k": 0.0}, Scores(9.0, 5.1, 0.1)))
    chosen = Front("pid", 1, tuple(tried)).picked(4)
    assert len(chosen) == 4
    assert chosen[0].scores.calm == pytest.approx(0.2)
    assert chosen[-1].scores.accuracy == pytest.approx(0.2)


BOX = {"a": (0.1, 1.0, 10.0), "b": (0.1, 3.0, 10.0)}


def bowl(tried):
    """Accuracy wants a = 0.3, calm wants a = 3; b costs effort away from 1."""
    return [
        Scores(
            0.3 + abs(np.log(v["a"] / 0.3)),
            0.3 + abs(np.log(v["a"] / 3.0)),
            1.0 + np.log(v["b"]) ** 2,
        )
        for v in tried
    ]


def test_search_is_deterministic_starts_where_it_says_and_gets_better():
    """The first candidate is the declared start; the same seed gives the same, another one another."""
    one, again, other = (
        search_front("pid", BOX, bowl, candidates=48, seed=seed) for seed in (1, 1, 2)
    )
    assert one.tried == again.tried
    assert one.tried[1:] != other.tried[1:]
    assert one.tried[0].values == {"a": 1.0, "b": 3.0}
    assert len(one.tried) == 48
    assert one.volume > Front("pid", 1, one.tried[:8]).volume
