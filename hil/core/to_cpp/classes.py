"""Classes as they are written out: their parts, and what they have of a base."""

from __future__ import annotations

import ast
import copy
from collections.abc import Mapping

from hil.core.to_cpp.kinds import (
    Base,
    NotUnderstoodError,
    Part,
    is_static,
    signature_of,
    type_of,
)


class ClassParts:
    """The fields, constructor and methods of one class."""

    def __init__(self, node: ast.ClassDef, part: Part) -> None:
        self.node = node
        given = part.members.get(node.name)
        functions = [f for f in node.body if isinstance(f, ast.FunctionDef)]
        wanted = [f for f in functions if not f.name.startswith("__") and f.name not in part.leave]
        self.bodies = [f for f in wanted if not f.decorator_list or is_static(f)]
        self.methods = {f.name: signature_of(f, is_method=not is_static(f)) for f in self.bodies}
        self.init = next((f for f in functions if f.name == "__init__" and given is None), None)
        self.fields = [
            (f.target.id, type_of(f.annotation), f.value)
            for f in node.body
            if isinstance(f, ast.AnnAssign) and isinstance(f.target, ast.Name)
        ]
        self.members = list(given or ())
        self.started: set[str] = set()  # members that the constructor itself gives a value
        bases = [ast.unparse(base) for base in node.bases]
        self.is_tuple = "NamedTuple" in bases
        self.base = next((b for b in bases if b.endswith("Gains")), None)
        self.has_state = self.init is not None or given is not None

    @property
    def interface(self) -> str:
        """Return the interface that it has, "" for none."""
        if {"reset", "step"} <= set(self.methods):
            return "OuterLaw"
        return "Reference" if "at" in self.methods else ""


class _Named(ast.NodeTransformer):
    """Puts a type in place of a variable that stands for one."""

    def __init__(self, variable: str, kind: str) -> None:
        self._variable, self._kind = variable, kind

    def visit_Name(self, node: ast.Name) -> ast.Name:
        return ast.Name(self._kind, node.ctx) if node.id == self._variable else node


def base_of(node: ast.ClassDef, names: set[str]) -> Base | None:
    """Return a class that others are made of, `class NAME(Generic[VARIABLE])`; None for any other.

    It is written out in modules that do not know the names of its own.
    """
    for base in node.bases:
        match base:
            case ast.Subscript(value=ast.Name(id="Generic"), slice=ast.Name(id=variable)):
                used = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)} & names
                if rest := sorted(used - {variable}):
                    raise NotUnderstoodError(f"{node.name} uses {', '.join(rest)} of its module")
                return Base(node, variable)
    return None


def whole(node: ast.ClassDef, bases: Mapping[str, Base]) -> ast.ClassDef:
    """Return a class with what it has of its base written out; what it says itself comes first."""
    for base in node.bases:
        match base:
            case ast.Subscript(value=ast.Name(id=name), slice=ast.Name(id=kind)) if name in bases:
                of = bases[name]
                said = {f.name for f in node.body if isinstance(f, ast.FunctionDef)}
                taken = [
                    _Named(of.variable, kind).visit(copy.deepcopy(f))
                    for f in of.node.body
                    if isinstance(f, ast.FunctionDef) and f.name not in said
                ]
                return ast.ClassDef(node.name, node.bases, [], [*taken, *node.body], [])
    return node
