"""The camera file: one TOML with the tables of a scenario's `camera`, written a table at a time.

`hil calibrate camera` writes the top keys and `[lens]`, `hil calibrate floor` `[pose]`, and
`hil calibrate colours` `[marks.front]` and `[marks.rear]`; the tables of the others stay as they
are, comments included. How good a calibration was stands as comments in its table.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from hil.config.camera import CameraConfig
from hil.config.load import build
from hil.core.errors import BadInput
from hil.core.files import parse_toml
from vision.calibration.colours import ColourCalibration
from vision.calibration.floor import FloorCalibration
from vision.calibration.intrinsics import LensCalibration
from vision.calibration.lens_fit import KINDS
from vision.calibration.plausible import named
from vision.correction import CorrectedCamera
from vision.cv_compat import write_atomic

Value = int | float | bool | Sequence["Value"]

_HEADER = re.compile(r"^\s*\[([^\[\]]+)\]")


@dataclass(frozen=True, slots=True)
class Table:
    """One table to write: its name ("" for the top keys), values, and comment lines."""

    name: str
    values: Mapping[str, Value]
    comments: Sequence[str] = ()

    def text(self) -> str:
        """Return the table as TOML."""
        lines = [f"[{self.name}]"] if self.name else []
        lines += [f"# {line}" for line in self.comments]
        lines += [f"{key} = {_show(value)}" for key, value in self.values.items()]
        return "\n".join(lines) + "\n"


def _show(value: Value) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return str(value)
    if isinstance(value, Sequence):
        return f"[{', '.join(_show(item) for item in value)}]"
    return repr(round(float(value), 12))


def read_camera(path: Path) -> CameraConfig:
    """Return the camera that a file describes; raises BadInput."""
    return _parse(_read_text(path), path)


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise BadInput(
            f"{path}: cannot be read: {error.strerror}; `hil calibrate camera` makes it"
        ) from None
    except UnicodeDecodeError:
        raise BadInput(f"{path}: not a text file; a camera file is TOML") from None


def _parse(text: str, path: Path) -> CameraConfig:
    return build(CameraConfig, parse_toml(text, str(path)), str(path))


def update_camera(path: Path, tables: Sequence[Table]) -> CameraConfig:
    """Put the tables into the file, made if it is not there, and return what it now describes.

    The new text is checked as a whole before anything is written.
    """
    blocks = _blocks(_read_text(path)) if path.exists() else {}
    if path.exists():
        read_camera(path)
    for table in tables:
        # The top keys are of several commands: those that are not written now stay.
        kept = _without(blocks.get("", ""), table.values) if not table.name else ""
        blocks[table.name] = kept + table.text()
    order = sorted(blocks, key=lambda name: name != "")
    text = "\n".join(blocks[name].strip("\n") + "\n" for name in order)
    config = _parse(text, path)
    write_atomic(path, text.encode("utf-8"))
    return config


def _without(block: str, keys: Mapping[str, Value]) -> str:
    """Return the lines of a block that do not set one of the keys."""
    lines = block.splitlines(keepends=True)
    return "".join(line for line in lines if line.split("=")[0].strip() not in keys)


def _blocks(text: str) -> dict[str, str]:
    """Return the text of every table by name, "" for what stands before the first."""
    blocks: dict[str, str] = {}
    name = ""
    for line in text.splitlines(keepends=True):
        header = _HEADER.match(line)
        if header:
            name = header.group(1).strip()
        blocks[name] = blocks.get(name, "") + line
    return blocks


def lens_tables(calibration: LensCalibration) -> list[Table]:
    """Return the tables of a lens calibration, with its error figures as comments."""
    kept = [view for view in calibration.views if not view.dropped]
    dropped = [view.name for view in calibration.views if view.dropped]
    size = {"width_px": calibration.width_px, "height_px": calibration.height_px}
    at_size = {f"at_{key}": value for key, value in size.items()}
    comments = [
        f"from {len(kept)} views, {sum(view.corners for view in kept)} corners; dropped:"
        f" {', '.join(dropped) or 'none'}",
        f"residual {calibration.error_px:.3f} px RMS, on held-out views"
        f" {calibration.held_out_px:.3f} px RMS",
        *[
            f"{name} shows the board as {like} does: counted once"
            for name, like in calibration.alike
        ],
        *_kind_comment(calibration),
        f"standard deviation of fx {calibration.sigma[0]:.2f} px, of cx"
        f" {calibration.sigma[2]:.2f} px; image covered {calibration.coverage_ratio:.0%}",
    ]
    lens = {**at_size, "fisheye": calibration.fisheye, **named(calibration.lens)}
    return [
        Table("", size),
        Table("lens", lens, comments),
    ]


def _kind_comment(calibration: LensCalibration) -> list[str]:
    if not calibration.evidence_px:
        return []
    figures = zip(KINDS, calibration.evidence_px, strict=True)
    return [f"median view, held out: {', '.join(f'{kind} {px:.3f} px' for kind, px in figures)}"]


def floor_tables(result: FloorCalibration, with_lens: bool) -> list[Table]:
    """Return the tables of a floor calibration; the lens too where it was fitted or corrected."""
    camera = result.camera
    comments = [
        f"from {len(result.pairs.names)} points; dropped:"
        f" {', '.join(name for name, _ in result.dropped) or 'none'}",
        f"residual {result.rms_mm:.2f} mm RMS, on held-out points"
        f" {result.held_out_rms_mm:.2f} mm RMS",
    ]
    rotation = [[float(x) for x in row] for row in camera.R_world_cam]
    eye = [float(x) for x in camera.t_world_cam_m]
    pose = Table("pose", {"eye_m": eye, "R_world_cam": rotation}, comments)
    if not with_lens and not isinstance(camera, CorrectedCamera):
        return [pose]
    size = {"width_px": camera.width_px, "height_px": camera.height_px}
    numbers = (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, *camera.dist)
    lens: dict[str, Value] = {f"at_{key}": value for key, value in size.items()}
    lens |= {"fisheye": camera.fisheye, **named(numbers)}
    if isinstance(camera, CorrectedCamera):
        lens["shift_degree"] = camera.degree
        for axis, name in enumerate(("shift_u", "shift_v")):
            lens[name] = [float(x) for x in camera.shift[:, axis]]
    how = "fitted to the floor's points" if with_lens else "corrected by the floor's points"
    return [Table("", size), Table("lens", lens, [how]), pose]


def colour_tables(config: CameraConfig, result: ColourCalibration) -> list[Table]:
    """Return the tables of both marks with the learned colours, their places as they were."""
    comment = f"learned; separation of the two d' = {result.separation:.1f}"
    tables = []
    for name, mark, colour in (
        ("front", config.marks.front, result.front),
        ("rear", config.marks.rear, result.rear),
    ):
        values: dict[str, Value] = {
            "colour": [round(c, 4) for c in colour.bgr],
            "x_m": mark.x_m,
            "y_m": mark.y_m,
        }
        tables.append(Table(f"marks.{name}", values, [comment]))
    return tables


def require_size(config: CameraConfig, size_px: tuple[int, int], camera: str, image: str) -> None:
    """Raise BadInput when an image has another resolution than the one calibrated."""
    have = (config.width_px, config.height_px)
    if have != size_px:
        raise BadInput(
            f"{image}: {size_px[0]} x {size_px[1]} px, but {camera} was calibrated at {have[0]} x"
            f" {have[1]} px; set the camera to that, or calibrate at this resolution"
        )
