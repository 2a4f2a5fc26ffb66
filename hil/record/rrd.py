"""`run.rrd`: one or several runs as a Rerun recording with its blueprint, on one timeline `t`.

Each run stands under an entity of its own. The floor plan keeps the world frame (X right, Y up,
seen from above). Times are seconds since the first tick of the controlled part; what came before it
(connecting, the robot found at rest) stands at t = 0, for the viewer shows no image at negative times.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from hil.analysis import metrics
from hil.core.files import replace_file
from hil.core.registries import OUTER_LAWS
from hil.core.text import visible
from hil.record.reader import RunRecord

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.record.journal import Columns

    Array = NDArray[np.float64]

Colour = tuple[int, int, int]
TIMELINE = "t"
APPLICATION = "skid-steer-hil"
_BODY_M = (0.15, 0.2166, 0.06)  # thesis Table 8.3: length, width; height is for the eye only
# Colours that people with a colour deficiency tell apart (Okabe and Ito), as in the HTML report.
_OTHER_COLOURS = ((0, 158, 115), (204, 121, 167), (230, 159, 0), (86, 180, 233))
_LINE_COLOURS = ((230, 230, 230), (86, 180, 233), (230, 159, 0), (0, 158, 115))
_GREY = (140, 140, 140)
_FRONT, _REAR = (255, 255, 255), (255, 221, 0)
_MARKS = ("front_u_px", "front_v_px", "rear_u_px", "rear_v_px")
_GRAVE = {"fault", "stop"}
_EYE_HALF_ANGLE_RAD = math.radians(27.0)


@dataclass(frozen=True, slots=True)
class _LineStyle:
    """How the lines of one run look in every chart: start of the names, colours in order."""

    prefix: str
    colours: Sequence[Colour]


@dataclass(frozen=True, slots=True)
class Plot:
    """One chart: `lines` are (name in the legend, column, factor to the unit shown)."""

    key: str
    title: str
    lines: tuple[tuple[str, str, float], ...]


PLOTS = (
    Plot("error", "Error δ1 (mm)", (("|δ1|", "error_norm_m", 1e3), ("x", "error_x_m", 1e3),
                                   ("y", "error_y_m", 1e3))),
    Plot("sliding", "Sliding variable s, layer ε (m/s²)",
         (("s x", "s_x_m_s2", 1.0), ("s y", "s_y_m_s2", 1.0), ("ε", "eps_m_s2", 1.0))),
    Plot("control", "Control u (m/s²)", (("u1 = ζ", "zeta_m_s2", 1.0), ("u2", "u2_m_s2", 1.0))),
    Plot("command", "Body speed (m/s, rad/s)",
         (("η1 command", "eta1_cmd_m_s", 1.0), ("η1 estimate", "est_eta1_m_s", 1.0),
          ("θ̇ command", "theta_dot_cmd_rad_s", 1.0), ("θ̇ estimate", "est_theta_dot_rad_s", 1.0))),
    Plot("wheels", "Wheel speed (rad/s)",
         (("left command", "omega_cmd_left_rad_s", 1.0), ("left", "omega_meas_left_rad_s", 1.0),
          ("right command", "omega_cmd_right_rad_s", 1.0),
          ("right", "omega_meas_right_rad_s", 1.0))),
    Plot("pwm", "PWM (counts)", (("left", "pwm_left_counts", 1.0),
                                 ("right", "pwm_right_counts", 1.0))),
    Plot("latency", "Latency (ms)",
         (("exposure to actuation", "exposure_to_actuation_s", 1e3),
          ("camera", "camera_latency_s", 1e3), ("round trip", "rtt_s", 1e3))),
)  # fmt: skip
_OWN_PLOT_LINES = 4


def own_plots(run: RunRecord) -> tuple[Plot, ...]:
    """Return a chart for each unit of the law's own columns; of many terms, several charts."""
    by_unit: dict[str, list[str]] = {}
    for term in run.manifest.trace:
        by_unit.setdefault(term.unit, []).append(term.name)
    plots = []
    for unit, names in by_unit.items():
        for i in range(0, len(names), _OWN_PLOT_LINES):
            some = names[i : i + _OWN_PLOT_LINES]
            title = f"{run.manifest.outer}: {', '.join(some)}{f' ({unit})' if unit else ''}"
            key = f"law/{some[0]}"
            plots.append(Plot(key, title, tuple((name, name, 1.0) for name in some)))
    return tuple(plots)


