"""A run record made without a loop: a robot that glides to a point, with plausible signals."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from hil.analysis.metrics import LinkStats
from hil.record.manifest import Manifest
from hil.record.reader import RunRecord
from hil.record.recorder import Recorder
from hil.record.schema import FRAME_NAMES, SAMPLE_NAMES

DT_S = 1.0 / 30.0
D0_M = 0.03
NAN = math.nan


def scenario(name: str = "scenario-1", duration_s: float = 4.0) -> dict:
    """Return a resolved scenario tree as the manifest keeps it."""
    return {
        "name": name,
        "description": "starts left of the point and turns right",
        "duration_s": duration_s,
        "start": {"x_m": -0.6, "y_m": 0.2, "theta_rad": 0.6},
        "reference": {"kind": "point", "x_m": 0.4, "y_m": 0.0},
        "requirements": [
            {"metric": "delta1_worst_last_second_m", "min": None, "max": 0.02},
            {"metric": "start_offset_x_m", "min": None, "max": 0.0},
            {"metric": "turn_rad", "min": None, "max": 0.0},
        ],
        "robot": {"wheel_radius_m": 0.0482, "mass_kg": 2.8},
        "link": {"baud": 57600, "loss_ratio": 0.01},
        "control": {"rate_hz": 30.0, "eta1_max_m_s": 0.5},
        "disturbances": [],
        "faults": [],
    }


def manifest(law: str = "asg-ism", seed: int = 1, tree: dict | None = None) -> Manifest:
    """Return the manifest of a run that starts at a fixed wall time."""
    return Manifest(
        scenario=tree or scenario(),
        seed=seed,
        target="twin",
        camera="pose",
        outer=law,
        inner="asg-ism",
        gains={"set": "tuned", law: {"k1": 1.2}},
        command=f"hil run scenario-1 --outer {law} --seed {seed}",
        start_time_utc="2024-05-01T10:00:00Z",
        start_unix_us=1_714_557_600_000_000,
    )


def rows(law: str, seed: int, duration_s: float = 4.0, rate_hz: float = 2.0) -> list[tuple]:
    """Return samples of an error that decays with `rate_hz` (1/s) while the heading turns right."""
    rng = np.random.default_rng(seed)
    ticks = round(duration_s / DT_S) + 1
    return [_row(law, i * DT_S, rate_hz, rng) for i in range(ticks)]


def _row(law: str, t_s: float, rate: float, rng: np.random.Generator) -> tuple:
    fade = math.exp(-rate * t_s)
    dx_m, dy_m = -1.0 * fade, 0.2 * fade * (1.0 + 2.0 * t_s)
    theta_rad = 0.6 * fade - 0.1
    eta1, turn = 0.5 * fade, -0.6 * rate * fade
    noise = rng.normal(0.0, 0.002, 2)
    ism = law == "asg-ism"
    s = (0.01 * math.sin(9.0 * t_s), 0.008 * math.cos(7.0 * t_s)) if ism else (NAN, NAN)
    omega = ((eta1 - 0.1083 * turn) / 0.0482, (eta1 + 0.1083 * turn) / 0.0482)
    pose = (0.4 + dx_m, dy_m, theta_rad)
    values = {
        "t_s": t_s, "ref_z1_x_m": 0.4, "ref_z1_y_m": 0.0,
        "est_x_m": pose[0] + noise[0], "est_y_m": pose[1] + noise[1], "est_theta_rad": theta_rad,
        "est_eta1_m_s": eta1, "est_theta_dot_rad_s": turn,
        "true_x_m": pose[0], "true_y_m": pose[1], "true_theta_rad": theta_rad,
        "true_eta1_m_s": eta1, "true_theta_dot_rad_s": turn,
        "delta1_x_m": dx_m + noise[0], "delta1_y_m": dy_m + noise[1],
        "true_delta1_x_m": dx_m, "true_delta1_y_m": dy_m,
        "s_x_m_s2": s[0], "s_y_m_s2": s[1], "eps_m_s2": 0.02 if ism else NAN,
        "in_layer": True if ism else NAN, "saturated": t_s < 0.3,
        "zeta_m_s2": -rate * eta1, "u2_m_s2": D0_M * rate * turn, "v1_m_s3": rate**2 * eta1,
        "eta1_cmd_m_s": eta1, "theta_dot_cmd_rad_s": turn,
        "omega_cmd_left_rad_s": omega[0], "omega_cmd_right_rad_s": omega[1],
        "omega_meas_left_rad_s": omega[0] + noise[0] * 50, "omega_meas_right_rad_s": omega[1],
        "pwm_left_counts": round(25 * omega[0]), "pwm_right_counts": round(25 * omega[1]),
        "wheel_s_left_rad_s": noise[0], "wheel_s_right_rad_s": noise[1], "battery_v": 7.6,
        "pose_seen": True, "pose_quality": 0.9, "camera_latency_s": 0.06 + abs(noise[0]),
        "exposure_to_actuation_s": 0.1 + abs(noise[1]), "rtt_s": 0.045, "clock_sigma_s": 0.0004,
        "link_lost": 0, "deadline_miss": False,
    }  # fmt: skip
    return tuple(values.get(name, NAN) for name in SAMPLE_NAMES)


def frame_row(t_s: float, index: int, sample: tuple) -> tuple:
    """Return the row of a frame whose pose is that of a sample."""
    at = dict(zip(SAMPLE_NAMES, sample, strict=True))
    u, v = 320 + 300 * at["est_x_m"], 240 - 300 * at["est_y_m"]
    values = {
        "t_arrival_s": t_s, "t_exposure_s": t_s - 0.06, "t_cam_s": t_s + 5.0, "index": index,
        "seen": True, "x_m": at["est_x_m"], "y_m": at["est_y_m"], "theta_rad": at["est_theta_rad"],
        "quality": 0.9, "sigma_xy_m": 0.001, "sigma_theta_rad": 0.005,
        "front_u_px": u + 15, "front_v_px": v, "rear_u_px": u - 15, "rear_v_px": v,
    }  # fmt: skip
    return tuple(values.get(name, NAN) for name in FRAME_NAMES)


def image_of(frame: tuple) -> np.ndarray:
    """Return a picture with two coloured marks where the frame's row says."""
    at = dict(zip(FRAME_NAMES, frame, strict=True))
    image = np.full((480, 640, 3), 150, np.uint8)
    for name, colour in (("front", (60, 60, 220)), ("rear", (220, 120, 40))):
        u, v = round(at[f"{name}_u_px"]), round(at[f"{name}_v_px"])
        image[max(v - 6, 0) : v + 6, max(u - 6, 0) : u + 6] = colour
    return image


def make_run(
    folder: Path,
    law: str = "asg-ism",
    seed: int = 1,
    *,
    tree: dict | None = None,
    rate_hz: float = 2.0,
    images: bool = False,
    rerun: bool = False,
) -> RunRecord:
    """Write a whole record to `folder` and return it."""
    tree = tree or scenario()
    recorder = Recorder(folder, manifest(law, seed, tree), rerun=rerun)
    for index, row in enumerate(rows(law, seed, tree["duration_s"], rate_hz)):
        frame = frame_row(row[0], index, row)
        recorder.frame(frame, image_of(frame) if images else None)
        recorder.append(row)
    recorder.event(0.0, "arm", "armed")
    return recorder.close("complete", link=LinkStats(100, 198, 2, 0))
