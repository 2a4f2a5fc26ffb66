"""Records that were damaged or edited by hand: what is whole is used, the rest is one line."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path

import pytest

from tests.studies.commands import hil


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a run of each law, 1 s long, and a log of 0.5 s."""
    folder = tmp_path_factory.mktemp("runs")
    for name, law in (("a", "asg-ism"), ("b", "pid")):
        hil(folder, "run", "scenario-1", "--camera", "pose", "--outer", law, "--out", name,
            "--set", "duration_s=1", "--set", "requirements=[]")  # fmt: skip
    rows = [f"{0.05 * n:.2f},{-0.6 + 0.01 * n:.2f},-0.35,0.5" for n in range(11)]
    (folder / "log.csv").write_text("\n".join(["t,x,y,theta", *rows]), encoding="utf-8")
    (folder / "map.toml").write_text(
        'outer = "pid"\nset = ["duration_s=1", "requirements=[]"]\nt = { column = "t" }\n[columns]\n'
        'est_x_m = { column = "x" }\nest_y_m = { column = "y" }\n'
        'est_theta_rad = { column = "theta" }\n',
        encoding="utf-8",
    )
    hil(folder, "import", "log.csv", "--map", "map.toml", "--out", "short")
    return folder


def edited(runs: Path, folder: Path, keys: tuple[str, ...], value: object) -> Path:
    shutil.copytree(runs / "b", folder / "m")
    path = folder / "m/manifest.json"
    tree = json.loads(path.read_bytes())
    node = tree
    for key in keys[:-1]:
        node = node[key]
    node[keys[-1]] = value
    path.write_text(json.dumps(tree), encoding="utf-8")
    return folder / "m"


@pytest.mark.parametrize(
    ("keys", "value", "said"),
    [
        (("scenario", "duration_s"), "abc", "duration_s = 'abc'"),
        (("scenario", "requirements"), "none", "requirements"),
        (("scenario", "requirements"), [5], "requirements"),
        (("scenario", "requirements"), [{"max": 1}], "requirements"),
        (("scenario", "requirements"), [{"metric": "ise_m2_s", "max": "x"}], "requirements"),
        (("link", "frames_lost"), math.nan, "link.frames_lost"),
        (("link", "frames_lost"), math.inf, "link.frames_lost"),
    ],
)
def test_manifest_edited_by_hand_is_one_line(
    runs: Path, tmp_path: Path, keys: tuple[str, ...], value: object, said: str
) -> None:
    """Every command that reads it names file and key."""
    path = edited(runs, tmp_path, keys, value)
    for words in (("replay", str(path)), ("compare", str(runs / "a"), str(path))):
        ended = hil(tmp_path, *words)
        assert ended.returncode == 2
        assert ended.stderr.count("\n") == 1
        assert "m/manifest.json: damaged: " in ended.stderr
        assert said in ended.stderr


def test_lost_frames_cost_the_frames_only(runs: Path, tmp_path: Path) -> None:
    """The samples are whole: compare uses them; a replay is the same up to the first frame."""
    shutil.copytree(runs / "a", tmp_path / "a")
    frames = tmp_path / "a/frames.parquet"
    frames.write_bytes(frames.read_bytes()[:100])
    ended = hil(tmp_path, "compare", str(runs / "b"), "a", "--json")
    assert ended.returncode == 0, ended.stderr
    assert "frames.parquet: damaged" in " ".join(json.loads(ended.stdout)["warnings"])
    ended = hil(tmp_path, "replay", "a", "--json")
    told = json.loads(ended.stdout)
    assert (told["identical"], told["ticks_replayed"], ended.returncode) == (True, 0, 0)
    assert any("frames.parquet: damaged" in line for line in told["problems"])


def test_runs_of_other_length_are_told(runs: Path) -> None:
    """Half the time makes half the error: said, and only where it is so."""
    told = json.loads(hil(runs, "compare", "a", "short", "--json").stdout)["warnings"]
    assert any("covers 0.5 s against 1 s" in line for line in told)
    told = json.loads(hil(runs, "compare", "a", "b", "--json").stdout)["warnings"]
    assert not any("covers" in line for line in told)


def test_change_without_effect_is_no_difference(runs: Path) -> None:
    """A gain of the other wheel law: the shadow is as far off as the recorded law itself, there."""
    plain = json.loads(hil(runs, "replay", "a", "--firmware", "--json").stdout)["firmware"]
    words = ("replay", "a", "--set", "board.PID_KP=0.5", "--json")
    shadow = json.loads(hil(runs, *words).stdout)["firmware"]
    assert shadow["shadow"]
    assert shadow["phase_us"] == plain["phase_us"]
    assert plain["recorded_law_apart"] is None
    for place, side in enumerate(("left", "right")):
        assert shadow[side] == plain[side]
        assert shadow["recorded_law_apart"][place] == plain[side]["rms_difference"]


def test_a_law_is_not_compared_with_itself(runs: Path) -> None:
    """Refused before the fit: its differences would all be zero."""
    words = ("replay", "a", "--fit", "--outer", "asg-ism")
    ended = hil(runs, *words)
    assert ended.returncode == 2
    assert "is the recorded law itself" in ended.stderr
