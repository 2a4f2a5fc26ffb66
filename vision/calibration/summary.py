"""What a calibration says of itself: one document for programs, the same as lines for people."""

from __future__ import annotations

import math
import statistics
from pathlib import Path
from typing import Any

from vision.calibration.floor import FloorCalibration, error_budget
from vision.calibration.intrinsics import LensCalibration
from vision.calibration.lens_fit import KINDS
from vision.calibration.plausible import named
from vision.calibration.views import Views

HEIGHT_ADVICE = (
    "focal length and camera height cannot be told apart from floor points: give --camera-height,"
    " or marks above the floor will be seen in the wrong place"
)


def lens_document(result: LensCalibration, views: Views, file: Path) -> dict[str, Any]:
    """Return the figures of a lens calibration, with what the images gave and did not."""
    return {
        "camera_file": str(file),
        "width_px": result.width_px,
        "height_px": result.height_px,
        "lens": named(result.lens),
        "kind": result.kind,
        "fisheye": result.fisheye,
        "evidence_px": dict(zip(KINDS, result.evidence_px, strict=False)),
        "sigma": named(result.sigma),
        "error_px": result.error_px,
        "held_out_px": result.held_out_px,
        "coverage_ratio": result.coverage_ratio,
        "views": [
            {"name": v.name, "corners": v.corners, "error_px": v.error_px,
             "held_out_px": v.held_out_px, "left_out_px": v.left_out_px,
             "tilt_deg": v.tilt_deg, "dropped": v.dropped}
            for v in result.views
        ],
        "alike": [{"name": name, "like": like} for name, like in result.alike],
        "not_seen": views.missed,
        "brought_to_one_size": views.brought,
        "advice": list(result.advice),
    }  # fmt: skip


def lens_text(result: LensCalibration, views: Views, file: Path) -> str:
    """Return the lens calibration as lines."""
    fx, fy, cx, cy = result.lens[:4]
    lines = [
        f"{result.kind} lens at {result.width_px} x {result.height_px} px: focal length"
        f" {fx:.2f} x {fy:.2f} px"
        f" (sigma {result.sigma[0]:.2f}, {result.sigma[0] / fx:.1%}), centre ({cx:.2f}, {cy:.2f}) px",
        f"distortion {' '.join(list(named(result.lens))[4:])}: "
        + " ".join(f"{k:.5f}" for k in result.lens[4:]),
        f"residual {result.error_px:.3f} px RMS, on held-out views {result.held_out_px:.3f} px RMS;"
        f" image covered {result.coverage_ratio:.0%}",
    ]
    if result.evidence_px:
        figures = [
            f"{kind} {f'{px:.3f} px' if math.isfinite(px) else 'none'}"
            for kind, px in zip(KINDS, result.evidence_px, strict=True)
        ]
        lines.append(f"kind of lens by the median held-out view: {', '.join(figures)}")
    usual_px = _usual_px(result)
    lines += [
        f"dropped {v.name}: {v.left_out_px:.2f} px off the lens of all others, where they have"
        f" {usual_px:.2f} px"
        for v in result.views
        if v.dropped
    ]
    if result.alike:
        names = ", ".join(f"{name} (as {like})" for name, like in result.alike)
        lines.append(f"counted once, the board in the same place: {names}")
    if views.missed:
        lines.append(f"board not seen in {', '.join(views.missed)}")
    lines += views.brought
    lines += [f"to make it better: {advice}" for advice in result.advice]
    return "\n".join([*lines, f"written to {file}; next: hil calibrate floor"])


def _usual_px(result: LensCalibration) -> float:
    """Return the median view's error under the lens of all others, px."""
    return statistics.median(v.left_out_px for v in result.views if not v.dropped)


def floor_document(result: FloorCalibration, height_m: float, file: Path) -> dict[str, Any]:
    """Return the figures of a floor calibration for marks at a height."""
    return {
        "camera_file": str(file),
        "eye_m": [float(x) for x in result.camera.t_world_cam_m],
        "points": len(result.pairs.names),
        "rms_mm": result.rms_mm,
        "held_out_rms_mm": result.held_out_rms_mm,
        "held_out_max_mm": float(max(result.held_out_mm)),
        "dropped": [{"name": name, "error_mm": error} for name, error in result.dropped],
        "budget": error_budget(result.camera, height_m),
        "advice": [],
    }


def floor_text(document: dict[str, Any]) -> str:
    """Return the document of `floor_document` as lines."""
    x, y, z = document["eye_m"]
    budget = document["budget"]
    lines = [
        f"camera at ({x:.4f}, {y:.4f}, {z:.4f}) m over the floor, from {document['points']} points",
        f"residual {document['rms_mm']:.2f} mm RMS, on held-out points"
        f" {document['held_out_rms_mm']:.2f} mm RMS, worst {document['held_out_max_mm']:.2f} mm",
    ]
    lines += [f"dropped {p['name']}: {p['error_mm']:.1f} mm off" for p in document["dropped"]]
    lines.append(
        f"at marks {budget['height_m'] * 1e3:.0f} mm up, over the image's centre and worst corner:"
        f" 0.1 px is {budget['pixel_centre_mm']:.2f} and {budget['pixel_corner_mm']:.2f} mm,"
        f" 3 mm of height {budget['height_centre_mm']:.2f} and {budget['height_corner_mm']:.2f} mm"
    )
    lines += [f"to make it better: {advice}" for advice in document["advice"]]
    return "\n".join([*lines, f"written to {document['camera_file']}"])
