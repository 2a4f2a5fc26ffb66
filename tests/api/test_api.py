"""`import hil`: the functions beside the commands."""

from __future__ import annotations

import ast
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import hil
from hil.record.reader import read_run
from hil.tools.templates import write_template
from tests.cli.command import hil as hil_command

POSE = {"camera": "pose", "duration_s": 1.0}


def modules_after(code: str) -> set[str]:
    """Return what a fresh interpreter has loaded after `code`."""
    said = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys; print(*sys.modules)"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return set(said.stdout.split())


def test_importing_loads_nothing_heavy() -> None:
    """What makes an import slow comes when it is used; names are there all the same."""
    loaded = modules_after("import hil; dir(hil)")
    assert "hil" in loaded
    assert not loaded & {"numpy", "pydantic", "pyarrow", "cv2", "click", "scipy", "matplotlib"}
    assert set(hil.__all__) == set(dir(hil))
    assert all(getattr(hil, name) is not None for name in hil.__all__)


def test_stub_of_names_is_the_same_list() -> None:
    """What a type checker sees is what a program gets."""
    tree = ast.parse(Path(hil.__file__).read_text(encoding="utf-8"))
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    seen = {alias.asname for node in block.body if isinstance(node, ast.ImportFrom)
            for alias in node.names if alias.asname}  # fmt: skip
    seen |= {node.targets[0].id for node in block.body if isinstance(node, ast.Assign)}
    assert seen | {"__version__"} == set(hil.__all__)


def test_unknown_name_is_told() -> None:
    """A name that is not there fails as in any module."""
    with pytest.raises(AttributeError, match="has no attribute 'rum'"):
        _ = hil.rum


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> dict[str, hil.Run]:
    folder = tmp_path_factory.mktemp("runs")
    return {
        law: hil.run("scenario-1", law, 4, out=folder / law, robot__mass_kg=3.0, **POSE)
        for law in ("pid", "asg-ism")
    }


def test_run_is_the_run_of_the_command(records: dict[str, hil.Run], tmp_path: Path) -> None:
    """The same scenario, law, seed and values give the same rows, to the bit."""
    done = hil_command(
        "run", "scenario-1", "--outer", "pid", "--seed", 4, "--camera", "pose", "--out",
        tmp_path / "run", "--set", "duration_s=1.0", "--set", "robot.mass_kg=3.0",
    )  # fmt: skip
    assert done.status == 1  # a second is too short for the point
    record = read_run(tmp_path / "run")
    for name, column in records["pid"].samples.items():
        assert column.tobytes() == record.samples[name].tobytes(), name
    assert records["pid"].manifest.scenario["robot"]["mass_kg"] == 3.0


