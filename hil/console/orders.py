"""What a page orders: a run as its form says it, checked, and turned into the run that `hil run` would do."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pydantic import BaseModel, ConfigDict, Field

from hil.board.wheel_laws import require_wheel_law
from hil.config.load import builtin_names, load_scenario
from hil.console.child import ordered
from hil.core.errors import BadInput
from hil.core.registries import OUTER_LAWS
from hil.core.registry import is_file_name
from hil.core.text import visible
from hil.rigs.opening import REPLAY, is_simulated, target_entry

if TYPE_CHECKING:
    from hil.console.folders import Folders
    from hil.runs.execute import RunSpec

_Text = Annotated[str, Field(max_length=400)]


class Order(BaseModel):
    """One run as the page's form says it; `overrides` are KEY=VALUE texts as `--set` takes them."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    scenario: _Text
    law: _Text = ""
    inner: _Text = "asg-ism"
    target: _Text = "twin"
    camera: _Text = ""
    seed: int = Field(1, ge=0, le=2**31 - 1)
    overrides: tuple[_Text, ...] = Field((), max_length=200)
    real_time: bool = True
    dead_man: bool = False
    record_camera: bool = False

    @property
    def simulated(self) -> bool:
        """Say whether time is simulated, so that a run may be watched at its own speed."""
        return is_simulated(self.target)

    @property
    def armed_by_hand(self) -> bool:
        """Say whether the run waits, its robot found and shown, until the operator arms it."""
        return not self.simulated and not self.target.startswith(REPLAY)

    def command(self) -> str:
        """Return the command line of the same run."""
        words = ["hil", "run", self.scenario]
        options = (
            ("--on", "" if self.target == "twin" else self.target),
            ("--outer", self.law),
            ("--inner", "" if self.inner == "asg-ism" else self.inner),
            ("--camera", self.camera),
            ("--seed", "" if self.seed == 1 else str(self.seed)),
        )
        for option, value in options:
            words += [option, value] if value else []
        for text in self.overrides:
            words += ["--set", text]
        return shlex.join([*words, "--record-camera"] if self.record_camera else words)


def order_of(tree: object) -> Order:
    """Return what a page ordered; raises BadInput."""
    return ordered(Order, tree, "order")


def inside(order: Order, folders: Folders) -> Order:
    """Return the order with its files whole; raises BadInput for one outside the folders it may name."""
    require_wheel_law(order.inner)
    scenario = order.scenario
    if scenario not in builtin_names("scenarios"):
        scenario = str(folders.work_file(scenario, ".toml"))
    law = order.law
    if is_file_name(law):
        path, colon, name = law.partition(".py:")
        whole = folders.work_file(f"{path}.py" if colon else path, ".py")
        law = f"{whole}:{name}" if colon else str(whole)
    return order.model_copy(
        update={
            "scenario": scenario,
            "law": law,
            "target": _target(order.target, folders),
            "camera": camera_of(order.camera, folders),
            "overrides": tuple(_override(text, folders) for text in order.overrides),
        }
    )


def _target(target: str, folders: Folders) -> str:
    if target.startswith(REPLAY):
        return f"{REPLAY}{folders.record(target.removeprefix(REPLAY))}"
    target_entry(target)
    return target


def camera_of(camera: str, folders: Folders) -> str:
    """Return the camera that a page names, a file whole; raises BadInput."""
    if camera in {"", "rendered", "pose"} or camera.isdigit():
        return camera
    if camera.startswith("twin:"):
        path = Path(camera.removeprefix("twin:"))
        if path.is_socket():
            return camera
        raise BadInput(f"camera {visible(camera)}: no such socket; start `hil twin serve` first")
    return str(folders.work_file(camera, Path(camera).suffix))


def _override(text: str, folders: Folders) -> str:
    """Return KEY=VALUE; a value that names a file must name one of the user's folders."""
    key, equals, value = text.partition("=")
    word = value.strip().strip("\"'")
    if not equals or word.startswith("tcp:") or not _names_file(word):
        return text
    path, colon, name = word.partition(".py:")
    suffix = ".py" if colon else Path(word).suffix
    whole = folders.work_file(f"{path}.py" if colon else word, suffix)
    return f"{key}={whole}{colon and ':'}{name}" if colon else f"{key}={whole}"


def _names_file(word: str) -> bool:
    return not word.startswith(("[", "{")) and (
        is_file_name(word) or word.endswith((".toml", ".csv", ".json"))
    )


def spec_of(order: Order, folders: Folders) -> RunSpec:
    """Return the run that `hil run` would do for this order, into a new folder; raises BadInput.

    Loads a law of a file: only in a process of its own.
    """
    from hil.runs.execute import RunSpec, camera_for, new_folder  # noqa: PLC0415 - loads the rigs

    given = inside(order, folders)
    law = OUTER_LAWS.get(given.law) if given.law else None
    resolved = load_scenario(given.scenario, given.overrides)
    law = law or OUTER_LAWS.get(resolved.control.outer)
    return RunSpec(
        scenario=resolved,
        target=given.target,
        camera=camera_for(resolved, given.target, given.camera or None),
        outer=law.name,
        inner=given.inner,
        seed=given.seed,
        out=new_folder(f"{resolved.name}-{law.name}", folders.root),
        record_camera=given.record_camera,
        command=order.command(),
    )
