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
