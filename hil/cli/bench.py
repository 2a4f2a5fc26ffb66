"""`hil bench`: the speed figures of the harness, and the wheel laws on their bench."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from hil.cli.options import OutFile, json_option, print_json

if TYPE_CHECKING:
    from hil.analysis.speed import Figure


# What is measured in medians of several runs, and can be compared with another revision's.
_SPEED = ("speed", "parts", "batch", "law", "campaign", "report")


@click.command("bench")
@click.argument(
    "what",
    type=click.Choice([*_SPEED, "growth", "wheels", "vision", "firmware"]),
    default="speed",
)
@click.option("--runs", type=click.IntRange(1, 100), default=5, show_default=True,
              help="speed to report: counted runs of each figure, after one that is not counted; "
              "wheels: robots drawn from 10 % around the believed one.")  # fmt: skip
@click.option("--tune", "candidates", type=click.IntRange(11, 100_000), metavar="CANDIDATES",
              help="wheels: search the gains of all laws, that many candidates each, and judge what is "
              "found on --runs robots that no candidate has run.")  # fmt: skip
@click.option("--against", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE",
              help="speed to report: compare with what --json printed at another revision: ratio of "
              "the medians with its 95 % interval.")  # fmt: skip
@click.option("--page", type=OutFile(), metavar="FILE",
              help="vision: write an HTML page with the worst frames there.")  # fmt: skip
@click.option("--frames", type=click.IntRange(2, 10_000), default=40, show_default=True,
              help="vision: frames of each condition that marks, tags and peers are shown.")  # fmt: skip
@click.option("--empty", type=click.IntRange(1, 1_000_000), default=10_000, show_default=True,
              help="vision: frames without the robot, full of things like it.")  # fmt: skip
@click.option("--scenes", metavar="FROM..TO",
              help="vision: only the frames without the robot, those of these scenes (50 each), so that "
              "a long run can be made in pieces.")  # fmt: skip
@click.option("--drawn", metavar="FROM..TO",
              help="vision: only these scenes of look-alikes drawn flat, each another one, one frame of "
              "each, of 15 kinds in turn.")  # fmt: skip
@click.option("--longest", type=click.IntRange(10, 36_000), default=3_600, show_default=True,
              help="growth: runs up to so many seconds.")  # fmt: skip
@click.option("--most-rows", type=click.IntRange(10, 1_000_000), default=100_000, show_default=True,
              help="growth: campaigns up to so many rows.")  # fmt: skip
@click.option("--plot", type=OutFile(), metavar="FILE",
              help="growth: draw it there, as SVG.")  # fmt: skip
@json_option
def command(
    what: str, runs: int, candidates: int | None, against: Path | None, page: Path | None,
    frames: int, empty: int, scenes: str | None, drawn: str | None, longest: int, most_rows: int,
    plot: Path | None, as_json: bool,
) -> None:  # fmt: skip
    """Measure the speed of the harness, or compare the wheel laws of the board.

    \b
    speed     medians of several runs, with least and largest
    parts     what a tick's shares, a report and the viewer's file cost
    batch     runs a second and times real time of one core, by camera, and of the plant alone
    law       the whole loop with an own law in Python, and with built-in ones
    campaign  runs a second of a campaign on all cores
    report    a campaign's rows put together, its answers and page, from 10 to a million rows
    growth    time and memory over the length of a run, rows, runs, workers and Dask workers
    wheels    both wheel laws at step, ramp, crawl, turn, load, friction, battery sag
    vision    the colour marks on rendered sequences with known truth, and beside cv2.aruco,
              AprilTag and a plain threshold; half an hour
    firmware  what the sketch costs the Mega 2560: cycles by part, load, memory
    """  # noqa: D301 - \b is click's mark for a verbatim paragraph
    if what != "vision" and page is not None:
        raise click.UsageError(f"--page: {what} has no frames to show; only vision has")
    if page is not None and not page.absolute().parent.is_dir():
        raise click.UsageError(f"--page {page}: there is no folder {page.absolute().parent}")
    if what in _SPEED and candidates is not None:
        raise click.UsageError("--tune: the wheels have gains, the speed figures have none")
    if what not in _SPEED and against is not None:
        raise click.UsageError(f"--against: for {', '.join(_SPEED)}")
    if plot is not None and (what != "growth" or not plot.absolute().parent.is_dir()):
        raise click.UsageError(f"--plot {plot}: for growth, in a folder that exists")
    if (scenes or drawn) is not None and (what != "vision" or page is not None):
        raise click.UsageError(
            "--scenes, --drawn: for vision, without --page, whose frames have the robot"
        )
    if candidates is not None:
        _tune_wheels(candidates, runs, as_json)
    elif what == "wheels":
        _compare_wheels(runs, as_json)
    elif what == "vision":
        _measure_vision(frames, empty, scenes, drawn, page, as_json)
    elif what == "firmware":
        _measure_firmware(as_json)
    elif what == "growth":
        _measure_growth(longest, most_rows, plot, as_json)
    else:
        _measure_speed(what, runs, against, as_json)


def _measure_vision(
    frames: int,
    without: int,
    scenes: str | None,
    drawn: str | None,
    page: Path | None,
    as_json: bool,
) -> None:
    if scenes is not None and drawn is not None:
        raise click.UsageError("--scenes, --drawn: one at a time; each shows nothing else")
    if drawn is not None:
        _show_drawn(drawn, as_json)
        return
    if scenes is not None:
        _show_scenes(scenes, as_json)
        return
    from hil.core.files import replace_file
    from hil.tools import bench_peers, bench_vision, look_alikes

    def progress(text: str) -> None:
        click.echo(text, err=True)

    rows = bench_vision.table(100, progress)
    empty = look_alikes.empty_scenes(without, tuple(bench_vision.VIEWS.values()), progress)
    shown = list(bench_peers.lines(frames, progress))
    peers = [line for lines, _ in shown for line in lines]
    if page is not None:
        text = bench_peers.as_page(peers, [worst for _, worst in shown])
        replace_file(page, text.encode("utf-8"))
    if as_json:
        document = bench_vision.as_document(rows, empty)
        print_json({**document, "peers": [line.as_data() for line in peers]})
        return
    click.echo(bench_vision.as_markdown(rows, empty))
    click.echo("\n" + bench_peers.as_markdown(peers))


def _show_scenes(asked: str, as_json: bool) -> None:
    from dataclasses import asdict

    from hil.tools import bench_vision, look_alikes

    first, last = _range(asked, "--scenes")
    per_scene, views = look_alikes.FRAMES_PER_SCENE, tuple(bench_vision.VIEWS.values())
    found = look_alikes.empty_scenes(
        (last - first + 1) * per_scene, views, lambda text: click.echo(text, err=True), first=first
    )
    if as_json:
        print_json({"empty_scenes": asdict(found)})
    else:
        click.echo(bench_vision.in_words(found))


def _show_drawn(asked: str, as_json: bool) -> None:
    from dataclasses import asdict

    from hil.tools import drawn_look_alikes

    first, last = _range(asked, "--drawn")
    found = drawn_look_alikes.drawn_scenes(first, last, lambda text: click.echo(text, err=True))
    if as_json:
        print_json({"drawn_scenes": asdict(found)})
    else:
        click.echo(drawn_look_alikes.as_markdown(found))


def _range(asked: str, option: str) -> tuple[int, int]:
    """Return the first and the last number of FROM..TO."""
    ends = asked.split("..")
    if len(ends) != 2 or not all(end.isdecimal() for end in ends) or int(ends[0]) > int(ends[1]):
        raise click.UsageError(f"{option} {asked}: two numbers from 0 up, say 0..199")
    return int(ends[0]), int(ends[1])


def _measure_growth(longest_s: int, most_rows: int, plot: Path | None, as_json: bool) -> None:
    from hil.study.campaign import growth
    from hil.tools import bench

    found = growth.measured(longest_s, most_rows, lambda text: click.echo(text, err=True))
    if plot is not None:
        growth.write_plot(plot, found)
    figures = [figure for series in found for figure in series.figures()]
    if as_json:
        print_json(bench.as_document("growth", figures))
        return
    from rich.console import Console
    from rich.table import Table

    table = Table("what", "value", "unit")
    for figure in figures:
        table.add_row(figure.name, f"{figure.median:.4g}", figure.unit)
    Console().print(table)


def _measure_firmware(as_json: bool) -> None:
    from dataclasses import asdict

    from hil.config.load import load_scenario
    from hil.tools import firmware_cost

    cost = firmware_cost.measure(load_scenario("scenario-1").robot)
    if as_json:
        print_json(asdict(cost))
        return
    from rich.console import Console
    from rich.table import Table

    tick_cycles = firmware_cost.CLOCK_HZ / firmware_cost.TICKS_PER_S
    parts = Table("part", "cycles a tick", "share")
    for name, cycles in cost.cycles_per_tick.items():
        parts.add_row(name, f"{cycles:.0f}", f"{cycles / tick_cycles:.1%}")
    table = Table("budget", "measured", "unit", "limit")
    for what, value, unit, limit in firmware_cost.budgets(cost):
        table.add_row(what, f"{value:,.0f}" if value >= 100 else f"{value:.3g}", unit, limit)
    Console().print(parts, table)


def _measured(what: str, runs: int) -> list[Figure]:
    if what == "speed":
        from hil.tools import bench

        return bench.figures(runs)
    if what == "parts":
        from hil.tools import bench_parts

        return bench_parts.figures(runs)
    from hil.study.campaign import speed
    from hil.tools import bench_runs

    plans = {
        "batch": bench_runs.batch_figures,
        "law": bench_runs.law_figures,
        "campaign": speed.campaign_figures,
        "report": speed.report_figures,
    }
    return plans[what](runs)


def _measure_speed(what: str, runs: int, against: Path | None, as_json: bool) -> None:
    from hil.tools import bench, bench_history

    then = None if against is None else bench_history.read_history(against, what)
    found = _measured(what, runs)
    ratios = [] if then is None else bench_history.compared(found, then)
    if as_json:
        document = bench.as_document(what, found)
        if then is not None:
            document["against"] = bench_history.as_list(ratios)
        print_json(document)
        return
    from rich.console import Console
    from rich.table import Table

    table = Table("figure", "median", "least", "largest", "unit", "goal")
    for figure in found:
        values = (f"{value:.3g}" for value in (figure.median, figure.least, figure.largest))
        table.add_row(figure.name, *values, figure.unit, figure.goal)
    Console().print(table)
    if then is None:
        return
    other = Table("figure", "then", "now", "unit", "now / then", "95 % interval")
    for r in ratios:
        numbers = (f"{value:.3g}" for value in (r.then, r.now))
        other.add_row(r.name, *numbers, r.unit, f"{r.ratio:.3g}", f"{r.low:.3g} to {r.high:.3g}")
    Console().print(other)


def _compare_wheels(robots: int, as_json: bool) -> None:
    from hil.study import wheel_bench

    found = wheel_bench.table({}, wheel_bench.held_out(robots))
    if as_json:
        print_json(wheel_bench.as_document(found))
        return
    from rich.console import Console
    from rich.table import Table

    table = Table("case", "law", *wheel_bench.COLUMNS, title=f"mean of {robots} robots drawn")
    for case, laws in found.items():
        for law, values in laws.items():
            first = case if law == next(iter(laws)) else ""
            table.add_row(first, law, *wheel_bench.row(values))
    Console().print(table)


def _tune_wheels(candidates: int, robots: int, as_json: bool) -> None:
    from hil.study import wheel_bench, wheel_tune

    def progress(what: str, done: int, candidates: int, best: float) -> None:
        click.echo(f"\r{what}: {done} of {candidates}, cost {best:.4f} ", nl=False, err=True)

    plan = wheel_tune.Plan(candidates=candidates)
    found = wheel_tune.tune(plan, progress)
    click.echo("", err=True)
    unseen = wheel_bench.held_out(robots)
    judged = wheel_tune.judge({law: stage.values for law, stage in found.items()}, unseen)
    if as_json:
        print_json(wheel_tune.as_document(plan, found, judged, unseen))
        return
    for law, stage in found.items():
        click.echo(f"# {law}: cost {stage.start_cost:.4f} to {stage.cost:.4f}")
        for parameter, value in stage.values.items():
            click.echo(f"{parameter} = {value:g}")
    click.echo(f"on {robots} robots that no search has seen, 95 % intervals:")
    for line in wheel_tune.as_lines(judged):
        click.echo(line)
