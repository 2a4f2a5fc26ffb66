"""Registries: one a kind of thing that a lab may bring along - laws, estimators, localisers, ...

A thing registers itself where it is defined, with `@REGISTRY.register(name, ...)`. Built-in ones are the
modules of the registry's home package; others come from an installed package (an entry point of the
registry's group, which names a module or a registered class) or from a file: `path/to/law.py`, or
`path/to/law.py:Name` where the file holds several. Whoever needs a name asks `get`: nobody lists them.
"""

from __future__ import annotations

import difflib
import hashlib
import importlib
import importlib.util
import pkgutil
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from hil.core.errors import BadInput
from hil.core.files import read_text

Thing = TypeVar("Thing", bound=Callable[..., Any])
# name -> (least, start, largest) of what a search may vary, on a logarithmic scale
Box = Mapping[str, tuple[float, float, float]]
# name -> (unit, meaning) of a term that a law gives in its trace and the record keeps
Terms = Mapping[str, tuple[str, str]]

BUILT_IN = "built in"
_OWN_PACKAGES = ("hil", "vision", "sim_twin")
# Module name -> text of each file that was run: one file may bring things of several kinds.
_SOURCES: dict[str, SourceText] = {}


@dataclass(frozen=True, slots=True)
class SourceText:
    """The file a thing from outside was defined in, as it was read."""

    path: Path
    text: str

    @property
    def sha256(self) -> str:
        """Return the digest of the text, hexadecimal."""
        return hashlib.sha256(self.text.encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class Entry:
    """One thing of a kind. `settings` is the pydantic model of its own values, None if it has none."""

    name: str
    factory: Callable[..., Any]
    summary: str
    settings: type[Any] | None = None
    search: Box = field(default_factory=dict)
    label: str = ""
    colour: str = ""
    origin: str = BUILT_IN
    source: SourceText | None = None
    extra: Mapping[str, Any] = field(default_factory=dict)

    @property
    def trace(self) -> Terms:
        """Return the terms of its own that a law declared with `trace=`; raises BadInput."""
        return declared_terms(self)

    @property
    def key(self) -> str:
        """Return the name as a key of a TOML table."""
        return self.name.replace("-", "_")


class Registry:
    """All things of one kind. `kind` is how messages call one of them."""

    def __init__(self, kind: str, group: str, home: str, methods: tuple[str, ...] = ()) -> None:
        self.kind = kind
        self._methods = methods
        self.group = group
        self._home = home
        self._entries: dict[str, Entry] = {}
        self._failed: dict[str, str] = {}
        self._files: dict[tuple[Path, str], tuple[Entry, ...]] = {}
        self._complete = False
        self._loading: tuple[str, SourceText | None] = (BUILT_IN, None)

    def register(
        self,
        name: str,
        *,
        summary: str = "",
        settings: type[Any] | None = None,
        search: Box | None = None,
        label: str = "",
        colour: str = "",
        **extra: Any,
    ) -> Callable[[Thing], Thing]:
        """Return the decorator that enters a class or function under `name`.

        Raises BadInput when another thing has the name already; both are named.
        """

        def enter(thing: Thing) -> Thing:
            origin, source = self._loading
            module = str(getattr(thing, "__module__", ""))
            if source is None and module in _SOURCES:  # of a file that another registry loads
                source = _SOURCES[module]
                origin = str(source.path)
            elif origin == BUILT_IN and module.partition(".")[0] not in _OWN_PACKAGES:
                origin = f"module {module}"  # decorated in a notebook or a script
            first_line = (thing.__doc__ or "").strip().split("\n")[0]
            self._enter(
                Entry(
                    name,
                    thing,
                    summary or first_line,
                    settings,
                    dict(search or {}),
                    label or name,
                    colour,
                    origin,
                    source,
                    extra,
                )
            )
            return thing

        return enter

    def _enter(self, entry: Entry) -> None:
        known = self._entries.get(entry.name)
        if known is not None and known.origin != entry.origin:
            raise BadInput(
                f"{self.kind} {entry.name!r}: two have this name: {known.origin} and {entry.origin}; "
                "rename one"
            )
        self._entries[entry.name] = entry

    # -- looking up ----------------------------------------------------------------------------

    def names(self) -> list[str]:
        """Return the names of all that are built in or installed, and of files loaded so far."""
        self._find_all()
        return sorted(self._entries)

    def entries(self) -> list[Entry]:
        """Return all entries, in the order of their names."""
        self._find_all()
        return [self._entries[name] for name in sorted(self._entries)]

    @property
    def failed(self) -> dict[str, str]:
        """Return what could not be loaded: package -> its own error in one line."""
        self._find_all()
        return dict(self._failed)

    def get(self, name: str) -> Entry:
        """Return the entry of a name, or of a file `path.py` or `path.py:Name`; raises BadInput."""
        if is_file_name(name):
            return self.load_file(name)
        if name not in self._entries:
            self._find_all()
        entry = self._entries.get(name)
        if entry is None:
            raise BadInput(self._unknown(name))
        return entry

    def _unknown(self, name: str) -> str:
        names = self.names()
        near = difflib.get_close_matches(name, names, n=3, cutoff=0.5) or names
        broken = "".join(
            f"; {where} could not be loaded: {why}" for where, why in self._failed.items()
        )
        return (
            f"{self.kind} {name!r}: not built in and in no installed package ({self.group}); "
            f"near: {', '.join(near)}; or name a file: {_as_file(name)}{broken}"
        )

    def _find_all(self) -> None:
        """Import the built-in modules and what installed packages bring, once."""
        if self._complete:
            return
        self._complete = True
        for module in _modules_of(self._home):
            importlib.import_module(module)
        for point in _installed(tuple(sys.path)).select(group=self.group):
            self._load_package(point)

    def _load_package(self, point: EntryPoint) -> None:
        where = point.dist.name if point.dist is not None else point.value
        before = self._loading
        self._loading = (f"package {where}", None)
        try:
            point.load()
        except BadInput as error:
            self._failed[where] = str(error)
        except Exception as error:
            self._failed[where] = in_one_line(error)
        finally:
            self._loading = before

    def load_file(self, name: str) -> Entry:
        """Return the entry that a file defines; raises BadInput with the file's own error."""
        path_text, _, wanted = _split_file_name(name)
        path = Path(path_text).resolve()
        try:
            text = read_text(path)
        except (OSError, UnicodeDecodeError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise BadInput(f"{self.kind} {name!r}: {path_text} cannot be read: {reason}") from None
        return self.load_text(SourceText(path, text), wanted)

    def load_text(self, source: SourceText, wanted: str = "") -> Entry:
        """Return the entry that a source text defines (`wanted` of several); raises BadInput."""
        return self._choose(source, self.adopt(source), wanted)

    def adopt(self, source: SourceText) -> tuple[Entry, ...]:
        """Make all that a source text defines known; raises BadInput."""
        known = self._files.get((source.path, source.sha256))
        if known is None:
            known = self._files[(source.path, source.sha256)] = self._run(source)
        self._entries |= {entry.name: entry for entry in known}
        return known

    def _run(self, source: SourceText) -> tuple[Entry, ...]:
        """Execute a file and return what it registered here."""
        before, self._entries, loading = self._entries, {}, self._loading
        self._loading = (str(source.path), source)
        try:
            self._find_all_into(before)
            _execute(source)
            found = tuple(self._entries.values())
        except BadInput:
            raise
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                raise
            raise BadInput(f"{self.kind} {source.path}: {_place_in(source, error)}") from None
        finally:
            self._entries, self._loading = before, loading
        for entry in found:
            self._require_methods(entry)
            if entry.name in before and before[entry.name].origin != entry.origin:
                other = before[entry.name].origin
                raise BadInput(
                    f"{self.kind} {entry.name!r}: two have this name: {source.path} and {other}; "
                    "rename the one in the file"
                )
            before[entry.name] = entry
        return found

    def _require_methods(self, entry: Entry) -> None:
        """Raise BadInput when a class lacks what every thing of this kind must have."""
        missing = [name for name in self._methods if not hasattr(entry.factory, name)]
        article = "an" if self.kind[0] in "aeiou" else "a"
        if isinstance(entry.factory, type) and missing:
            raise BadInput(
                f"{self.kind} {entry.name} ({entry.origin}): class {entry.factory.__name__} has no "
                f"{' and no '.join(missing)}; {article} {self.kind} needs {', '.join(self._methods)}"
            )

    def _find_all_into(self, known: dict[str, Entry]) -> None:
        """Have the built-in things found before a file is run, so that its names are compared."""
        mine, self._entries = self._entries, known
        loading, self._loading = self._loading, (BUILT_IN, None)
        try:
            self._find_all()
        finally:
            self._entries, self._loading = mine, loading

    def _choose(self, source: SourceText, found: tuple[Entry, ...], wanted: str) -> Entry:
        if not found:
            what = "class" if self._methods else "class or function"
            raise BadInput(
                f"{self.kind} {source.path}: registers no {self.kind}; a file needs a {what} under "
                f"@hil.{self.group.rsplit('.', maxsplit=1)[-1].removesuffix('s')}(...); "
                f"`hil new` writes one"
            )
        if wanted:
            for entry in found:
                if wanted in {entry.name, getattr(entry.factory, "__name__", "")}:
                    return entry
            raise BadInput(
                f"{self.kind} {source.path}: no {wanted!r} in it; it has "
                f"{', '.join(entry.name for entry in found)}"
            )
        if len(found) > 1:
            raise BadInput(
                f"{self.kind} {source.path}: has {len(found)} of them "
                f"({', '.join(entry.name for entry in found)}); name one: {source.path.name}:NAME"
            )
        return found[0]


@cache
def _installed(_path: tuple[str, ...]) -> Any:  # what it is differs from Python to Python
    """Return what installed packages bring, of every group: one look at all of them takes 10 ms."""
    return entry_points()


def declared_terms(entry: Entry) -> Terms:
    """Return `trace=` of a registration as it must be: name -> (unit, meaning); raises BadInput."""
    given = entry.extra.get("trace", {})
    rows = list(given.items()) if isinstance(given, Mapping) else [("", None)]
    for name, said in rows:
        parts = said if isinstance(said, tuple | list) else ()
        if not (
            isinstance(name, str)
            and name.isidentifier()
            and len(parts) == 2
            and all(isinstance(part, str) for part in parts)
        ):
            raise BadInput(
                f"{entry.name} ({entry.origin}): trace = {{{name!r}: {said!r}}}: needs names with "
                'unit and meaning, for example {"offset_m": ("m", "offset from the line, left")}'
            )
    return {name: (str(said[0]), str(said[1])) for name, said in rows if said is not None}


def is_file_name(name: str) -> bool:
    """Say whether a name means a file: `x.py`, `x.py:Name`, or anything with a folder in it."""
    if not (".py" in name or "/" in name or "\\" in name):  # the short way: runs ask for names
        return False
    path, _, _ = _split_file_name(name)
    return path.endswith(".py") or "/" in path or "\\" in path


def _as_file(name: str) -> str:
    """Return the file that a name that is none may have meant."""
    return (
        f"./{name}.py" if name.isidentifier() or not Path(name).suffix else "one that ends in .py"
    )


def _split_file_name(name: str) -> tuple[str, str, str]:
    """Return (path, ":", object) of `path.py:Object`; a drive letter is no separator."""
    head, colon, tail = name.rpartition(":")
    if colon and head.endswith(".py"):
        return head, colon, tail
    return name, "", ""


def _modules_of(package: str) -> Iterator[str]:
    """Yield a module's own name, and those of its modules where it is a package."""
    yield package
    paths = getattr(importlib.import_module(package), "__path__", None)
    for item in pkgutil.iter_modules(paths or ()):
        if not item.name.startswith("_"):
            yield f"{package}.{item.name}"


def _execute(source: SourceText) -> ModuleType:
    """Run a source text as a module of its own name, which later runs of its path replace."""
    name = f"hil_file_{source.path.stem}_{source.sha256[:12]}"
    module = ModuleType(name)
    module.__file__ = str(source.path)
    code = compile(source.text, str(source.path), "exec")
    sys.modules[name] = module  # dataclasses and pydantic look the module of a class up
    _SOURCES[name] = source
    folder = str(source.path.parent)
    sys.path.insert(0, folder)
    try:
        exec(code, module.__dict__)
    except BaseException:
        del sys.modules[name], _SOURCES[name]
        raise
    finally:
        sys.path.remove(folder)
    return module


def in_one_line(error: BaseException) -> str:
    """Return what an exception says, in one line."""
    said = " ".join(str(error).split())
    return f"{type(error).__name__}: {said}" if said else type(error).__name__


def _place_in(source: SourceText, error: BaseException) -> str:
    """Return `line N: error` with the last line of the file that the error passed through."""
    if isinstance(error, SyntaxError):
        return f"line {error.lineno}: {in_one_line(error)}"
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if frame.filename == str(source.path)]
    where = f"line {lines[-1]}: " if lines else ""
    return f"{where}{in_one_line(error)}"


def place_of(entry: Entry, error: BaseException | None = None) -> str:
    """Return the file of a thing from outside, and the line in it that an error passed last."""
    if entry.source is None:
        return entry.origin
    name, path = entry.source.path.name, str(entry.source.path)
    frames = traceback.extract_tb(error.__traceback__) if error is not None else []
    lines = [frame.lineno for frame in frames if frame.filename == path]
    return f"{name}, line {lines[-1]}" if lines else name
