"""What a command does before all else."""

import subprocess
import sys

CODE = """
import atexit, gc, sys
if "usual" in sys.argv:
    from hil.cli.main import cli
else:
    atexit.register(lambda: print(gc.isenabled(), gc.get_threshold()[0]))
    sys.argv = ["hil", "--version"]
    from hil.cli.main import main
    main()
print(gc.isenabled(), gc.get_threshold()[0])
"""


def said(*arguments: str) -> list[str]:
    """Return what such a process says of its search for cycles, at its end."""
    command = [sys.executable, "-c", CODE, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()[-1].split()


def test_a_command_looks_seldom_for_cycles_while_it_loads() -> None:
    """The search goes on, so that a long run's memory stays flat; who imports the package keeps their own."""
    on, objects = said()
    assert (on, int(objects)) == ("True", 50_000)
    on, usual = said("usual")
    assert (on, int(usual)) == ("True", 700)
