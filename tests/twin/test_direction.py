"""The plant's own cosine and sine: near the exact ones, symmetric, alike in every width of registers."""

from __future__ import annotations

import functools
import itertools
import math
import sys
from random import Random

import numpy as np
import pytest

from sim_twin import _native

BOUND_ULP = 0.56  # as direction.hpp says
NEAR_RAD = 4e5  # where the other reduction begins
BITS = 1300  # of pi and of all sums here: an angle of 2^1024 leaves 276 behind the point


def directions(angles, lanes=1):
    """Return cosines and sines of any number of angles."""
    values = np.asarray(angles, dtype=float)
    filled = np.concatenate([values, np.zeros(-len(values) % lanes)])
    cos, sin = _native.directions(filled, lanes)
    return cos[: len(values)], sin[: len(values)]


@functools.cache
def pi_bits() -> int:
    """Return pi 2^BITS by Machin's formula, in whole numbers."""
    one = 1 << (BITS + 20)

    def arctan_of(part: int) -> int:
        total, power, k = 0, one // part, 1
        while power:
            total += power // k if k % 4 == 1 else -(power // k)
            power //= part * part
            k += 2
        return total

    return 4 * (4 * arctan_of(5) - arctan_of(239)) >> 20


def series(angle: int, power: int) -> int:
    """Return sine (power 1) or cosine (0) of an angle up to pi / 4, both as wholes of 2^-BITS."""
    term = total = angle if power else 1 << BITS
    k = power
    while term:
        term = -(((term * angle) >> BITS) * angle >> BITS) // ((k + 1) * (k + 2))
        if term == -1:
            break
        total, k = total + term, k + 2
    return total


def exact(angle_rad: float) -> tuple[int, int]:
    """Return cosine and sine as wholes of 2^-BITS."""
    over, under = abs(angle_rad).as_integer_ratio()
    size = (over << BITS) // under
    quarter = pi_bits() // 2
    n = (2 * size + quarter) // (2 * quarter)
    left = size - n * quarter
    c, s = series(left, 0), series(left, 1)
    cos, sin = ((c, s), (-s, c), (-c, -s), (s, -c))[n % 4]
    return cos, -sin if angle_rad < 0 else sin


def off_ulp(found: float, wanted: int) -> float:
    """Return how far a number is from the exact one, in units of its last place."""
    over, under = found.as_integer_ratio()
    away = (over << BITS) // under - wanted
    place = math.ulp(found).as_integer_ratio()
    return abs(away) * place[1] / (place[0] << BITS)


