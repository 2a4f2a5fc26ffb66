"""Damaged files of every kind that a user can hand over: read, or refused with one line, and nothing else.

`python -m tests.ends.parsers --seconds 3600` damages good files at random and reads them; what raises
anything but the project's own errors, or takes too long, is kept with the file that did it. The file
under test lies in the folder while it is read, so that it is there after a crash too.
"""

from __future__ import annotations

import argparse
import collections
import random
import shutil
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import cv2
import numpy as np

from hil.config.deck import load_deck
from hil.config.load import load_robot, load_scenario
from hil.core.errors import HilError
from hil.record.log_import import read_log
from hil.record.log_mapping import LogMapping, read_mapping
from hil.record.reader import read_run
from hil.record.source import read_source
from hil.record.tlog import read_tlog
from hil.runs.execute import RunSpec, execute
from hil.study.campaign.plan import load_campaign
from hil.tools.board_parameters import read_file
from tests.replay.topic_logs import KINDS, rows_of, write_log
from vision.calibration.files import read_camera
from vision.calibration.points import read_pairs
from vision.cv_compat import read_image

DATA = Path(str(files("hil") / "data"))
# Reading a small file takes milliseconds; a damaged one may not take this much processor time, s.
MOST_S = 5.0
# What is put into text in place of a number or a word.
_VALUES = (
    "nan", "inf", "-1", "0", "1e400", "9" * 400, "true", '""', "[]", "{}", "[[[[[[]]]]]]", "null",
    '"../../etc/passwd"', '"\\u0000"', "\x1b[31m", "1979-05-27", "0x7fffffffffffffff", "=",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Parser:
    """One kind of file: a good one, its name, and what reads it."""

    name: str
    good: bytes
    file: str
    read: Callable[[Path], object]


@dataclass(frozen=True, slots=True)
class Flaw:
    """What a damaged file did that it must not."""

    parser: str
    seed: int
    what: str


def parsers(folder: Path) -> list[Parser]:
    """Return every kind of file; good ones come from a short run, which is made in `folder`."""
    scenario = load_scenario("scenario-1", ["duration_s=1"])
    run = folder / "run"
    execute(RunSpec(scenario, "twin", "pose", "pid", "asg-ism", 1, run, rerun=False))
    found = [
        _text("scenario", "scenarios/scenario-1.toml", lambda path: load_scenario(str(path))),
        _text("robot", "robots/thesis-4wd.toml", lambda path: load_robot(str(path))),
        _text("deck", "decks/thesis.toml", lambda path: load_deck(str(path))),
        _text("campaign", "campaigns/layer.toml", lambda path: load_campaign(str(path))),
        _text("camera", "cameras/diff-2wd.toml", read_camera),
        Parser("parameters", b"[board]\nPID_KP = 0.2\nPWM_MAX = 1.0\n", "board.toml", read_file),
        Parser("mapping", _MAPPING, "mapping.toml", read_mapping),
        Parser("points", b"x_m,y_m,u_px,v_px\n0,0,320,240\n1,0,500,240\n", "pairs.csv", read_pairs),
        Parser("log.csv", _CSV, "log.csv", _log(read_log_mapping(folder, _CSV_MAPPING))),
    ]
    for suffix in KINDS:
        log = write_log(folder, suffix, rows_of(20))
        mapping = read_mapping(log.with_suffix(".toml"))
        found.append(Parser(log.name, log.read_bytes(), log.name, _log(mapping)))
    tlog = (run / "link.tlog").read_bytes()
    found.append(Parser("log.tlog", tlog, "log.tlog", _log(_own_mapping(folder))))
    found.append(Parser("link.tlog", tlog, "link.tlog", lambda path: list(read_tlog(path))))
    for name in ("manifest.json", "samples.parquet", "frames.parquet", "events.jsonl",
                 "inputs.tape"):  # fmt: skip
        found.append(Parser(name, (run / name).read_bytes(), name, _in_record(run, name)))
    image = np.random.default_rng(1).integers(0, 255, (40, 60, 3), dtype=np.uint8)
    for form in ("png", "jpg"):
        good = cv2.imencode(f".{form}", image)[1].tobytes()
        found.append(Parser(form, good, f"image.{form}", read_image))
    return found


_MAPPING = b"""scenario = "scenario-1"
[columns.est_x_m]
message = "LOCAL_POSITION_NED"
field = "y"
scale = 1.0
offset = 0.0
"""


def _text(name: str, file: str, read: Callable[[Path], object]) -> Parser:
    path = DATA / file
    return Parser(name, path.read_bytes(), path.name, read)


_CSV_MAPPING = """[columns]
est_x_m = { column = "X_mm", scale = 0.001 }
est_y_m = { column = "Y_mm", scale = 0.001 }
est_theta_rad = { column = "heading_rad" }
[t]
column = "time_s"
"""
_CSV = b"time_s,X_mm,Y_mm,heading_rad,remark\n" + b"".join(
    b"%.2f,%d,100,0.1,ok\n" % (0.05 * k, -500 + 12 * k) for k in range(40)
)


def read_log_mapping(folder: Path, text: str) -> LogMapping:
    """Return a mapping as its file gives it."""
    path = folder / "map.toml"
    path.write_text(text)
    return read_mapping(path)


def _own_mapping(folder: Path) -> LogMapping:
    """Return a mapping for the link's own messages, which have no pose: the wheels stand for it."""
    lines = [
        f'{name} = {{ message = "WHEEL_STATE", field = "{field}" }}'
        for name, field in (
            ("est_x_m", "omega_left_rad_s"),
            ("est_y_m", "omega_right_rad_s"),
            ("est_theta_rad", "left_counts"),
        )
    ]
    return read_log_mapping(folder, "\n".join(["[columns]", *lines]) + "\n")


def _log(settings: LogMapping) -> Callable[[Path], object]:
    return lambda path: read_log(path, settings)


def _in_record(run: Path, name: str) -> Callable[[Path], object]:
    """Return what reads a record in which one file is the damaged one."""

    def read(path: Path) -> object:
        record = path.parent / "record"
        if not record.exists():
            shutil.copytree(run, record)
        shutil.copyfile(path, record / name)
        try:
            whole = read_run(record)
            return whole.figures(), whole.verdicts(), read_source(record)
        finally:
            shutil.copyfile(run / name, record / name)

    return read


def damaged(good: bytes, rng: random.Random) -> bytes:
    """Return a file with one to four things wrong in it."""
    data = bytearray(good)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(data) + 1)
        size = min(int(2 ** rng.uniform(0, 10)), len(data) - at)
        match rng.randrange(8):
            case 0 if data:
                data[at % len(data)] ^= 1 << rng.randrange(8)
            case 1:
                data[at : at + size] = rng.randbytes(size)
            case 2:
                del data[at : at + size]
            case 3:
                data[at:at] = data[at : at + size]
            case 4 if rng.random() < 0.3:
                del data[at:]
            case 5:
                other = rng.randrange(len(data) + 1)
                data[at : at + size] = data[other : other + size]
            case _:
                _replace_word(data, at, rng)
    return bytes(data)


