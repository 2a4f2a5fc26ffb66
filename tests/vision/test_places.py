"""From two discs to the pose in native code, against numpy's matrices and hand-made cases."""

import math

import numpy as np
import pytest

from vision._marks import Spot, gap_variance, weighted_pose

BODY = ((0.06, 0.0), (-0.06, 0.01))


def spots_at(pose, rng, noise_m=0.0):
    """Return both marks of a robot at a pose, with covariances drawn."""
    x, y, theta = pose
    c, s = math.cos(theta), math.sin(theta)
    found = []
    for bx, by in BODY:
        root = rng.normal(size=(2, 2)) * 1e-4
        spread = root @ root.T + 1e-9 * np.eye(2)
        off = rng.normal(size=2) * noise_m
        place = (x + c * bx - s * by + off[0], y + s * bx + c * by + off[1])
        found.append(Spot(place, spread.ravel().tolist()))
    return found


def by_numpy(body, spots):
    """Return pose, covariance and rest of the same least squares, written with numpy's matrices."""
    body = np.array(body)
    world = np.array([spot.at_m for spot in spots])
    weight = [np.linalg.inv(np.reshape(spot.spread_m2, (2, 2))) for spot in spots]
    b, w = body - body.mean(axis=0), world - world.mean(axis=0)
    theta = math.atan2(np.sum(b[:, 0] * w[:, 1] - b[:, 1] * w[:, 0]), np.sum(b * w))
    c, s = math.cos(theta), math.sin(theta)
    state = np.append(world.mean(axis=0) - np.array([[c, -s], [s, c]]) @ body.mean(axis=0), theta)
    for _ in range(2):
        information, pull = np.zeros((3, 3)), np.zeros(3)
        for point, place, own in zip(body, world, weight, strict=True):
            slope, rest = linear(state, point, place)
            information += slope.T @ own @ slope
            pull += slope.T @ own @ rest
        state = state + np.linalg.solve(information, pull)
    rests = [linear(state, *pair)[1] for pair in zip(body, world, strict=True)]
    left = sum(rest @ own @ rest for rest, own in zip(rests, weight, strict=True))
    return state, np.linalg.inv(information), left


def linear(state, point, place):
    """Return the slope of a mark's place on the pose, and how far it is off."""
    c, s = math.cos(state[2]), math.sin(state[2])
    arm = np.array([[c, -s], [s, c]]) @ point
    return np.array([[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]]]), place - arm - state[:2]


@pytest.mark.parametrize("seed", range(20))
def test_the_pose_is_that_of_weighted_least_squares(seed):
    """Pose, covariance and weighted squares agree with numpy's matrices to rounding."""
    rng = np.random.default_rng(seed)
    spots = spots_at((*rng.uniform(-1, 1, 2), rng.uniform(-3, 3)), rng, noise_m=2e-4)
    x, y, theta, covariance, left = weighted_pose(BODY, *spots)
    state, expected, rest = by_numpy(BODY, spots)
    assert (x, y, theta) == pytest.approx(tuple(state), abs=1e-10)
    assert covariance == pytest.approx(expected[np.triu_indices(3)], rel=1e-6, abs=1e-14)
    assert left == pytest.approx(rest, rel=1e-6, abs=1e-9)


def test_a_mark_that_claims_little_hardly_counts():
    """The pose goes through the sure mark: the unsure one only turns it (negative control: both alike)."""
    sure, unsure = [1e-10, 0.0, 0.0, 1e-10], [1e-4, 0.0, 0.0, 1e-4]
    front, rear = (0.06, 0.0), (-0.058, 0.01)  # 2 mm too near
    body = ((0.06, 0.0), (-0.06, 0.01))
    x, y, theta, _, left = weighted_pose(body, Spot(front, sure), Spot(rear, unsure))
    seen = x + math.cos(theta) * 0.06, y + math.sin(theta) * 0.06
    assert math.dist(seen, front) < 1e-6
    alike, *_ = weighted_pose(body, Spot(front, sure), Spot(rear, sure))
    assert alike == pytest.approx(0.001, abs=1e-4)
    assert left < 0.1


def test_the_doubt_of_a_distance_is_that_along_it():
    """Of two spots along x only the variances of x count, and they add up."""
    one, other = Spot((0.1, 0.0), [4e-8, 0, 0, 1e-6]), Spot((0.0, 0.0), [9e-8, 0, 0, 1e-6])
    assert gap_variance(one, other, 0.1) == pytest.approx(13e-8)
