"""The errors a person meets, and the exit status each one ends with."""

__all__ = ["BadInput", "HilError", "RigFault"]


class HilError(Exception):
    """Base of every error the harness raises on purpose; `exit_status` is the process's."""

    exit_status = 1


class BadInput(HilError):
    """A value, file or option cannot be used: says what, value with unit, limit, what to try."""

    exit_status = 2


class RigFault(HilError):
    """Port, camera, board or link failed while in use; the robot was told to stop first."""

    exit_status = 3


class RecordFault(RigFault):
    """The record can no longer be written; what was written before stays readable."""


class Stopped(KeyboardInterrupt):
    """A signal asked for the end; its text is the name by which people know it."""

    def __init__(self, number: int) -> None:
        super().__init__(_SIGNAL_NAMES.get(number, f"signal {number}"))
        self.number = number


_SIGNAL_NAMES = {2: "Ctrl-C", 1: "SIGHUP", 15: "SIGTERM"}


def stop_status(name: str) -> int:
    """Return the exit status of what was stopped by the signal of that name: 128 and its number."""
    numbers = {text: number for number, text in _SIGNAL_NAMES.items()}
    return 128 + numbers.get(name, 2)