def _replace_word(data: bytearray, at: int, rng: random.Random) -> None:
    """Put another value where a word or a number begins."""
    stops = b" \t\r\n,=[]{}:"
    while at < len(data) and data[at] in stops:
        at += 1
    end = at
    while end < len(data) and data[end] not in stops and end - at < 40:
        end += 1
    data[at:end] = rng.choice(_VALUES).encode()


def try_one(parser: Parser, seed: int, folder: Path) -> Flaw | None:
    """Damage a good file, read it, and return what was wrong with that."""
    rng = random.Random(f"{parser.name} {seed}")
    path = folder / parser.file
    path.write_bytes(damaged(parser.good, rng))
    what = ""
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)  # NumPy's: a figure was made of nothing
        try:
            parser.read(path)
        except HilError as error:  # shown by `hil.core.text.visible`
            what = "" if str(error).strip() else "refused without a word"
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                raise
            what = "".join(traceback.format_exception(error)[-3:])
    return Flaw(parser.name, seed, what) if what else None


def main(say: Callable[[str], None] = print) -> int:
    """Damage and read files for so long; return 1 when one did what it must not."""
    options = argparse.ArgumentParser(description=main.__doc__)
    options.add_argument("--seconds", type=float, default=3600.0)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--only", help="one kind of file")
    options.add_argument("--keep", type=Path, default=Path("runs/parsers"), metavar="DIR")
    asked = options.parse_args()
    tally: collections.Counter[str] = collections.Counter()
    flaws: dict[str, Flaw] = {}
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        kinds = [one for one in parsers(folder) if asked.only in {None, one.name}]
        end_s, seed = time.monotonic() + asked.seconds, asked.seed
        while time.monotonic() < end_s:
            for parser in kinds:
                tally[parser.name] += 1
                began_s = time.process_time()
                flaw = try_one(parser, seed, folder)
                took_s = time.process_time() - began_s
                if flaw is None and took_s > MOST_S:
                    flaw = Flaw(parser.name, seed, f"took {took_s:.1f} s (limit {MOST_S:g} s)")
                if flaw is not None and flaw.what[-200:] not in flaws:
                    flaws[flaw.what[-200:]] = flaw
                    asked.keep.mkdir(parents=True, exist_ok=True)
                    shutil.copyfile(folder / parser.file, asked.keep / f"{seed}-{parser.file}")
                    say(f"{flaw.parser}, seed {seed}: {flaw.what}")
            seed += 1
    for name, count in sorted(tally.items()):
        say(f"{count:8d}  {name}")
    say(f"{sum(tally.values())} files read or refused, {len(flaws)} kinds of flaw")
    return 1 if flaws else 0


if __name__ == "__main__":
    sys.exit(main())
