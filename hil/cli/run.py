"""`hil run`: one scenario, one target, one record."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hil.cli.ci import junit_file, junit_option, tell_ci
from hil.cli.options import (
    camera_option,
    figure_option,
    inner_option,
    json_option,
    key_option,
    out_option,
    outer_option,
    print_json,
    seed_option,
    set_option,
    target_option,
    tell,
    with_figures,
)
from hil.cli.progress import run_progress
from hil.core.text import visible

if TYPE_CHECKING:
    from hil.record.beside import ViewerFile
    from hil.record.reader import RunRecord
    from hil.runs.parts import Publish


@click.command("run")
@click.argument("scenario")
@target_option
@outer_option
@inner_option
@camera_option
@seed_option
@set_option
@figure_option
@out_option
@key_option
@click.option("--record-camera", is_flag=True,
              help="Keep every frame in camera.mkv, lossless: 17 MB a second at 640 x 480.")  # fmt: skip
@click.option("--record-camera-small", "small_video", is_flag=True,
              help="Keep every frame in camera-small.avi, as JPEG: 2.7 MB a second; a replay "
              "takes the measured poses instead.")  # fmt: skip
@click.option(
    "--bridge", is_flag=False, flag_value="127.0.0.1:14550", metavar="[HOST:PORT]",
    help="Show the robot to ground stations over UDP.  [without a value: 127.0.0.1:14550]",
)  # fmt: skip
@click.option("--view", is_flag=True, help="Open the record in the viewer afterwards.")
@junit_option
@json_option
def command(
    scenario: str,
    target: str,
    outer: str | None,
    inner: str,
    camera: str | None,
    seed: int,
    overrides: tuple[str, ...],
    own_figures: tuple[str, ...],
    out: Path | None,
    key_file: Path | None,
    record_camera: bool,
    small_video: bool,
    bridge: str | None,
    view: bool,
    junit: Path | None,
    as_json: bool,
) -> int:
    """Run SCENARIO (a built-in name or a TOML file) and record it.

    Built in: scenario-1, scenario-2, scenario-3 (the three experiments) and circle (section 8.9).
    """
    if record_camera and small_video:
        raise click.UsageError("--record-camera and --record-camera-small: choose one")
    with _viewer_file(target) as viewer:
        from hil.config.load import load_scenario
        from hil.core.registries import OUTER_LAWS
        from hil.record.manifest import command_line
        from hil.rigs.key_file import read_key
        from hil.runs.execute import RunSpec, camera_for, execute, exit_status, new_folder

        law = OUTER_LAWS.get(outer) if outer else None
        resolved = load_scenario(scenario, with_figures(overrides, own_figures))
        law = law or OUTER_LAWS.get(resolved.control.outer)
        spec = RunSpec(
            scenario=resolved,
            target=target,
            camera=camera_for(resolved, target, camera),
            outer=law.name,
            inner=inner,
            seed=seed,
            out=out or new_folder(f"{resolved.name}-{law.name}"),
            record_camera=record_camera,
            small_video=small_video,
            command=command_line(),
            key=read_key(key_file) if key_file else None,
        )
        with (
            junit_file(junit, f"{resolved.name}.{law.name}"),
            run_progress({resolved.name: resolved.duration_s}) as update,
            _ground_stations(bridge) as publish,
        ):
            record = execute(
                spec, lambda t_s: update(resolved.name, t_s), publish=publish, viewer=viewer
            )
    tell_ci([record], f"hil run {resolved.name}", junit=junit)
    if as_json:
        print_json(summary(record))
    else:
        print_summary(record)
    if view:
        from hil.record.viewer import open_viewer

        click.echo(visible(open_viewer([record.path])), err=True)
    return exit_status(record)


def _viewer_file(target: str) -> AbstractContextManager[ViewerFile | None]:
    """Give the process beside the run; once it is entered, that and the command load side by side."""
    from hil.record.beside import ViewerFile
    from hil.rigs.opening import is_simulated

    return ViewerFile() if is_simulated(target) else nullcontext()


@contextmanager
def _ground_stations(address: str | None) -> Iterator[Publish | None]:
    """Give what publishes to ground stations, None when nobody asked for it."""
    if address is None:
        yield None
        return
    from hil.tools.bridge import UdpBridge

    bridge = UdpBridge(address)
    try:
        yield bridge.publish
    finally:
        bridge.close()


def summary(record: RunRecord) -> dict[str, Any]:
    """Return what `--json` says of one run."""
    manifest = record.manifest
    return {
        "record": str(record.path),
        "scenario": manifest.scenario_name,
        "target": manifest.target,
        "outer": manifest.outer,
        "inner": manifest.inner,
        "seed": manifest.seed,
        "outcome": manifest.outcome,
        "detail": manifest.outcome_detail,
        "notes": list(manifest.notes),
        "requirements": [
            {"text": item.text(), "value": _finite(item.value), "holds": item.holds}
            for item in record.verdicts()
        ],
        "diagnoses": record.diagnoses(),
        **record.figures().to_json(),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def print_summary(record: RunRecord) -> None:
    """Write outcome, requirements and the place of the record to stdout."""
    manifest = record.manifest
    line = (
        f"{manifest.scenario_name} on {manifest.target}, outer {manifest.outer}, "
        f"inner {manifest.inner}, seed {manifest.seed}: {manifest.outcome}"
    )
    tell(visible(line + said(manifest.outcome_detail)))
    for item in record.verdicts():
        mark = click.style("holds", "green") if item.holds else click.style("FAILS", "red")
        is_now = f"is {item.value:.4g}" if math.isfinite(item.value) else "has no value in this run"
        tell(f"  {mark}  {item.text()}   ({is_now})")
    for note in manifest.notes:
        tell(f"{click.style('note:', 'yellow')} {visible(note)}")
    for text in record.diagnoses():
        tell(f"{click.style('diagnosis:', 'yellow')} {visible(text)}")
    tell(f"record: {visible(str(record.path))}")


def said(detail: str) -> str:
    """Return what follows an outcome: its detail, if there is one."""
    return f" - {detail}" if detail else ""
