"""Laws of a study: those of its TOML file, made of hil.control, or one of the user's own file."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from hil import control
from hil.core.errors import BadInput
from hil.study.chapters.deck import LawSpec, Row, StudyDeck

STAGES: Mapping[str, tuple[tuple[str, int], ...]] = {
    "quadrotor": (("position", 3), ("attitude", 3)),
    "vehicle5": (("position", 3), ("sideways", 2), ("drive", 3)),
    "vehicle6": (("position", 3),),
}
"""Stages of each plant in the order of its cascade, with their number of axes."""

_MAKERS: Mapping[str, Callable[..., control.Law]] = {
    "state-feedback": control.StateFeedback,
    "asg-ism": control.AsgIsm,
    "sliding-mode": control.SlidingMode,
    "utkin-ism": control.UtkinIsm,
}
_WHOLE = {"kp", "c", "k"}  # the gains whose length is the number of axes
OWN_LAW_HELP = (
    "a Python file with a class Law(stage, axes) that has reset(p, q) and "
    "output(t_s, p, q, dt_s) -> w; rate(q_dot) and advance(dt_s) where it wants them"
)


def make_laws(deck: StudyDeck, row: Row) -> list[Any]:
    """Return new laws for all stages of a row; raises BadInput where a gain does not fit."""
    laws = deck.laws[row.law]
    made = []
    for stage, axes in STAGES[deck.plant]:
        spec: LawSpec | None = getattr(laws, stage)
        if spec is None:
            raise BadInput(f"law {row.law}: has no stage {stage!r}, which {deck.plant} needs")
        changed = row.gains if row.stage in {None, stage} else {}
        made.append(_make(spec, axes, changed, row.sign, f"row {row.row}: stage {stage}"))
    return made


def _make(
    spec: LawSpec, axes: int, changed: Mapping[str, float | bool], sign: float, where: str
) -> control.Law:
    gains = spec.model_dump(exclude_none=True, exclude={"kind"})
    for key, value in changed.items():
        if key in gains or key in {"mu_min", "implicit", "dominating", "kd"}:
            gains[key] = [value] * axes if key in _WHOLE | {"kd", "eps", "eps_min"} else value
    for key in _WHOLE & gains.keys():
        values = list(gains[key])
        gains[key] = [sign * v for v in (values * axes if len(values) == 1 else values)]
    if sign < 0 and "kd" in gains:
        gains["kd"] = [sign * value for value in gains["kd"]]
    for key, value in gains.items():
        if isinstance(value, list | tuple) and len(value) not in {1, axes}:
            raise BadInput(f"{where}: {key} has {len(value)} values, the stage has {axes} axes")
    try:
        return _MAKERS[spec.kind](**gains)
    except (TypeError, ValueError) as error:
        text = str(error).splitlines()[0]
        raise BadInput(f"{where}: {spec.kind} cannot be made of {sorted(gains)}: {text}") from None


class OwnLaw:
    """A law class of the user's file; `make` gives new ones for the stages of a plant."""

    def __init__(self, path: Path) -> None:
        self.path = path
        spec = importlib.util.spec_from_file_location(f"own_law_{path.stem}", path)
        if not path.is_file() or spec is None or spec.loader is None:
            raise BadInput(f"--law {path}: no such Python file; it is {OWN_LAW_HELP}")
        module = importlib.util.module_from_spec(spec)
        sys.modules[spec.name] = module
        try:
            spec.loader.exec_module(module)
        except Exception as error:
            raise BadInput(f"--law {path}: {_told(error)}") from None
        self._factory = getattr(module, "Law", None)
        if not callable(self._factory):
            raise BadInput(f"--law {path}: has no class Law; it is {OWN_LAW_HELP}")

    def make(self, plant: str) -> list[Any]:
        """Return one law a stage; raises BadInput where the class cannot be used."""
        made = []
        for stage, axes in STAGES[plant]:
            try:
                law = self._factory(stage, axes)  # type: ignore[misc]
            except Exception as error:
                raise BadInput(f"--law {self.path}: stage {stage}: {_told(error)}") from None
            for method in ("reset", "output"):
                if not callable(getattr(law, method, None)):
                    raise BadInput(
                        f"--law {self.path}: Law has no {method}(); it is {OWN_LAW_HELP}"
                    )
            made.append(law)
        return made

    def failed(self, error: Exception) -> BadInput:
        """Return the error of a run as one line."""
        return BadInput(f"--law {self.path}: {_told(error)}")


def _told(error: Exception) -> str:
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
