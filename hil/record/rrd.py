"""`run.rrd`: one or several runs as a Rerun recording with its blueprint, on one timeline `t`.

Each run stands under an entity of its own. The floor plan keeps the world frame (X right, Y up,
seen from above). Times are seconds since the first tick of the controlled part; what came before it
(connecting, the robot found at rest) stands at t = 0, for the viewer shows no image at negative times.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from hil.analysis import metrics
from hil.analysis.pieces import PIECE_ROWS, pieces, row_count
from hil.core.files import replacing
from hil.core.registries import law_colour
from hil.core.text import visible
from hil.record.reader import RunRecord
from hil.record.rrd_file import Put, written_by

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil.record.journal import Columns

    Array = NDArray[np.float64]
    Times = Array | list[float]

Colour = tuple[int, int, int]
ColourOf = Callable[[str], str]  # of a law by its name: #rrggbb, or ""
TIMELINE = "t"
APPLICATION = "skid-steer-hil"
_BODY_M = (0.15, 0.2166, 0.06)  # thesis Table 8.3: length, width; height is for the eye only
# Colours that people with a colour deficiency tell apart (Okabe and Ito), as in the HTML report.
_OTHER_COLOURS = ((0, 158, 115), (204, 121, 167), (230, 159, 0), (86, 180, 233))
_LINE_COLOURS = ((230, 230, 230), (86, 180, 233), (230, 159, 0), (0, 158, 115))
_GREY = (140, 140, 140)
_FRONT, _REAR = (255, 255, 255), (255, 221, 0)
_MARKS = ("front_u_px", "front_v_px", "rear_u_px", "rear_v_px")
_DERIVED = ("error_x_m", "error_y_m", "error_norm_m")
_PICTURES_AT_ONCE = 32
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


def write_rrd(path: Path, runs: Sequence[RunRecord], colour_of: ColourOf = law_colour) -> None:
    """Write the runs to one Rerun file, atomically; the first run's name titles the recording."""
    names = entity_names(runs)
    recording = rr.RecordingStream(APPLICATION, recording_id=_recording_id(runs))
    with replacing(path) as part, written_by(recording, part) as put:
        recording.send_blueprint(blueprint(runs, names), make_active=False)
        recording.send_recording_name(" and ".join(names))
        _send_all(recording, runs, names, colour_of, put)


def _send_all(
    recording: rr.RecordingStream,
    runs: Sequence[RunRecord],
    names: Sequence[str],
    colour_of: ColourOf,
    put: Put,
) -> None:
    one_scenario = len({run.manifest.scenario_name for run in runs}) == 1
    legends = [f"{name.rpartition('/')[2] if one_scenario else name} " for name in names]
    for index, (name, run) in enumerate(zip(names, runs, strict=True)):
        colour = _colour(run, index, runs, colour_of)
        prefix, lines = ("", _LINE_COLOURS) if len(runs) == 1 else (legends[index], _shades(colour))
        _Sender(recording, name, run, colour, put).send(_LineStyle(prefix, lines))


def entity_names(runs: Sequence[RunRecord]) -> list[str]:
    """Return a distinct entity name per run: scenario and law, numbered when they repeat."""
    plain = [visible(f"{run.manifest.scenario_name}/{run.manifest.outer}") for run in runs]
    return [
        f"{name}-{plain[: index + 1].count(name)}" if plain.count(name) > 1 else name
        for index, name in enumerate(plain)
    ]


def _recording_id(runs: Sequence[RunRecord]) -> str:
    return "-".join(f"{run.manifest.start_unix_us:x}" for run in runs)


