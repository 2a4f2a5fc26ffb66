"""The project's own speed figures on this machine: medians of several runs, never a test."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hil import __version__
from hil.analysis.speed import Figure, Plan, measure
from hil.config.link import UART_BAUD
from hil.config.load import load_scenario
from hil.record.manifest import collect_versions, git_revision
from hil.rigs.opening import open_rig
from hil.runs.execute import RunSpec, execute
from sim_twin.pil import pil_is_missing

_SCENARIO = "scenario-1"
FORMAT = "hil-bench-1"


def real_time_factor(camera: str, *, target: str = "twin", record: bool = True) -> float:
    """Return simulated seconds per wall second of one whole run, record included.

    The simulated time is all that passed on the rig: connecting, the controlled part, stopping.
    """
    scenario = load_scenario(_SCENARIO)
    with tempfile.TemporaryDirectory() as folder:
        spec = RunSpec(
            scenario=scenario,
            target=target,
            camera=camera,
            outer="asg-ism",
            inner="asg-ism",
            seed=1,
            out=Path(folder) / "run",
            rerun=record,
            command="hil bench",
        )
        start_s = time.perf_counter()
        rig = open_rig(spec.target, scenario, spec.camera, spec.seed)
        begin_s = rig.now_s()
        execute(spec, rig=rig)
        return (rig.now_s() - begin_s) / (time.perf_counter() - start_s)


def kernel_step_us() -> float:
    """Return microseconds of wall time per 1e-4 s step of plant, firmware and encoders."""
    from random import Random  # noqa: PLC0415 - only for this figure

    from sim_twin.setup import STEP_US, make_kernel  # noqa: PLC0415

    kernel = make_kernel(load_scenario(_SCENARIO).robot, UART_BAUD, Random(1))
    steps = 50_000
    start_s = time.perf_counter()
    end_us = steps * STEP_US
    while kernel.advance(end_us) < end_us:
        kernel.take_sent()
    return (time.perf_counter() - start_s) / steps * 1e6


def help_s() -> float:
    """Return the wall time of `hil --help` as a process of its own."""
    start_s = time.perf_counter()
    subprocess.run([sys.executable, "-m", "hil", "--help"], check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start_s


def figures(runs: int) -> list[Figure]:
    """Return every figure; some tens of seconds in all. `pil` is left out where it cannot run."""
    plans: list[Plan] = [
        ("whole loop, rendered camera", "x real time", ">= 10",
         lambda: real_time_factor("rendered")),
        ("whole loop, --camera pose", "x real time", ">= 100",
         lambda: real_time_factor("pose", record=False)),
        ("whole loop, --camera pose, with Rerun file", "x real time", "",
         lambda: real_time_factor("pose")),
        ("whole loop on pil, rendered camera", "x real time", ">= 2",
         lambda: real_time_factor("rendered", target="pil")),
        ("twin and firmware, one step of 1e-4 s", "us", "<= 0.4", kernel_step_us),
        ("hil --help", "s", "< 0.3", help_s),
    ]  # fmt: skip
    if pil_is_missing():
        plans = [plan for plan in plans if "on pil" not in plan[0]]
    return [measure(name, unit, goal, runs, once) for name, unit, goal, once in plans]


def as_document(what: str, found: list[Figure]) -> dict[str, Any]:
    """Return what `hil bench --json` prints: the figures, and what they were measured on."""
    return {
        "format": FORMAT,
        "what": what,
        "program": f"skid-steer-hil {__version__} {git_revision()}".strip(),
        "time_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": {
            "processor": _processor(),
            "cores": os.cpu_count(),
            "versions": collect_versions(),
        },
        "figures": [asdict(figure) for figure in found],
    }


def _processor() -> str:
    """Return the processor's name as the system gives it."""
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
