"""The real command in this process: what `hil ARGUMENTS` writes, and how it ends."""

from __future__ import annotations

import contextlib
import io
import json
import sys
from dataclasses import dataclass
from typing import Any
from unittest import mock

from hil.cli.main import main


@dataclass(frozen=True, slots=True)
class Done:
    """Exit status and both outputs of a command."""

    status: int
    out: str
    err: str

    @property
    def json(self) -> dict[str, Any]:
        """Return the one JSON document on stdout."""
        document: dict[str, Any] = json.loads(self.out)
        return document

    @property
    def refusal(self) -> str:
        """Return the one line with which input was refused, after checking that it is one."""
        assert self.status == 2, (self.status, self.out, self.err)
        assert self.out == ""
        lines = self.err.splitlines()
        assert len(lines) == 1, lines
        assert lines[0].startswith("hil: ")
        return lines[0]


def hil(*arguments: object) -> Done:
    """Run `hil ARGUMENTS`; an exception that would be a traceback comes out of here."""
    out, err = io.StringIO(), io.StringIO()
    words = ["hil", *(str(argument) for argument in arguments)]
    status: Any = None
    with (
        mock.patch.object(sys, "argv", words),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            main()
        except SystemExit as end:
            status = end.code
    return Done(int(status or 0), out.getvalue(), err.getvalue())


def run_pose(*arguments: object) -> Done:
    """Run `hil run scenario-1 --camera pose ARGUMENTS`."""
    return hil("run", "scenario-1", "--camera", "pose", *arguments)