def _colour(run: RunRecord, index: int, runs: Sequence[RunRecord], colour_of: ColourOf) -> Colour:
    """Return the colour of the law, or a distinct one when two runs have the same law."""
    laws = [other.manifest.outer for other in runs]
    own = colour_of(run.manifest.outer)
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
    """Sends one run to the recording, every signal under the entity `name`, piece by piece.

    `put` writes what has been sent; it is called often enough that little is held.
    """

    def __init__(
        self,
        recording: rr.RecordingStream,
        name: str,
        run: RunRecord,
        colour: Colour,
        put: Put,
    ) -> None:
        self._recording = recording
        self._name = name
        self._run = run
        self._colour = colour
        self._put = put
        self._error = metrics.error_names(run.samples) if row_count(run.samples) else ()

    def _log_static(self, entity: str, *what: rr.AsComponents) -> None:
        self._recording.log(f"{self._name}/{entity}", *what, static=True)

    def _send(self, entity: str, t_s: Times, what: rr.ComponentColumnList) -> None:
        time = [rr.TimeColumn(TIMELINE, duration=t_s)]
        self._recording.send_columns(f"{self._name}/{entity}", time, what)

    def _pieces(self, names: Sequence[str]) -> Iterator[Columns]:
        """Yield columns of the samples in pieces, the errors of the charts worked out among them."""
        recorded = [name for name in names if name not in _DERIVED]
        error = self._error if len(recorded) < len(names) else ()
        for piece in pieces(self._run.samples, ["t_s", *dict.fromkeys((*recorded, *error))]):
            if error:
                x_m, y_m = (piece[name] for name in error)
                piece |= dict(zip(_DERIVED, (x_m, y_m, np.hypot(x_m, y_m)), strict=True))
            yield piece
            self._put()

    def send(self, style: _LineStyle) -> None:
        """Send floor plan, charts, camera and events."""
        if row_count(self._run.samples) > 0:
            self._floor()
            for plot in (*PLOTS, *own_plots(self._run)):
                self._plot(plot, style)
        if self._run.pictures:
            self._camera()
        if self._run.events:
            self._events()

    def _floor(self) -> None:
        who = "true" if metrics.has_truth(self._run.samples) else "est"
        at = (f"{who}_x_m", f"{who}_y_m")
        path = self._line(*at)
        self._log_static(
            "floor/path",
            rr.LineStrips3D([path[np.isfinite(path[:, 0])]], colors=self._colour, radii=0.003),
        )
        self._reference()
        body = rr.Boxes3D(sizes=[_BODY_M], colors=self._colour, labels=[self._run.manifest.outer])
        heading = rr.Arrows3D(vectors=[(0.14, 0.0, 0.0)], colors=self._colour, radii=0.006)
        self._log_static("floor/robot", body, heading)
        for piece in self._pieces([*at, f"{who}_theta_rad"]):
            x_m, y_m, theta_rad = (np.nan_to_num(piece[k]) for k in (*at, f"{who}_theta_rad"))
            half, zero = theta_rad / 2.0, np.zeros_like(theta_rad)
            poses = rr.Transform3D.columns(
                translation=_on_floor(x_m, y_m, _BODY_M[2] / 2),
                quaternion=np.column_stack((zero, zero, np.sin(half), np.cos(half))),
            )
            self._send("floor/robot", piece["t_s"], poses)
        if who == "true":
            self._log_static("floor/estimate", rr.Points3D.from_fields(colors=_GREY, radii=0.008))
            for piece in self._pieces(["est_x_m", "est_y_m"]):
                seen = _on_floor(piece["est_x_m"], piece["est_y_m"], 0.07)
                self._send("floor/estimate", piece["t_s"], rr.Points3D.columns(positions=seen))

    def _line(self, x_name: str, y_name: str) -> Array:
        """Return a line on the floor: of a long run every so many points, and the last."""
        samples = self._run.samples
        every = -(-row_count(samples) // PIECE_ROWS)
        points, first = [], 0
        for piece in pieces(samples, [x_name, y_name]):
            points.append(_on_floor(piece[x_name], piece[y_name]))
            last, rows = points[-1][-1:], len(points[-1])
            points[-1] = points[-1][-first % every :: every]
            first += rows
        ended = (first - 1) % every == 0
        return np.concatenate(points if ended else [*points, last])

    def _reference(self) -> None:
        points = self._line("ref_z1_x_m", "ref_z1_y_m")
        self._log_static("floor/reference", rr.LineStrips3D([points], colors=_GREY, radii=0.002))
        target = rr.Points3D(points[-1:], colors=_GREY, radii=0.012, labels=["z1*"])
        self._log_static("floor/target", target)

    def _plot(self, plot: Plot, style: _LineStyle) -> None:
        """Send the lines of a chart as one entity; a chart without any value is left out."""
        names = [column for _, column, _ in plot.lines]
        if not any(np.isfinite(p[name]).any() for p in self._pieces(names) for name in names):
            return
        count = len(plot.lines)
        legend = [style.prefix + line[0] for line in plot.lines]
        lines = rr.SeriesLines(names=legend, colors=style.colours[:count], widths=[1.5] * count)
        self._log_static(plot.key, lines)
        for piece in self._pieces(names):
            table = np.column_stack([piece[column] * factor for _, column, factor in plot.lines])
            values = rr.Scalars.columns(scalars=table.ravel()).partition([count] * len(table))
            self._send(plot.key, piece["t_s"], values)

    def _camera(self) -> None:
        pictures = self._run.pictures_from_start()
        times = [max(picture.t_s, 0.0) for picture in pictures]
        for first in range(0, len(pictures), _PICTURES_AT_ONCE):
            some = slice(first, first + _PICTURES_AT_ONCE)
            blobs = [picture.path.read_bytes() for picture in pictures[some]]
            images = rr.EncodedImage.columns(blob=blobs, media_type=["image/jpeg"] * len(blobs))
            self._send("camera/image", times[some], images)
            self._put()
        if self._run.frames:
            self._marks(np.array([picture.t_s for picture in pictures]), times)

    def _marks(self, picture_times_s: Array, times: list[float]) -> None:
        """Send the marks found in each picture; without a find the last ones are cleared."""
        marks = np.full((picture_times_s.size, len(_MARKS)), np.nan)
        away_s = np.full(picture_times_s.size, np.inf)
        for piece in pieces(self._run.frames, ["t_arrival_s", *_MARKS]):
            t_s = piece["t_arrival_s"]
            after = np.searchsorted(t_s, picture_times_s)
            for row in (np.clip(after - 1, 0, t_s.size - 1), np.clip(after, 0, t_s.size - 1)):
                off_s = np.abs(t_s[row] - picture_times_s)
                nearer = off_s < away_s
                away_s[nearer] = off_s[nearer]
                found = np.column_stack([piece[key][row] for key in _MARKS])
                marks[nearer] = found[nearer]
        found = np.isfinite(marks).all(axis=1)
        style = rr.Points2D.from_fields(colors=[_FRONT, _REAR], radii=4.0)
        self._log_static("camera/image/marks", style)
        positions = rr.Points2D.columns(positions=marks[found].reshape(-1, 2))
        self._send("camera/image/marks", times, positions.partition(np.where(found, 2, 0)))

    def _events(self) -> None:
        events = self._run.events
        text = [visible(f"{event.t_s:.2f} s  {event.kind}: {event.text}") for event in events]
        level = ["WARN" if event.kind in _GRAVE else "INFO" for event in events]
        lines = rr.TextLog.columns(text=text, level=level)
        self._send("events", [max(event.t_s, 0.0) for event in events], lines)


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
    names = ("est_x_m", "ref_z1_x_m", "est_y_m", "ref_z1_y_m")
    ends = [
        [np.concatenate((piece[one], piece[other])) for one, other in (names[:2], names[2:])]
        for run in runs
        if row_count(run.samples)
        for piece in map(_known_ends, pieces(run.samples, names))
    ]
    x_m, y_m = (np.concatenate([np.empty(0), *(end[axis] for end in ends)]) for axis in (0, 1))
    if x_m.size == 0:
        return rrb.EyeControls3D(position=(0, 0, 3), look_target=(0, 0, 0), eye_up=(0, 1, 0))
    middle = ((x_m.max() + x_m.min()) / 2, (y_m.max() + y_m.min()) / 2, 0.0)
    wide_m, high_m = float(np.ptp(x_m)) + 0.5, float(np.ptp(y_m)) + 0.5
    height_m = max(high_m, wide_m / 1.6) / (2.0 * math.tan(_EYE_HALF_ANGLE_RAD))
    position = (middle[0], middle[1], height_m)
    return rrb.EyeControls3D(position=position, look_target=middle, eye_up=(0.0, 1.0, 0.0))


def _known_ends(piece: Columns) -> Columns:
    """Return the least and the largest known value of each column, nothing where none is known."""
    known = {name: values[np.isfinite(values)] for name, values in piece.items()}
    return {k: np.array([v.min(), v.max()]) if v.size else v for k, v in known.items()}