_MAIN_PLOTS = ("error", "sliding", "wheels", "latency")


def write_rrd(path: Path, runs: Sequence[RunRecord]) -> None:
    """Write the runs to one Rerun file, atomically; the first run's name titles the recording."""
    replace_file(path, _in_bytes(runs, entity_names(runs)))


def _in_bytes(runs: Sequence[RunRecord], names: Sequence[str]) -> bytes:
    """Return the file's content: Rerun's own writer waits for ever once a file cannot be written."""
    recording = rr.RecordingStream(APPLICATION, recording_id=_recording_id(runs))
    memory = recording.memory_recording()
    recording.send_blueprint(blueprint(runs, names), make_active=False)
    recording.send_recording_name(" and ".join(names))
    one_scenario = len({run.manifest.scenario_name for run in runs}) == 1
    legends = [f"{name.rpartition('/')[2] if one_scenario else name} " for name in names]
    for index, (name, run) in enumerate(zip(names, runs, strict=True)):
        colour = _colour(run, index, runs)
        prefix, lines = ("", _LINE_COLOURS) if len(runs) == 1 else (legends[index], _shades(colour))
        _Sender(recording, name, run, colour).send(_LineStyle(prefix, lines))
    recording.flush()
    return bytes(memory.drain_as_bytes())


def entity_names(runs: Sequence[RunRecord]) -> list[str]:
    """Return a distinct entity name per run: scenario and law, numbered when they repeat."""
    plain = [visible(f"{run.manifest.scenario_name}/{run.manifest.outer}") for run in runs]
    return [
        f"{name}-{plain[: index + 1].count(name)}" if plain.count(name) > 1 else name
        for index, name in enumerate(plain)
    ]


def _recording_id(runs: Sequence[RunRecord]) -> str:
    return "-".join(f"{run.manifest.start_unix_us:x}" for run in runs)


def _colour(run: RunRecord, index: int, runs: Sequence[RunRecord]) -> Colour:
    """Return the colour of the law, or a distinct one when two runs have the same law."""
    laws = [other.manifest.outer for other in runs]
    own = {entry.name: entry.colour for entry in OUTER_LAWS.entries()}.get(run.manifest.outer)
    if own and laws.count(run.manifest.outer) == 1:
        return int(own[1:3], 16), int(own[3:5], 16), int(own[5:7], 16)
    return _OTHER_COLOURS[index % len(_OTHER_COLOURS)]


def _shades(colour: Colour) -> tuple[Colour, ...]:
    """Return the colour of a run, then ever paler ones for its further lines in a chart."""
    return tuple(
        tuple(round(part + (255 - part) * pale) for part in colour)  # type: ignore[misc]
        for pale in (0.0, 0.35, 0.6, 0.8)
    )


def _on_floor(x_m: Array, y_m: Array, z_m: float = 0.001) -> Array:
    return np.column_stack((x_m, y_m, np.full(x_m.size, z_m)))


