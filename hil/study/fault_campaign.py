"""The whole matrix and the fault-free runs on every core; what is done is kept and not done again."""

from __future__ import annotations

import itertools
import json
import math
import multiprocessing
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from hil.core.errors import BadInput
from hil.core.registry import in_one_line
from hil.study.fault_free import MOST_RATIO, fault_free, most_ratio
from hil.study.fault_matrix import Cell, cells, run_cell

CELLS, FAULT_FREE = "cells.jsonl", "fault_free.jsonl"
ERROR = "error"  # outcome of a cell that is done again by the next call
Key = tuple[str, str, str]


def run_matrix(
    keys: Sequence[Key], seed: int, folder: Path, progress: Callable[[int, int], None]
) -> list[dict[str, Any]]:
    """Return the cells in the order of their keys; each is appended to the folder once it is done.

    The same call goes on where an earlier one was stopped. Raises BadInput for another file there.
    """
    path = folder / CELLS
    done = _done(path, seed)
    wanted = [key for key in keys if key not in done]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = path.open("a", encoding="utf-8")
    except OSError as error:
        raise BadInput(f"--out {folder}: cannot be written: {error.strerror}") from None
    with file:
        for cell in _each(_cell, [(*key, seed) for key in wanted]):
            tree = cell.to_json()
            file.write(json.dumps(tree | {"seed": seed}) + "\n")
            file.flush()
            done[(cell.fault, cell.instant, cell.law)] = tree
            progress(len(done), len(keys))
    return [done[key] for key in keys]


def finished(folder: Path, seed: int) -> list[Key]:
    """Return the cells of the matrix that a folder has, in their order."""
    done = _done(folder / CELLS, seed)
    return [key for key in cells() if key in done]


def finished_free(folder: Path, seed: int) -> list[int]:
    """Return the seeds of the runs without a fault that a folder has, from `seed` on without a gap."""
    done = {int(tree["seed"]) for tree in _lines(folder / FAULT_FREE, ("seed", "said"))}
    return list(itertools.takewhile(done.__contains__, itertools.count(seed)))


def run_fault_free(
    count: int, seed: int, folder: Path, progress: Callable[[int, int], None]
) -> dict[str, Any]:
    """Return how many of so many runs without a fault were stopped or diagnosed, and which.

    Each is appended to the folder once it is done, and not done again by the next call.
    """
    seeds = range(seed, seed + count)
    path = folder / FAULT_FREE
    done = {int(tree["seed"]): str(tree["said"]) for tree in _lines(path, ("seed", "said"))}
    folder.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        for number, said in _each(fault_free, [one for one in seeds if one not in done]):
            file.write(json.dumps({"seed": number, "said": said}) + "\n")
            file.flush()
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


def _cell(key: tuple[str, str, str, int]) -> Cell:
    """Run one cell; one that ends in an error of the harness is not met, and the others go on."""
    try:
        return run_cell(*key)
    except Exception as error:
        said = in_one_line(error)
        fault, instant, law, _ = key
        return Cell(fault, instant, law, ERROR, said, 0.0, 0.0, 0.0, math.nan, (f"error: {said}",))


def _each(work: Callable[[Any], Any], items: Iterable[Any]) -> Iterable[Any]:
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(mp_context=context)
    try:
        for future in as_completed([pool.submit(work, item) for item in items]):
            yield future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _done(path: Path, seed: int) -> dict[Key, dict[str, Any]]:
    """Return the cells of an earlier call of this seed."""
    found: dict[Key, dict[str, Any]] = {}
    for tree in _lines(path, ("seed", "fault", "instant", "law")):
        if tree.pop("seed") == seed and tree.get("outcome") != ERROR:
            found[(tree["fault"], tree["instant"], tree["law"])] = tree
    return found


def _lines(path: Path, keys: Sequence[str]) -> list[dict[str, Any]]:
    """Return the whole lines of an earlier call; a torn last one is left."""
    found: list[dict[str, Any]] = []
    if not path.exists():
        return found
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        try:
            tree = json.loads(line)
            if not all(key in tree for key in keys):
                break
        except (ValueError, TypeError):
            break
        found.append(tree)
    return found