def near_quarters(quarters):
    """Return the nearest numbers to so many quarter turns, and their neighbours."""
    for n in quarters:
        middle = (n * pi_bits() // 2) / (1 << BITS)
        yield from (math.nextafter(middle, 0.0), middle, math.nextafter(middle, math.inf))


def drawn(seed: int, kind: str) -> list[float]:
    """Return angles of a kind."""
    rng = Random(seed)
    if kind == "of a turn":
        return [rng.uniform(-4.0, 4.0) for _ in range(600)]
    if kind == "headings":
        return [rng.uniform(-NEAR_RAD, NEAR_RAD) for _ in range(600)]
    if kind == "quarter turns":
        few = [*range(1, 40), *(rng.randrange(1, 1 << 18) for _ in range(200))]
        return list(near_quarters(few))
    if kind == "small":
        return [rng.choice((-1, 1)) * 10.0 ** rng.uniform(-200, 0) for _ in range(300)]
    if kind == "either side of the other reduction":
        return [NEAR_RAD * (1.0 + rng.uniform(-1e-6, 1e-6)) for _ in range(300)]
    # The hardest of all numbers of 64 bits (J.-M. Muller, Elementary Functions): 2^-61 from quarter turns.
    hardest = math.ldexp(6381956970095103.0, 797)
    large = [rng.choice((-1, 1)) * 2.0 ** rng.uniform(19, 1024) for _ in range(200)]
    return [hardest, sys.float_info.max, *large]


KINDS = (
    "of a turn", "headings", "quarter turns", "small", "either side of the other reduction", "large",
)  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_each_is_next_to_the_exact_value(kind: str):
    """Against whole numbers of 1,300 bits, pi by Machin: within the bound, and mostly the nearest."""
    angles = drawn(3, kind)
    worst, nearest = 0.0, 0
    for angle, cos, sin in zip(angles, *directions(angles), strict=True):
        off = [off_ulp(f, w) for f, w in zip((float(cos), float(sin)), exact(angle), strict=True)]
        worst = max(worst, *off)
        nearest += sum(o <= 0.5 for o in off)
    assert worst <= BOUND_ULP
    assert nearest > 0.98 * 2 * len(angles)


def test_what_is_off_by_a_last_place_is_found():
    """Negative control: the reference sees one unit of the last place, and half of one."""
    for angle in (0.3, 2.0, -1e5, 1e300):
        cos, sin = (float(v[0]) for v in directions([angle]))
        for found, wanted in zip((cos, sin), exact(angle), strict=True):
            assert off_ulp(found, wanted) <= BOUND_ULP
            assert 1 - BOUND_ULP < off_ulp(math.nextafter(found, 2.0), wanted) < 1 + BOUND_ULP


@pytest.mark.skipif(np.finfo(np.longdouble).nmant < 63, reason="no longer numbers here")
@pytest.mark.parametrize("reach_rad", [0.8, 4.0, 1e3, NEAR_RAD, 1e15])
def test_a_million_are_next_to_those_of_longer_numbers(reach_rad: float):
    """Where both are well away from 0: the longer numbers' own error does not count there."""
    angles = np.random.default_rng(7).uniform(-reach_rad, reach_rad, 400_000)
    for found, function in zip(directions(angles), (np.cos, np.sin), strict=True):
        wanted = function(angles.astype(np.longdouble))
        off = np.abs((found.astype(np.longdouble) - wanted) / np.spacing(np.abs(found)))
        assert float(off[np.abs(found) > 1e-3].max()) < BOUND_ULP + 0.001


def test_the_sine_is_odd_and_the_cosine_even():
    """To the bit, 0 and the smallest numbers with it."""
    angles = np.array([v for kind in KINDS for v in drawn(4, kind)] + [0.0, 5e-324, 1e-310])
    (cos, sin), (cos_back, sin_back) = directions(angles), directions(-angles)
    assert cos.tobytes() == cos_back.tobytes()
    assert sin.tobytes() == (-sin_back).tobytes()
    small = np.array([0.0, -0.0, 5e-324, -1e-310])
    assert directions(small)[1].tobytes() == small.tobytes()


@pytest.mark.parametrize("lanes", [width for width in _native.lane_widths() if width > 1])
def test_every_width_has_the_same_bits(lanes: int):
    """Near and far angles side by side; one of them moved by its last bit is another (negative control)."""
    rng = np.random.default_rng(11)
    angles = np.concatenate(
        [
            [v for kind in KINDS for v in drawn(5, kind)],
            rng.uniform(-10.0, 10.0, 100_000),
            rng.uniform(-NEAR_RAD, NEAR_RAD, 100_000),
            [math.nan, 0.5, math.inf, -math.inf, 0.25],
        ]
    )
    rng.shuffle(angles)
    alone, beside = directions(angles), directions(angles, lanes)
    assert [v.tobytes() for v in alone] == [v.tobytes() for v in beside]
    place = int(np.flatnonzero(np.abs(angles) < 10.0)[0])
    angles[place] = np.nextafter(angles[place], math.inf)
    other = directions(angles, lanes)
    differ = [np.flatnonzero((a != b) & ~np.isnan(a)) for a, b in zip(alone, other, strict=True)]
    assert set(itertools.chain(*differ)) == {place}


def test_no_angle_has_no_direction():
    """What is infinite or no number gives none, in its place alone."""
    cos, sin = directions([math.nan, math.inf, 0.0, -math.inf])
    assert [math.isnan(v) for v in cos] == [math.isnan(v) for v in sin] == [True, True, False, True]
    assert (cos[2], sin[2]) == (1.0, 0.0)
    with pytest.raises(ValueError, match="whole number of registers"):
        _native.directions(np.zeros(3), 2)