class _Sender:
    """Sends one run to the recording, every signal under the entity `name`."""

    def __init__(
        self, recording: rr.RecordingStream, name: str, run: RunRecord, colour: Colour
    ) -> None:
        self._recording = recording
        self._name = name
        self._run = run
        self._colour = colour
        self._ticks = [rr.TimeColumn(TIMELINE, duration=run.samples["t_s"])]

    def _log_static(self, entity: str, *what: rr.AsComponents) -> None:
        self._recording.log(f"{self._name}/{entity}", *what, static=True)

    def send(self, style: _LineStyle) -> None:
        """Send floor plan, charts, camera and events."""
        samples = self._run.samples
        if samples["t_s"].size > 0:
            self._floor(samples)
            x_m, y_m = metrics.error_components(samples)
            norm_m = np.hypot(x_m, y_m)
            derived = {"error_x_m": x_m, "error_y_m": y_m, "error_norm_m": norm_m}
            for plot in (*PLOTS, *own_plots(self._run)):
                lines = {
                    name: derived[name] if name in derived else samples[name]
                    for _, name, _ in plot.lines
                }
                self._plot(plot, lines, style)
        if self._run.pictures:
            self._camera()
        if self._run.events:
            self._events()

    def _floor(self, samples: Columns) -> None:
        who = "true" if metrics.has_truth(samples) else "est"
        x_m, y_m, theta_rad = (samples[f"{who}_{key}"] for key in ("x_m", "y_m", "theta_rad"))
        known = np.isfinite(x_m)
        path = rr.LineStrips3D(
            [_on_floor(x_m[known], y_m[known])], colors=self._colour, radii=0.003
        )
        self._log_static("floor/path", path)
        self._reference(samples)
        body = rr.Boxes3D(sizes=[_BODY_M], colors=self._colour, labels=[self._run.manifest.outer])
        heading = rr.Arrows3D(vectors=[(0.14, 0.0, 0.0)], colors=self._colour, radii=0.006)
        self._log_static("floor/robot", body, heading)
        half = np.nan_to_num(theta_rad) / 2.0
        zero = np.zeros_like(half)
        poses = rr.Transform3D.columns(
            translation=_on_floor(np.nan_to_num(x_m), np.nan_to_num(y_m), _BODY_M[2] / 2),
            quaternion=np.column_stack((zero, zero, np.sin(half), np.cos(half))),
        )
        self._recording.send_columns(f"{self._name}/floor/robot", self._ticks, poses)
        if who == "true":
            self._log_static("floor/estimate", rr.Points3D.from_fields(colors=_GREY, radii=0.008))
            seen = rr.Points3D.columns(
                positions=_on_floor(samples["est_x_m"], samples["est_y_m"], 0.07)
            )
            self._recording.send_columns(f"{self._name}/floor/estimate", self._ticks, seen)

    def _reference(self, samples: Columns) -> None:
        points = _on_floor(samples["ref_z1_x_m"], samples["ref_z1_y_m"])
        self._log_static("floor/reference", rr.LineStrips3D([points], colors=_GREY, radii=0.002))
        target = rr.Points3D(points[-1:], colors=_GREY, radii=0.012, labels=["z1*"])
        self._log_static("floor/target", target)

    def _plot(self, plot: Plot, columns: Columns, style: _LineStyle) -> None:
        """Send the lines of a chart as one entity; a chart without any value is left out."""
        table = np.column_stack([columns[column] * factor for _, column, factor in plot.lines])
        if not np.isfinite(table).any():
            return
        count = len(plot.lines)
        names = [style.prefix + line[0] for line in plot.lines]
        lines = rr.SeriesLines(names=names, colors=style.colours[:count], widths=[1.5] * count)
        self._log_static(plot.key, lines)
        values = rr.Scalars.columns(scalars=table.ravel()).partition([count] * len(table))
        self._recording.send_columns(f"{self._name}/{plot.key}", self._ticks, values)

    def _camera(self) -> None:
        pictures, frames = self._run.pictures_from_start(), self._run.frames
        time = [rr.TimeColumn(TIMELINE, duration=[max(item.t_s, 0.0) for item in pictures])]
        blobs = [picture.path.read_bytes() for picture in pictures]
        images = rr.EncodedImage.columns(blob=blobs, media_type=["image/jpeg"] * len(blobs))
        self._recording.send_columns(f"{self._name}/camera/image", time, images)
        if frames:
            self._marks([picture.t_s for picture in pictures], time)

    def _marks(self, picture_times_s: list[float], time: list[rr.TimeColumn]) -> None:
        """Send the marks found in each picture; without a find the last ones are cleared."""
        frames = self._run.frames
        rows = [int(np.abs(frames["t_arrival_s"] - t_s).argmin()) for t_s in picture_times_s]
        marks = np.column_stack([frames[key][rows] for key in _MARKS])
        found = np.isfinite(marks).all(axis=1)
        style = rr.Points2D.from_fields(colors=[_FRONT, _REAR], radii=4.0)
        self._log_static("camera/image/marks", style)
        positions = rr.Points2D.columns(positions=marks[found].reshape(-1, 2))
        pairs = positions.partition(np.where(found, 2, 0))
        self._recording.send_columns(f"{self._name}/camera/image/marks", time, pairs)

    def _events(self) -> None:
        events = self._run.events
        time = [rr.TimeColumn(TIMELINE, duration=[max(event.t_s, 0.0) for event in events])]
        text = [visible(f"{event.t_s:.2f} s  {event.kind}: {event.text}") for event in events]
        level = ["WARN" if event.kind in _GRAVE else "INFO" for event in events]
        lines = rr.TextLog.columns(text=text, level=level)
        self._recording.send_columns(f"{self._name}/events", time, lines)


