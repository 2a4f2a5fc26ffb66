"""Runs with robots, links, cameras, starts, references and faults drawn at random.

    .venv/bin/python -m tests.system.random_runs --runs 2000

Each run must end by a name, without an exception or a NaN, with no command or speed above its bound,
and no longer than 0.3 s outside the fence. The tests run a few dozen of them.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from hil.config.fit import check_fit
from hil.config.limits import wheel_speed_max_rad_s
from hil.config.load import build, load_scenario
from hil.config.scenario import Scenario
from hil.core.errors import BadInput
from hil.record.reader import RunRecord
from hil.runs.execute import RunSpec, execute_in_memory

OUTSIDE_S = 0.3
# What a wheel loop may overshoot, and a push or a slope add, over the speed that was commanded.
_OVERSHOOT = 1.3
_SPARE_M_S = 0.1
_FAULTS = (
    "dead_encoder", "dead_channel_a", "swapped_phases", "motor_reversed", "motor_stuck",
    "motors_exchanged", "board_reset", "link_cut", "camera_stall", "camera_occluded",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Result:
    """How the run of one seed went: its end in words, and what must not be."""

    seed: int
    end: str
    problems: tuple[str, ...]


def draw(seed: int) -> tuple[Scenario, str, str]:
    """Return scenario, outer and inner law of one seed; raises BadInput where it cannot be."""
    rng = Random(f"random run {seed}")
    tree = load_scenario("scenario-1").model_dump(mode="json")
    tree |= {"name": "random", "requirements": [], "duration_s": rng.uniform(1.5, 4.0)}
    tree["start"] = {
        "x_m": rng.uniform(-0.85, 0.85), "y_m": rng.uniform(-0.58, 0.58),
        "theta_rad": rng.uniform(-7.0, 7.0),
    }  # fmt: skip
    tree["reference"] = _reference(rng)
    _draw_robot(rng, tree)
    _draw_ways(rng, tree)
    tree["disturbances"] = _disturbances(rng)
    if rng.random() < 0.25:
        tree["faults"] = [{"kind": rng.choice(_FAULTS), "start_s": rng.uniform(0.2, 2.0)}]
    scenario = build(Scenario, tree, f"seed {seed}")
    check_fit(scenario)
    laws = ("asg-ism", "pid")
    return scenario, rng.choice(laws), rng.choice(laws)


def _reference(rng: Random) -> dict[str, Any]:
    def point() -> list[float]:
        return [rng.uniform(-0.7, 0.7), rng.uniform(-0.45, 0.45)]

    kind = rng.choice(["point", "point", "waypoints", "circle"])
    if kind == "point":
        x_m, y_m = point()
        return {"kind": kind, "x_m": x_m, "y_m": y_m}
    if kind == "circle":
        return {"kind": kind, "radius_m": rng.uniform(0.15, 0.4), "rate_rad_s": rng.uniform(0.2, 1)}
    return {"kind": kind, "points_m": [point() for _ in range(rng.randint(3, 6))]}


def _draw_robot(rng: Random, tree: dict[str, Any]) -> None:
    """Draw geometry, mass, motors and floor about those of the built-in robot."""

    def about(value: float, share: float) -> float:
        return value * math.exp(rng.uniform(-math.log(share), math.log(share)))

    robot = tree["robot"]
    robot["variant"] = rng.choice(["constrained", "slip"])
    scale = {"mass_kg": 1.8, "inertia_kg_m2": 1.8, "wheel_radius_m": 1.7, "track_m": 1.5,
             "front_axle_m": 1.5, "rear_axle_m": 1.5, "d0_m": 1.5}  # fmt: skip
    for name, share in scale.items():
        robot[name] = about(robot[name], share)
    for table, name in (("motor", "resistance_ohm"), ("motor", "torque_constant_n_m_a"),
                        ("motor", "coulomb_n_m"), ("floor", "friction_ratio"),
                        ("floor", "rolling_ratio")):  # fmt: skip
        robot[table][name] = about(robot[table][name], 1.4)
    robot["motor"]["stiction_n_m"] = 1.5 * robot["motor"]["coulomb_n_m"]
    robot["motor"]["emf_constant_v_s_rad"] = robot["motor"]["torque_constant_n_m_a"]
    robot["encoder_counts_per_turn"] = rng.choice([240, 600, 1200, 1920, 4000])
    robot["battery"]["charge_start_ratio"] = rng.uniform(0.3, 1.0)
    tree["mismatch"] = {key: rng.uniform(0.9, 1.1) for key in tree["mismatch"]}


def _draw_ways(rng: Random, tree: dict[str, Any]) -> None:
    """Draw what lies between robot and host: link, camera, rate of the loop."""
    tree["link"] |= {
        "baud": rng.choice([38_400, 57_600, 115_200]),
        "latency_s": rng.uniform(0.0, 0.06),
        "latency_jitter_s": rng.uniform(0.0, 0.02),
        "loss_ratio": rng.choice([0.0, 0.0, rng.uniform(0.0, 0.2)]),
        "corruption_ratio": rng.choice([0.0, 0.0, 1e-3]),
    }
    tree["camera"] |= {
        "rate_hz": rng.choice([15.0, 30.0, 60.0]),
        "latency_s": rng.uniform(0.02, 0.12),
        "latency_jitter_s": rng.uniform(0.0, 0.015),
        "drop_ratio": rng.choice([0.01, rng.uniform(0.0, 0.3)]),
    }
    tree["control"]["rate_hz"] = rng.choice([15.0, 30.0, 50.0])


def _disturbances(rng: Random) -> list[dict[str, Any]]:
    if rng.random() < 0.6:
        return []
    target, most = rng.choice([("force_left_n", 4.0), ("force_forward_n", 4.0),
                               ("torque_yaw_n_m", 0.3), ("load_left_n_m", 0.2)])  # fmt: skip
    start_s = rng.uniform(0.2, 1.5)
    return [{"target": target, "shape": "pulse", "amplitude": rng.uniform(-most, most),
             "start_s": start_s, "end_s": start_s + rng.uniform(0.1, 1.0)}]  # fmt: skip


def run_seed(seed: int) -> Result:
    """Draw and run one seed; whatever goes wrong becomes a problem and not an exception."""
    try:
        scenario, outer, inner = draw(seed)
    except BadInput as error:
        return Result(seed, "refused", () if str(error).count("\n") == 0 else (str(error),))
    spec = RunSpec(scenario, "twin", "pose", outer, inner, seed, Path(), rerun=False)
    try:
        record = execute_in_memory(spec)
    except Exception as error:
        return Result(seed, "exception", (f"{type(error).__name__}: {error}",))
    manifest = record.manifest
    end = manifest.outcome_detail.split(" ")[0] or manifest.outcome
    return Result(seed, end, tuple(problems(scenario, record)))


def problems(scenario: Scenario, record: RunRecord) -> Iterator[str]:
    """Yield in words what a run must not do."""
    manifest, samples = record.manifest, record.samples
    if manifest.outcome not in {"complete", "fault"}:
        yield f"ended as {manifest.outcome}"
    if manifest.outcome == "fault" and ": " not in manifest.outcome_detail:
        yield f"a fault without a name: {manifest.outcome_detail!r}"
    if "set-point refused" in manifest.outcome_detail:
        yield f"the board was asked what it does not take: {manifest.outcome_detail}"
    if manifest.outcome == "fault" and "SETPOINT_TIMEOUT" in manifest.outcome_detail:
        reasons = {fault.kind for fault in scenario.faults} & {"link_cut", "board_reset"}
        if not reasons and not scenario.link.loss_ratio and not scenario.link.corruption_ratio:
            yield "set-points timed out on a link that loses nothing"
    if not samples["t_s"].size:
        return
    for name in _FINITE:
        if not np.isfinite(samples[name]).all():
            yield f"{name} is not finite"
    yield from _too_fast(scenario, samples)
    outside_s = _longest_outside_s(scenario, samples)
    if outside_s > OUTSIDE_S:
        yield f"outside the fence for {outside_s:.2f} s"


_FINITE = (
    "est_x_m", "est_y_m", "est_theta_rad", "true_x_m", "true_y_m", "true_theta_rad",
    "true_eta1_m_s", "true_theta_dot_rad_s", "eta1_cmd_m_s", "theta_dot_cmd_rad_s",
    "omega_cmd_left_rad_s", "omega_cmd_right_rad_s",
)  # fmt: skip


def _too_fast(scenario: Scenario, samples: Mapping[str, Any]) -> Iterator[str]:
    limits = scenario.control.limits
    bounds = {
        "eta1_cmd_m_s": limits.eta1_max_m_s,
        "theta_dot_cmd_rad_s": limits.theta_dot_max_rad_s,
        "omega_cmd_left_rad_s": wheel_speed_max_rad_s(scenario.board),
        "omega_cmd_right_rad_s": wheel_speed_max_rad_s(scenario.board),
    }
    if not scenario.faults:  # a motor that is wired wrongly is not commanded
        larger = scenario.mismatch.get("wheel_radius_m", 1.0)
        bounds["true_eta1_m_s"] = _OVERSHOOT * larger * limits.eta1_max_m_s + _SPARE_M_S
    for name, bound in bounds.items():
        most = float(np.abs(samples[name]).max())
        if most > bound * (1.0 + 1e-9):
            yield f"{name} reached {most:.3f}, bound {bound:.3f}"


def _longest_outside_s(scenario: Scenario, samples: Mapping[str, Any]) -> float:
    fence, t_s = scenario.safety, samples["t_s"]
    x_m, y_m = samples["true_x_m"], samples["true_y_m"]
    out = (
        (x_m < fence.fence_x_min_m) | (x_m > fence.fence_x_max_m)
        | (y_m < fence.fence_y_min_m) | (y_m > fence.fence_y_max_m)
    )  # fmt: skip
    longest, since = 0.0, math.nan
    for now_s, is_out in zip(t_s.tolist(), out.tolist(), strict=True):
        if not is_out:
            since = math.nan
        elif math.isnan(since):
            since = now_s
        else:
            longest = max(longest, now_s - since)
    return longest


def main() -> int:
    """Run many seeds on all cores; return 1 when one did what it must not."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--workers", type=int, default=None, help="processes, one a core")
    asked = parser.parse_args()
    seeds = range(asked.first, asked.first + asked.runs)
    ends: Counter[str] = Counter()
    bad = 0
    with multiprocessing.get_context("spawn").Pool(asked.workers) as pool:
        for result in pool.imap_unordered(run_seed, seeds, chunksize=4):
            ends[result.end] += 1
            bad += bool(result.problems)
            for text in result.problems:
                print(f"seed {result.seed}: {text} (ended: {result.end})")
    print(f"{asked.runs} runs, {bad} with problems; ends: {dict(ends.most_common())}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
