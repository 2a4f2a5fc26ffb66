"""The whole matrix and the fault-free runs on every core; what is done is kept and not done again."""

from __future__ import annotations

import json
import multiprocessing
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from hil.core.errors import BadInput
from hil.study.fault_matrix import Cell, fault_free, run_cell

CELLS = "cells.jsonl"
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


def run_fault_free(count: int, seed: int, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """Return how many of so many runs without a fault were stopped or diagnosed, and which."""
    said = []
    for number, text in enumerate(_each(fault_free, range(seed, seed + count)), start=1):
        progress(number, count)
        if text:
            said.append(text)
    return {"runs": count, "alarms": len(said), "said": sorted(said)}


def _cell(key: tuple[str, str, str, int]) -> Cell:
    return run_cell(*key)


def _each(work: Callable[[Any], Any], items: Iterable[Any]) -> Iterable[Any]:
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(mp_context=context)
    try:
        for future in as_completed([pool.submit(work, item) for item in items]):
            yield future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _done(path: Path, seed: int) -> dict[Key, dict[str, Any]]:
    """Return the whole lines of an earlier call of this seed; a torn last one is left."""
    found: dict[Key, dict[str, Any]] = {}
    if not path.exists():
        return found
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        try:
            tree = json.loads(line)
            if tree.pop("seed") == seed:
                found[(tree["fault"], tree["instant"], tree["law"])] = tree
        except (ValueError, KeyError, TypeError, AttributeError):
            break
    return found