def blueprint(runs: Sequence[RunRecord], names: Sequence[str]) -> rrb.Blueprint:
    """Return the layout: floor plan and camera on the left, charts on the right."""
    floor = rrb.Spatial3DView(
        name="Floor plan",
        origin="/",
        contents=[f"+ /{name}/floor/**" for name in names],
        eye_controls=_eye_above(runs),
        line_grid=rrb.LineGrid3D(visible=True, spacing=0.1),
    )
    cameras: list[rrb.View | rrb.Container] = [
        rrb.Spatial2DView(name=f"Camera, {name}", origin=f"/{name}/camera/image")
        for name, run in zip(names, runs, strict=True)
        if run.pictures
    ]
    own = {plot.key: plot for run in runs for plot in own_plots(run)}
    plots = (*PLOTS, *own.values())
    charts = {plot.key: _chart(plot, names) for plot in plots}
    main = rrb.Vertical(*[charts[key] for key in _MAIN_PLOTS], name="Main")
    more = [charts[plot.key] for plot in plots if plot.key not in _MAIN_PLOTS]
    events = rrb.TextLogView(name="Events", contents=[f"+ /{name}/events" for name in names])
    left: list[rrb.View | rrb.Container] = [floor]
    if cameras:
        left.append(rrb.Tabs(*cameras) if len(cameras) > 1 else cameras[0])
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(*left),
            rrb.Tabs(main, rrb.Vertical(*more, events, name="Commands and events")),
            column_shares=[1, 1],
        ),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE),
    )


def _chart(plot: Plot, names: Sequence[str]) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        name=plot.title,
        contents=[f"+ /{name}/{plot.key}" for name in names],
        plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop),
    )


def _eye_above(runs: Sequence[RunRecord]) -> rrb.EyeControls3D:
    """Look straight down on the middle of all paths, from high enough to see them whole."""
    x_m = np.concatenate([np.r_[run.samples["est_x_m"], run.samples["ref_z1_x_m"]] for run in runs])
    y_m = np.concatenate([np.r_[run.samples["est_y_m"], run.samples["ref_z1_y_m"]] for run in runs])
    x_m, y_m = x_m[np.isfinite(x_m)], y_m[np.isfinite(y_m)]
    if x_m.size == 0:
        return rrb.EyeControls3D(position=(0, 0, 3), look_target=(0, 0, 0), eye_up=(0, 1, 0))
    middle = ((x_m.max() + x_m.min()) / 2, (y_m.max() + y_m.min()) / 2, 0.0)
    wide_m, high_m = float(np.ptp(x_m)) + 0.5, float(np.ptp(y_m)) + 0.5
    height_m = max(high_m, wide_m / 1.6) / (2.0 * math.tan(_EYE_HALF_ANGLE_RAD))
    position = (middle[0], middle[1], height_m)
    return rrb.EyeControls3D(position=position, look_target=middle, eye_up=(0.0, 1.0, 0.0))
