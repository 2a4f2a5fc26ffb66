"""The `hil` command: a group whose sub-commands are imported only when they are called."""

from __future__ import annotations

import gc
import importlib
import sys
import traceback
from typing import NoReturn

import click

from hil import __version__
from hil.cli.streams import let_readers_go
from hil.core.errors import HilError, RigFault, stop_status
from hil.core.text import visible
from hil.runs.interruption import ignore_signals, last_stop, take_signals

# name -> (module, one-line help). The text stands here so that `hil --help` imports no command.
COMMANDS = {
    "run": ("hil.cli.run", "Run one scenario on a target and record it."),
    "experiment": (
        "hil.cli.experiment",
        "Run every scenario of a deck with every law; one report.",
    ),
    "compare": ("hil.cli.compare", "Compare recorded runs: table, JSON and HTML report."),
    "replay": ("hil.cli.replay", "Replay a record exactly, or with another law as its shadow."),
    "import": (
        "hil.cli.importing",
        "Make a record of another program's log: .tlog .bin .ulg .mcap, CSV.",
    ),
    "export": ("hil.cli.export", "Write a record as MCAP (Foxglove), ULog (PX4) or CSV."),
    "fit": ("hil.cli.fit", "Find what a log tells of a robot; write its robot file."),
    "console": ("hil.cli.console", "The rig in a browser: run, watch, STOP, look at records."),
    "view": ("hil.cli.view", "Open recorded runs in the viewer."),
    "sweep": ("hil.cli.sweep", "Run a campaign over grids, lists and distributions; draw maps."),
    "list": ("hil.cli.listing", "List laws, estimators, localisers, scenarios, ... with settings."),
    "new": ("hil.cli.new", "Write a starting point for a law, scenario, robot or localiser."),
    "check": ("hil.cli.check", "Check a law, estimator, localiser or robot of your own."),
    "reproduce": (
        "hil.cli.reproduce",
        "Reproduce the thesis's numerical studies, chapters 4 to 8; judge its claims.",
    ),
    "tune": ("hil.cli.tune", "Tune the gains of laws by one procedure and budget."),
    "verdict": (
        "hil.cli.verdict",
        "Compare all laws on tasks no search has seen; fronts, ablation.",
    ),
    "ablate": ("hil.cli.ablate", "Switch each part of a law off in turn: what it is worth."),
    "falsify": ("hil.cli.falsify", "Search for the run that most violates a requirement."),
    "power": ("hil.cli.power", "How many pairs of runs show a difference of a given size."),
    "faults": ("hil.cli.faults", "Break everything once: each fault at each instant."),
    "twin": ("hil.cli.twin", "Serve the digital twin to other programs."),
    "firmware": ("hil.cli.firmware", "Generate, build, upload and configure the firmware."),
    "calibrate": ("hil.cli.calibrate", "Calibrate lens, camera pose over the floor, and colours."),
    "bringup": ("hil.cli.bringup", "Check a rig with its wheels off the ground; measure it."),
    "localise": ("hil.cli.localise", "Find the robot in a video or in images, without a rig."),
    "config": ("hil.cli.config", "Show every key of the files: unit, bounds, default, source."),
    "doctor": ("hil.cli.doctor", "Say what is installed and connected, and what is missing."),
    "bench": ("hil.cli.bench", "Measure the speed of the harness on this machine."),
}


class LazyGroup(click.Group):
    """A click group that imports a command's module when that command is used."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the command names in the order in which a newcomer needs them."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """Import and return the command, None when there is no such command."""
        if cmd_name not in COMMANDS:
            return None
        command = importlib.import_module(COMMANDS[cmd_name][0]).command
        assert isinstance(command, click.Command)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """Write the command list from the table above, without importing anything."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="hil")
def cli() -> None:
    """Hardware-in-the-loop test harness for a four-wheel skid-steer robot.

    Start with `hil experiment` (all three scenarios on the digital twin, both laws, one report) or
    `hil run scenario-1 --view`. Results go to stdout, progress and log to stderr.

    \b
    Exit status: 0 all requirements held, 1 a requirement failed, 2 bad usage or input,
    3 rig fault (port, camera, board), 130 stopped by Ctrl-C, 143 by SIGTERM,
    129 by SIGHUP.
    """  # noqa: D301 - \b is click's mark for a verbatim paragraph


# New objects between two searches for cycles: a command makes some 100,000 while it loads its code, all of
# which stay, and with 700, as Python has it, looks through them again and again.
_NEW_OBJECTS = 50_000


def main() -> NoReturn:
    """Run the command line; every expected end is one line on stderr and its exit status."""
    gc.set_threshold(_NEW_OBJECTS, *gc.get_threshold()[1:])
    let_readers_go()
    take_signals()
    status = _run()
    ignore_signals()
    try:
        sys.stdout.flush()
    except OSError as error:
        status = _say(f"output cannot be written: {error.strerror}", RigFault.exit_status)
    sys.exit(status)


def _run() -> int:
    """Run the command that was asked for and return the exit status."""
    try:
        return _run_command()
    except Exception:
        stopped = last_stop()
        if stopped is not None:  # a library made something else of it
            return _say(f"stopped by {stopped}", 128 + stopped.number)
        traceback.print_exc()
        return _say("an error of the program itself, see above", RigFault.exit_status)


def _run_command() -> int:  # noqa: PLR0911 - one return for each kind of end
    try:
        status = cli.main(prog_name="hil", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        return 2
    except click.ClickException as error:
        said = " ".join(error.format_message().split())
        return _say(said, error.exit_code if isinstance(error, click.UsageError) else 2)
    except HilError as error:
        return _say(str(error), error.exit_status)
    except (click.Abort, KeyboardInterrupt) as error:
        name = str(error.__cause__ or error) or "Ctrl-C"
        return _say(f"stopped by {name}", stop_status(name))
    except SystemExit as error:
        return error.code if isinstance(error.code, int) else 0
    except OSError as error:
        where = f"{error.filename}: " if error.filename else "output cannot be written: "
        return _say(f"{where}{error.strerror or error}", RigFault.exit_status)
    return status if isinstance(status, int) else 0


def _say(text: str, status: int) -> int:
    """Write one line to stderr and return the status."""
    click.echo(f"hil: {visible(text)}", err=True)
    return status


if __name__ == "__main__":
    main()
