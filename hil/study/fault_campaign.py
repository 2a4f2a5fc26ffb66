"""The whole matrix and the fault-free runs on every core; what is done is kept and not done again."""

from __future__ import annotations

import itertools
import json
import math
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from hil.core.errors import BadInput
from hil.core.files import replace_file, unwritable
from hil.core.registry import in_one_line
from hil.study.campaign.workers import in_processes
from hil.study.fault_free import MOST_RATIO, fault_free, most_ratio
from hil.study.fault_matrix import Cell, cells, run_cell
from hil.study.work_folder import LOCK, sole_writer

CELLS, FAULT_FREE = "cells.jsonl", "fault_free.jsonl"
ERROR = "error"  # outcome of a cell that is done again by the next call
Key = tuple[str, str, str]
_CELL_KEYS, _FREE_KEYS = ("seed", "fault", "instant", "law"), ("seed", "said")


def run_matrix(
    keys: Sequence[Key], seed: int, folder: Path, progress: Callable[[int, int], None]
) -> list[dict[str, Any]]:
    """Return the cells in the order of their keys; each is appended to the folder once it is done.

    The same call goes on where an earlier one was stopped. Raises BadInput for a folder that cannot be
    written to, or that another process has.
    """
    with _writing(folder), tempfile.TemporaryDirectory() as scratch:
        done = _done(folder / CELLS, seed)
        with _appending(folder / CELLS, _CELL_KEYS) as file:
            jobs = [(*key, seed, scratch) for key in keys if key not in done]
            for cell in _each(_cell, jobs, _lost_cell):
                tree = cell.to_json()
                _append(file, tree | {"seed": seed})
                done[(cell.fault, cell.instant, cell.law)] = tree
                progress(len(done), len(keys))
    return [done[key] for key in keys]


def finished(folder: Path, seed: int) -> list[Key]:
    """Return the cells of the matrix that a folder has, in their order."""
    done = _done(folder / CELLS, seed)
    return [key for key in cells() if key in done]


def finished_free(folder: Path, seed: int) -> list[int]:
    """Return the seeds of the runs without a fault that a folder has, from `seed` on without a gap."""
    done = {int(tree["seed"]) for tree in _lines(folder / FAULT_FREE, _FREE_KEYS)}
    return list(itertools.takewhile(done.__contains__, itertools.count(seed)))


def run_fault_free(
    count: int, seed: int, folder: Path, progress: Callable[[int, int], None]
) -> dict[str, Any]:
    """Return how many of so many runs without a fault were stopped or diagnosed, and which.

    Each is appended to the folder once it is done, and not done again by the next call. Raises
    BadInput as `run_matrix` does.
    """
    seeds = range(seed, seed + count)
    path = folder / FAULT_FREE
    with _writing(folder):
        done = {int(tree["seed"]): str(tree["said"]) for tree in _lines(path, _FREE_KEYS)}
        with _appending(path, _FREE_KEYS) as file:
            for number, said in _each(fault_free, [one for one in seeds if one not in done]):
                _append(file, {"seed": number, "said": said})
                done[number] = said
                progress(sum(one in done for one in seeds), count)
    told = sorted(done[one] for one in seeds if done[one])
    return {
        "runs": count,
        "alarms": len(told),
        "most_ratio": most_ratio(len(told), count),
        "met": len(told) <= MOST_RATIO * count,
        "said": told,
    }


def _cell(job: tuple[str, str, str, int, str]) -> Cell:
    """Run one cell; one that ends in an error of the harness is not met, and the others go on."""
    fault, instant, law, seed, scratch = job
    try:
        return run_cell(fault, instant, law, seed, Path(scratch))
    except Exception as error:
        return _lost_cell(job, in_one_line(error))


def _lost_cell(job: tuple[str, str, str, int, str], reason: str) -> Cell:
    fault, instant, law, _, _ = job
    flaws = (f"error: {reason}",)
    return Cell(fault, instant, law, ERROR, reason, 0.0, 0.0, 0.0, math.nan, flaws)


def _each(
    work: Callable[[Any], Any],
    items: Sequence[Any],
    lost: Callable[[Any, str], Any] | None = None,
) -> Iterator[Any]:
    return in_processes(work, items, os.cpu_count() or 1, lost) if items else iter(())


@contextmanager
def _writing(folder: Path) -> Iterator[None]:
    """Hold the folder for this process; raises BadInput."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"--out {folder}: cannot be written: {error.strerror}") from None
    with sole_writer(folder / LOCK, f"--out {folder}"):
        yield


@contextmanager
def _appending(path: Path, keys: Sequence[str]) -> Iterator[IO[str]]:
    """Open a file of lines to append to; what an earlier call left torn at its end is dropped."""
    try:
        if path.exists():
            whole = _lines(path, keys)
            text = "".join(f"{json.dumps(tree)}\n" for tree in whole).encode()
            if text != path.read_bytes():
                replace_file(path, text)
        file = path.open("a", encoding="utf-8")
    except OSError as error:
        raise unwritable(str(path), error) from None
    with file:
        yield file


def _append(file: IO[str], tree: Mapping[str, Any]) -> None:
    file.write(json.dumps(tree) + "\n")
    file.flush()


def _done(path: Path, seed: int) -> dict[Key, dict[str, Any]]:
    """Return the cells of an earlier call of this seed."""
    found: dict[Key, dict[str, Any]] = {}
    for tree in _lines(path, _CELL_KEYS):
        if tree.pop("seed") == seed and tree.get("outcome") != ERROR:
            found[(tree["fault"], tree["instant"], tree["law"])] = tree
    return found


def _lines(path: Path, keys: Sequence[str]) -> list[dict[str, Any]]:
    """Return the whole lines of an earlier call; what is torn or no line of ours is left out."""
    return (
        list(_whole(path.read_text("utf-8", "replace").splitlines(), keys)) if path.exists() else []
    )


def _whole(lines: Iterable[str], keys: Sequence[str]) -> Iterator[dict[str, Any]]:
    for line in lines:
        try:
            tree = json.loads(line)
        except ValueError:
            continue
        if isinstance(tree, dict) and all(key in tree for key in keys):
            yield tree
