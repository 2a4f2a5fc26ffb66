"""Starting points for what a lab brings along: files of `hil/data/templates` under a name of one's own."""

from __future__ import annotations

import importlib.machinery
import re
import sys
from importlib.resources import files
from pathlib import Path

from hil.config.load import builtin_names
from hil.core.errors import BadInput
from hil.core.registries import ESTIMATORS, FIGURES, LOCALISERS, OUTER_LAWS, TUNING_COSTS

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,39}")
_REGISTRIES = {
    "law": OUTER_LAWS, "localiser": LOCALISERS, "estimator": ESTIMATORS,
    "figure": FIGURES, "cost": TUNING_COSTS,
}  # fmt: skip
_IN_PYTHON = (*_REGISTRIES, "plant")
_ROBOT = "thesis-4wd"
# What to try first; {0} is the file, {1} its name alone.
_TRY = {
    "law": "hil run scenario-1 --outer ./{0}",
    "estimator": "hil run scenario-1 --set control.estimator=./{0}",
    "localiser": "hil run scenario-1 --set camera.localiser=./{0}",
    "figure": "hil run scenario-1 --figure ./{0}",
    "cost": "hil tune --cost ./{0} --candidates 11 --held-out 2 --out {1}-tuned.toml",
    "plant": "hil run scenario-1 --set robot.plant=./{0}",
    "scenario": "hil run ./{0}",
    "robot": "hil check robot {0}",
}


def write_template(
    kind: str, name: str, folder: Path, robot: str | None = None
) -> tuple[Path, str]:
    """Write the starting point of a kind as `name` into a folder; return it and what to try first.

    `robot` is the robot of a scenario, by name or file.

    Raises BadInput for a name that cannot be one or is taken, and for a file that is there.
    """
    suffix = ".py" if kind in _IN_PYTHON else ".toml"
    _check_name(kind, name.removesuffix(suffix), suffix)
    name = name.removesuffix(suffix)
    path = folder / f"{name}{suffix}"
    text = _robot_text() if kind == "robot" else _text("templates", f"{kind}{suffix}")
    text = text.replace("my-thing", name).replace("my_thing", name.replace("-", "_"))
    text = text.replace("MyThing", "".join(part.capitalize() for part in re.split("[-_]", name)))
    if suffix == ".toml":
        text = f"#:schema {_schema(kind)}\n{text}"
    if robot is not None:
        text += f'\n[robot]\nfile = "{robot}"\n'
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise BadInput(
            f"{path}: is there already, and is left as it is; take another name"
        ) from None
    except OSError as error:
        raise BadInput(f"{path}: cannot be written: {error.strerror}") from None
    return path, _TRY[kind].format(path.name, path.stem)


def _schema(kind: str) -> str:
    """Return the address of the installed schema by which an editor checks a file of this kind."""
    return Path(str(files("hil") / "data" / "schemas" / f"{kind}.json")).resolve().as_uri()


def _text(folder: str, name: str) -> str:
    return (files("hil") / "data" / folder / name).read_text(encoding="utf-8")


def _robot_text() -> str:
    """Return the built-in robot's file, value by value with its source, to be corrected."""
    body = _text("robots", f"{_ROBOT}.toml").partition("\n\n")[2]
    return _text("templates", "robot.toml") + body.replace(f'"{_ROBOT}"', '"my-thing"', 1)


def _check_name(kind: str, name: str, suffix: str) -> None:
    if not _NAME.fullmatch(name):
        raise BadInput(
            f"{kind} {name!r}: a name begins with a letter and has up to 40 letters, digits, - and _"
        )
    if kind in _REGISTRIES:
        registry = _REGISTRIES[kind]
        for taken in registry.names():
            if taken.replace("-", "_").casefold() == name.replace("-", "_").casefold():
                origin = registry.get(taken).origin
                raise BadInput(f"{kind} {name!r}: the name is taken ({origin}); take another one")
    elif kind != "plant" and name in builtin_names(f"{kind}s"):
        raise BadInput(f"{kind} {name!r}: the name is taken (built in); take another one")
    if suffix == ".py" and _is_module(name):
        raise BadInput(
            f"{kind} {name!r}: {name}.py would hide the module {name} of Python; take another name"
        )


def _is_module(name: str) -> bool:
    """Say whether a module of this name is installed, the current folder left aside."""
    if name in sys.stdlib_module_names:
        return True
    here = {"", str(Path().resolve())}
    places = [place for place in sys.path if place not in here]
    return importlib.machinery.PathFinder.find_spec(name, places) is not None