def test_run_in_memory_leaves_no_files(
    records: dict[str, hil.Run], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rows are those of a run with a record; nothing appears in the folder."""
    monkeypatch.chdir(tmp_path)
    run = hil.run("scenario-1", "pid", 4, in_memory=True, robot__mass_kg=3.0, **POSE)
    assert run.path is None
    assert run.samples["est_x_m"].tobytes() == records["pid"].samples["est_x_m"].tobytes()
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(hil.BadInput, match="kept in memory"):
        hil.replay(run)
    with pytest.raises(hil.BadInput, match="in_memory keeps no files"):
        hil.run("scenario-1", in_memory=True, out=tmp_path / "run")


def test_scenario_object_and_dotted_names() -> None:
    """A scenario may be prepared once; a dotted name may be written as it is."""
    scenario = hil.load_scenario("scenario-2", **{"link.loss_ratio": 0.1}, start__x_m=0.5)
    assert isinstance(scenario, hil.Scenario)
    assert (scenario.link.loss_ratio, scenario.start.x_m) == (0.1, 0.5)
    changed = hil.load_scenario(scenario, duration_s=np.float64(2.5))
    assert (changed.duration_s, changed.start.x_m) == (2.5, 0.5)


def test_values_that_are_tables_or_any_text() -> None:
    """What --set takes as TOML is given as Python: lists of tables, NumPy's numbers, any character."""
    pushes = [{"target": "force_left_n", "shape": "step", "amplitude": np.int64(2), "end_s": None}]
    scenario = hil.load_scenario(
        "scenario-1",
        disturbances=pushes,
        reference={"kind": "circle", "radius_m": 0.4},
        requirements=(),
        name="robot \U0001f916",
        description='a "quoted" \\ text \x7f',
    )
    (push,) = scenario.disturbances
    assert (push.target, push.amplitude, push.end_s) == ("force_left_n", 2.0, None)
    assert scenario.reference.kind == "circle"
    assert scenario.requirements == ()
    assert scenario.name == "robot \U0001f916"
    assert scenario.description == 'a "quoted" \\ text \x7f'
    with pytest.raises(hil.BadInput, match=r"duration_s = nan s: input should be a finite"):
        hil.load_scenario("scenario-1", duration_s=float("nan"))


def test_tables_have_units_and_no_values_where_there_are_none(records: dict[str, hil.Run]) -> None:
    """An Arrow table has the columns of the record with unit and meaning."""
    run = records["pid"]
    table = run.table()
    assert table.num_rows == run.samples["t_s"].size == 31
    assert table.schema.field("est_x_m").metadata[b"unit"] == b"m"
    assert (
        table.column("sigma_x_m_s2" if "sigma_x_m_s2" in run.samples else "eps_m_s2").null_count
        == 31
    )
    assert table.column("est_x_m").to_numpy().tobytes() == run.samples["est_x_m"].tobytes()
    assert run.frames_table().num_rows == run.frames["t_cam_s"].size > 30


def test_to_pandas_where_there_is_no_pandas(
    records: dict[str, hil.Run], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pandas is not needed, and its absence is told in one line."""
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(hil.BadInput, match="pandas is not installed"):
        records["pid"].to_pandas()


def test_notebook_shows_the_report(records: dict[str, hil.Run], tmp_path: Path) -> None:
    """A run, and a comparison, show their report in a frame of its own."""
    comparison = hil.compare(records["pid"], records["asg-ism"].path)
    shown = records["pid"]._repr_html_()
    assert shown.startswith('<iframe srcdoc="&lt;!doctype html')
    assert shown.count("<") == 2  # the frame alone: the page in it is quoted
    assert str(records["pid"].path) in shown
    page = comparison.report(tmp_path / "both.html").read_text("utf-8")
    assert all(str(run.path) in page for run in records.values())
    assert comparison.holds is False
    assert len(comparison.to_json()["runs"]) == 2


def test_open_record_and_replay(records: dict[str, hil.Run]) -> None:
    """A record reads back as it was made, replays to the bit, and takes a shadow."""
    run = hil.open_record(str(records["asg-ism"].path))
    assert run.figures["iae_m_s"] == records["asg-ism"].figures["iae_m_s"]
    assert run.problems == ()
    assert repr(run) == (
        "<Run scenario-1 on twin, asg-ism over asg-ism, seed 4: complete, does not hold>"
    )
    assert hil.replay(run).identical
    shadow = hil.replay(run, "pid")
    assert (shadow.kind, shadow.law, shadow.identical) == ("shadow", "pid", False)
    with pytest.raises(hil.BadInput, match="no such folder"):
        hil.open_record("nowhere")


def test_experiment_in_this_process_and_taken_up(tmp_path: Path) -> None:
    """Every scenario with every law; a second call with the same folder makes no run anew."""
    kwargs = {"out": tmp_path / "both", "workers": 1, "circle": False, **POSE}
    first = hil.experiment(["scenario-1", "scenario-2"], ["pid"], 7, **kwargs)
    assert [run.manifest.scenario_name for run in first.runs] == ["scenario-1", "scenario-2"]
    assert {run.manifest.seed for run in first.runs} == {7}
    assert first.report_path.is_file()
    assert "scenario-2" in first._repr_html_()
    before = [run.manifest.start_unix_us for run in first.runs]
    again = hil.experiment(["scenario-1", "scenario-2"], ["pid"], 7, **kwargs)
    assert [run.manifest.start_unix_us for run in again.runs] == before


@hil.outer_law("decorated-here")
class Here:
    """Drives straight on."""

    def __init__(self, gains: object, limits: object, d0_m: float) -> None:
        self.args = (gains, limits, d0_m)

    def reset(self, reference: hil.ReferenceState, estimate: hil.Estimate) -> None:
        """Keep nothing."""

    def step(
        self,
        reference: hil.ReferenceState,  # noqa: ARG002
        estimate: hil.Estimate,
        dt_s: float,  # noqa: ARG002
    ) -> hil.OuterCommand:
        """Return the same each time, beyond the limits from 0.5 s on."""
        return hil.OuterCommand(0.1 if estimate.eta1_m_s < 0.05 else 100.0, 0.0, {})


def test_class_of_a_script_is_a_law_that_is_watched() -> None:
    """A decorated class can be named itself, is recorded as from outside, and is guarded."""
    run = hil.run("scenario-1", Here, in_memory=True, **POSE)
    (plugin,) = run.manifest.plugins
    assert (plugin.name, plugin.origin) == ("decorated-here", f"module {__name__}")
    assert run.outcome == "fault"
    assert "step asked for eta1_m_s = 100 m/s, the limit is 0.5 m/s" in run.detail
    assert run.holds is False


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: hil.run("scenario-9"), "no such file and no built-in scenario"),
        (lambda: hil.run("scenario-1", "pidd"), "near: pid"),
        (lambda: hil.run("scenario-1", int), "decorate it: @hil.outer_law"),
        (lambda: hil.run("scenario-1", seed=-1), "seed = -1: must be a whole number from 0"),
        (lambda: hil.run("scenario-1", seed="3"), "seed = '3': must be a whole number"),
        (lambda: hil.run("scenario-1", seed=2.5), "seed = 2.5: must be a whole number"),
        (lambda: hil.run("scenario-1", seed=True), "seed = True: must be a whole number"),
        (lambda: hil.run("scenario-1", camera=0), "camera '0': a simulated robot is seen"),
        (lambda: hil.run("scenario-1", camera=Path("x.avi")), "camera 'x.avi'"),
        (lambda: hil.run("scenario-1", camera=1.5), "camera = 1.5"),
        (lambda: hil.run("scenario-1", duration_s=float("nan")), "duration_s = nan s"),
        (lambda: hil.run("scenario-1", Path("no_law.py")), "no_law.py cannot be read"),
        (lambda: hil.run("scenario-1", control__estimator=Path("no.py")), "no.py cannot be read"),
        (lambda: hil.run("scenario-1", inner="lqr"), "the board has none of this name"),
        (lambda: hil.run("scenario-1", on="moon"), "target 'moon': unknown"),
        (lambda: hil.run("scenario-1", robot__mas_kg=3), "near: robot.mass_kg"),
        (lambda: hil.run("scenario-1", robot__mass_kg=-1), "greater than"),
        (lambda: hil.run("scenario-1", robot__mass_kg=None), "a number, text"),
        (lambda: hil.compare("nowhere"), "no such folder"),
        (lambda: hil.experiment("thesis", repeats=0), "at least 1"),
        (lambda: hil.experiment(["scenario-1"], ["lqr"]), "outer law 'lqr'"),
    ],
)
def test_wrong_input_is_one_line_and_leaves_nothing(
    call: object, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """BadInput says what is wrong before a folder is made."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(hil.BadInput, match=re.escape(said)) as told:
        call()
    assert "\n" not in str(told.value)
    assert list(tmp_path.iterdir()) == []


def test_values_of_numpy_pathlib_and_dictionaries_are_those_they_stand_for(tmp_path: Path) -> None:
    """A table, an array, a tuple in a tuple, a path: the same scenario as with `--set`."""
    points = [[-0.6, -0.35], [0.0, 0.1], [0.4, -0.35]]
    task = {"kind": "waypoints", "speed_max_m_s": np.float32(0.125)}
    found = [
        hil.load_scenario("scenario-1", reference=task | {"points_m": form}).reference
        for form in (points, np.array(points), tuple(map(tuple, points)))
    ]
    assert found[0] == found[1] == found[2]
    assert (found[0].speed_max_m_s, len(found[0].points_m)) == (0.125, 3)
    law, _ = write_template("law", "own-by-path", tmp_path, None)
    laws = {
        hil.run("scenario-1", law, np.int64(3), in_memory=True, **POSE).manifest.outer,
        hil.run("scenario-1", str(law), 3.0, in_memory=True, **POSE).manifest.outer,
    }
    assert laws == {"own-by-path"}


def test_one_law_is_a_list_of_one(tmp_path: Path) -> None:
    """`laws="pid"` is not the laws p, i and d."""
    made = hil.experiment(
        ["scenario-1"], "pid", out=tmp_path / "e", workers=1, circle=False, **POSE
    )
    assert [run.manifest.outer for run in made.runs] == ["pid"]


def test_what_is_read_from_a_run_cannot_be_written_to() -> None:
    """Millimetres made in place would be in the report too."""
    run = hil.run("scenario-1", in_memory=True, **POSE)
    with pytest.raises(ValueError, match="read-only"):
        run.samples["est_x_m"][:] *= 1e3
    with pytest.raises(ValueError, match="read-only"):
        run.frames["x_m"][0] = 1.0
    assert abs(run.table().column("est_x_m")[0].as_py()) < 1.0


@hil.outer_law("interrupts")
class Interrupts:
    """Presses Ctrl-C at its tenth step."""

    def __init__(self, gains: object, limits: object, d0_m: float) -> None:
        self.args = (gains, limits, d0_m)
        self.steps = 0

    def reset(self, reference: hil.ReferenceState, estimate: hil.Estimate) -> None:
        """Keep nothing."""

    def step(self, *_given: object) -> hil.OuterCommand:
        """Return rest."""
        self.steps += 1
        if self.steps == 10:
            signal.raise_signal(signal.SIGINT)
        return hil.OuterCommand(0.0, 0.0, {})


def test_ctrl_c_ends_a_loop_over_runs_and_closes_the_record(tmp_path: Path) -> None:
    """The robot is stopped, the record whole, and whoever runs many is told to stop too."""
    with pytest.raises(KeyboardInterrupt):
        hil.run("scenario-1", Interrupts, out=tmp_path / "run", **POSE)
    run = hil.open_record(tmp_path / "run")
    assert (run.outcome, run.detail, run.problems) == ("interrupted", "Ctrl-C", ())
    assert 10 <= run.samples["t_s"].size <= 11
    assert [event.kind for event in run.events][-2:] == ["stopped", "interrupted"]
