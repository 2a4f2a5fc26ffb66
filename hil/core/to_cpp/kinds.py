"""What a translation of Python to C++ knows: types, signatures, names."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from dataclasses import dataclass, field

# Python's type -> C++'s; what is not here is a class by its own name.
_TYPES = {
    "float": "double",
    "int": "int",
    "bool": "bool",
    "None": "void",
    "str": "std::string",
    "Vec2": "Vec2",
    "dict[str, float]": "Trace",
    "Mapping[str, float]": "Trace",
    "Sequence[float]": "Vec2",
    "list[float]": "std::vector<double>",
    "_Poly": "std::vector<double>",
    "Cost": "std::string",
    "OuterLaw": "AnyLaw",
    "Vehicle": "BelievedGeometry",
    "control.AsgIsm": "AsgBlock",
}
_SCALARS = {"double", "int", "bool"}


@dataclass(frozen=True)
class Part:
    """What is taken of one module: names in order, members that its constructors get from elsewhere."""

    path: str
    names: tuple[str, ...]
    members: Mapping[str, tuple[tuple[str, str], ...]] = field(default_factory=dict)
    leave: tuple[str, ...] = ()  # methods that a run does not call
    pairs: str = ""  # a function that says which keys of a trace go together: asked once, here


class NotUnderstoodError(Exception):
    """The source has something that this file does not translate."""


@dataclass
class Signature:
    """Parameters of a function or fields of a class, in order, with their defaults."""

    names: list[str]
    types: list[str]
    defaults: dict[str, ast.expr]
    returns: str = "void"
    is_struct: bool = False  # made by {...}


@dataclass(frozen=True)
class Base:
    """A class that is written out in each that is derived from it, its own type for the variable."""

    node: ast.ClassDef
    variable: str


@dataclass
class Program:
    """What is known of all modules so far."""

    functions: dict[str, Signature] = field(default_factory=dict)  # of classes: their constructors
    constants: dict[str, str] = field(default_factory=dict)  # module constants: their types
    owners: dict[str, str] = field(default_factory=dict)  # functions and classes: their namespaces
    mutable: set[str] = field(default_factory=set)  # classes with a state
    protocols: set[str] = field(
        default_factory=set
    )  # types of which a function takes any that fits
    bases: dict[str, Base] = field(default_factory=dict)  # classes that others are made of
    keys: list[str] = field(default_factory=list)  # of traces
    pairs: str = ""  # the function of a Part that pairs them


def cpp_name(name: str) -> str:
    """Return a name as C++ may have it: no underscore before a capital."""
    return f"k{name}" if name[0] == "_" and name[1:2].isupper() else name


def type_of(annotation: ast.expr | None) -> str:  # noqa: PLR0911 - one a kind of annotation
    """Return the C++ type of an annotation."""
    if annotation is None:
        return "auto"
    text = ast.unparse(annotation)
    if text in _TYPES:
        return _TYPES[text]
    if isinstance(annotation, ast.BinOp) and text.endswith("| None"):
        return f"Opt<{type_of(annotation.left)}>"
    if isinstance(annotation, ast.Subscript):
        base = ast.unparse(annotation.value)
        if base == "Literal":
            return "std::string"
        if base == "tuple" and isinstance(annotation.slice, ast.Tuple):
            return f"std::tuple<{', '.join(map(type_of, annotation.slice.elts))}>"
        if base == "Annotated" and isinstance(annotation.slice, ast.Tuple):
            return type_of(annotation.slice.elts[0])
    if isinstance(annotation, ast.Name):
        return annotation.id
    raise NotUnderstoodError(f"the type {text}")


def passed(kind: str, mutable: set[str]) -> str:
    """Return how a parameter of a type is passed."""
    if kind in _SCALARS:
        return kind
    return f"{kind}&" if kind in mutable else f"const {kind}&"


def signature_of(node: ast.FunctionDef, *, is_method: bool) -> Signature:
    """Return the parameters of a function, `self` left out."""
    arguments = node.args
    positional = arguments.args[1:] if is_method else arguments.args
    late = positional[len(positional) - len(arguments.defaults) :]
    defaults = {a.arg: d for a, d in zip(late, arguments.defaults, strict=True)}
    defaults |= {
        a.arg: d
        for a, d in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)
        if d is not None
    }
    every = [*positional, *arguments.kwonlyargs]
    return Signature(
        [a.arg for a in every],
        [type_of(a.annotation) for a in every],
        defaults,
        type_of(node.returns),
    )


def is_a_method_call(node: ast.AST) -> str:
    """Return the method that an expression calls of its own object, "" for any other."""
    match node:
        case ast.Call(func=ast.Attribute(value=ast.Name(id="self"), attr=name)):
            return name
    return ""


def is_static(node: ast.FunctionDef) -> bool:
    """Say whether it is a static method."""
    return any(isinstance(d, ast.Name) and d.id == "staticmethod" for d in node.decorator_list)
