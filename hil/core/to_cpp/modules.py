"""Modules and classes as C++ namespaces, structs and classes."""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from hil.core.to_cpp.bodies import Scope
from hil.core.to_cpp.classes import ClassParts, base_of, whole
from hil.core.to_cpp.kinds import (
    NotUnderstoodError,
    Part,
    Program,
    Signature,
    cpp_name,
    is_a_method_call,
    is_static,
    passed,
    signature_of,
)


def _is_number(node: ast.expr) -> bool:
    """Say whether an expression is made of numbers alone."""
    match node:
        case ast.Constant(value=value):
            return type(value) in (int, float)
        case ast.Attribute(value=ast.Name(id="math")):
            return True
        case ast.UnaryOp(operand=operand):
            return _is_number(operand)
        case ast.BinOp(left=left, right=right):
            return _is_number(left) and _is_number(right)
    return False


def _kind_of_constant(node: ast.expr) -> str:
    """Return the C++ type of a module's constant, "" for one that no law calculates with."""
    if isinstance(node, ast.Tuple) and len(node.elts) == 2 and all(map(_is_number, node.elts)):
        return "Vec2"
    return "double" if _is_number(node) else ""


class Translation:
    """All parts, one after the other."""

    def __init__(self, root: Path, parts: Sequence[Part], behind: Mapping[str, str]) -> None:
        self._root = root
        self._parts = parts
        self._behind = behind  # C++ that stands behind the part of a path
        self.program = Program()
        self._laws: list[tuple[str, str]] = []
        self._structs: list[tuple[str, list[str]]] = []

    def text(self) -> str:
        """Return the header."""
        parts = "\n".join(self._part(part) for part in self._parts)
        keys = ", ".join(f'"{key}"' for key in self.program.keys)
        hashes = "\n".join(f'    {{"{part.path}", "{self._hash(part)}"}},' for part in self._parts)
        laws = " ".join(f"X({name}, {gains})" for name, gains in self._laws)
        names = ", ".join(f'"{name}"' for name, _ in self._laws)
        fields = "\n".join(
            f"template <typename F>\nvoid fields({name}& of, F f) {{\n"
            + "".join(f'  f("{one}", of.{one});\n' for one in names)
            + "}"
            for name, names in self._structs
        )
        return (
            "// Written by hil/core/to_cpp from the Python sources named below.\n"
            '#pragma once\n\n#include "python.hpp"\n\nnamespace outer {\n'
            f"{parts}\n\n"
            f"// Calls f(name, field) for each field of what Python fills in.\n{fields}\n\n"
            f"#define OUTER_LAWS(X) {laws}\n\n"
            f"constexpr const char* kTraceKeys[] = {{{keys}}};\n"
            f"constexpr std::size_t kTraceSize = {len(self.program.keys)};\n"
            f"constexpr const char* kLaws[] = {{{names}}};\n"
            f"constexpr const char* kSources[][2] = {{\n{hashes}\n}};\n\n"
            "}  // namespace outer\n"
        )

    def _hash(self, part: Part) -> str:
        return hashlib.sha256((self._root / part.path).read_bytes()).hexdigest()

    def _part(self, part: Part) -> str:
        tree = ast.parse((self._root / part.path).read_text(encoding="utf-8"), part.path)
        try:
            return "\n".join(self._lines(part, tree))
        except NotUnderstoodError as error:
            raise NotUnderstoodError(f"{part.path}: {error}") from None

    def _lines(self, part: Part, tree: ast.Module) -> Iterator[str]:  # noqa: PLR0912 - in the order C++ needs
        space = "in_" + Path(part.path).stem
        yield f"\nnamespace {space} {{  // {part.path}"
        self._know_protocols(tree)
        yield from self._constants(tree)
        yield from self._paired(part, tree)
        found = {
            node.name: node
            for node in tree.body
            if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name in part.names
        }
        if missing := set(part.names) - set(found):
            raise NotUnderstoodError(f"nothing of the name {', '.join(sorted(missing))}")
        if twice := found.keys() & self.program.owners.keys():
            raise NotUnderstoodError(f"the names {', '.join(sorted(twice))} once more")
        own = {
            n.id
            for a in tree.body
            if isinstance(a, ast.Assign)
            for n in ast.walk(a.targets[0])
            if isinstance(n, ast.Name)
        }
        classes = {}
        for name in sorted(found, key=part.names.index):
            node = found[name]
            self.program.owners[name] = f"{space}::"
            if isinstance(node, ast.FunctionDef):
                self.program.functions[name] = signature_of(node, is_method=False)
            elif (base := base_of(node, own)) is not None:
                self.program.bases[name] = base
                del found[name]
            else:
                found[name] = node = whole(node, self.program.bases)
                classes[name] = self._know_class(node, part)
        for node in found.values():  # the fields of structs come before who uses them
            if isinstance(node, ast.ClassDef) and not classes[node.name].has_state:
                yield from self._struct(classes[node.name])
        for node in found.values():
            if isinstance(node, ast.FunctionDef):
                yield self._head(node, self.program.functions[node.name], defaults=True) + ";"
        for parts in classes.values():
            if parts.has_state:
                yield from self._class(parts)
        for node in found.values():
            if isinstance(node, ast.FunctionDef):
                signature = self.program.functions[node.name]
                yield self._head(node, signature, defaults=False) + " {"
                yield from Scope(self.program, {}, signature.names).block(node.body, "  ")
                yield "}"
        yield f"}}  // namespace {space}"
        for name in found:
            yield f"using {space}::{name};"
        yield self._behind.get(part.path, "")

    def _paired(self, part: Part, tree: ast.Module) -> Iterator[str]:
        """Yield which keys of a trace go together, of all that there are by now, as the source says it."""
        self.program.pairs = part.pairs
        if not part.pairs:
            return
        (node,) = (f for f in tree.body if isinstance(f, ast.FunctionDef) and f.name == part.pairs)
        node.decorator_list = []
        space: dict[str, Any] = {}
        exec(compile(ast.Module([node], []), part.path, "exec"), space)
        keys = self.program.keys
        found = [(keys.index(a), keys.index(b)) for a, b in space[part.pairs](tuple(keys))]
        inside = ", ".join(f"{{{one}, {other}}}" for one, other in found)
        yield f"constexpr std::pair<std::size_t, std::size_t> k_pairs[] = {{{inside}}};"

    def _constants(self, tree: ast.Module) -> Iterator[str]:
        """Yield the module's numbers and pairs of numbers."""
        scope = Scope(self.program, {}, ())
        for node in tree.body:
            if not isinstance(node, ast.Assign):
                continue
            for target, value in self._pairs(node):
                kind = _kind_of_constant(value)
                if isinstance(target, ast.Name) and kind:
                    self.program.constants[target.id] = kind
                    yield f"[[maybe_unused]] const {kind} {cpp_name(target.id)} = {scope.of(value)};"

    @staticmethod
    def _pairs(node: ast.Assign) -> list[tuple[ast.expr, ast.expr]]:
        """Return each target of an assignment with its value."""
        target, value = node.targets[0], node.value
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            return list(zip(target.elts, value.elts, strict=True))
        return [(target, value)]

    def _know_protocols(self, tree: ast.Module) -> None:
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and "Protocol" in map(ast.unparse, node.bases):
                self.program.protocols.add(node.name)

    def _know_class(self, node: ast.ClassDef, part: Part) -> ClassParts:
        found = ClassParts(node, part)
        if found.has_state:
            self.program.mutable.add(node.name)
        if found.init is not None:
            signature = signature_of(found.init, is_method=True)
        else:
            names = [name for name, _, _ in found.fields]
            kinds = [kind for _, kind, _ in found.fields]
            signature = Signature(names, kinds, {}, is_struct=True)
        self.program.functions[node.name] = signature
        return found

    def _struct(self, parts: ClassParts) -> Iterator[str]:
        """Yield a dataclass, named tuple or section: fields, and methods that work on them alone."""
        yield f"struct {parts.node.name}{f' : {parts.base}' if parts.base else ''} {{"
        scope = Scope(self.program, {}, ())
        for name, kind, default in parts.fields:
            plain = isinstance(default, ast.Constant | ast.Tuple) and not (
                isinstance(default, ast.Constant) and default.value is None
            )
            start = f" = {scope.of(default)}" if plain and default is not None else "{}"
            yield f"  {kind} {name}{start};"
        yield from self._methods(parts)
        yield "};"
        if parts.is_tuple:
            for place, (name, kind, _) in enumerate(parts.fields):
                yield (
                    f"inline {kind} item_of(const {parts.node.name}& of, m::Place<{place}>) "
                    f"{{ return of.{name}; }}"
                )
        names = [name for name, _, _ in parts.fields]
        if parts.base:
            names = [*next(n for b, n in self._structs if b == parts.base), *names]
        self._structs.append((parts.node.name, names))

    def _class(self, parts: ClassParts) -> Iterator[str]:
        name = parts.node.name
        yield f"class {name}{f' final : public {parts.interface}' if parts.interface else ''} {{"
        yield " public:"
        if parts.init is None:
            yield f"  {name}() = default;"
        else:
            yield from self._constructor(parts, parts.init)
        yield from self._methods(parts)
        for member, kind in parts.members:
            yield f"  {kind} {member}{'' if member in parts.started else '{}'};"
        if self.program.pairs:  # of translated laws; whoever knows more names adds theirs
            yield "  m::Pairs pairs{std::begin(k_pairs), std::end(k_pairs)};"
        yield "};"
        signature = self.program.functions[name]
        if signature.names == ["gains", "limits", "d0_m"]:
            self._laws.append((name, signature.types[0]))

    def _constructor(self, parts: ClassParts, init: ast.FunctionDef) -> Iterator[str]:
        """Yield the constructor: members first, then the calls of methods that give values to the rest."""
        signature = self.program.functions[parts.node.name]
        known = dict(zip(signature.names, signature.types, strict=True))
        scope = Scope(self.program, parts.methods, signature.names)
        starts, calls = [], []
        for node in init.body:
            if isinstance(node, ast.Expr):
                if is_a_method_call(node.value):
                    calls.append(node.value)
                continue
            if calls:
                raise NotUnderstoodError(f"line {node.lineno}: {ast.unparse(node)} after a call")
            pairs: list[tuple[ast.expr, ast.expr | None]]
            if isinstance(node, ast.AnnAssign):
                pairs = [(node.target, node.value)]
            elif isinstance(node, ast.Assign):
                pairs = [*self._pairs(node)]
            else:
                raise NotUnderstoodError(f"line {node.lineno}: {ast.unparse(node)}")
            for target, value in pairs:
                assert isinstance(target, ast.Attribute)
                assert value is not None
                parts.members.append((target.attr, self._kind(value, known)))
                parts.started.add(target.attr)
                starts.append(f"{target.attr}({scope.of(value)})")
        first = f"\n      : {', '.join(starts)}" if starts else ""
        for call in calls:
            self._given_by(is_a_method_call(call), parts, set())
        rest = " ".join(f"{scope.of(call)};" for call in calls)
        inside = ", ".join(self._parameters(signature, defaults=True))
        yield f"  explicit {parts.node.name}({inside}){first} {{ {rest} }}"

    def _given_by(self, method: str, parts: ClassParts, seen: set[str]) -> None:
        """Add the members that a method of the constructor, and those it calls, give their first values."""
        if method in seen or method not in parts.methods:
            return
        seen.add(method)
        (body,) = (f for f in parts.bodies if f.name == method)
        signature = parts.methods[method]
        known = dict(zip(signature.names, signature.types, strict=True))
        for node in ast.walk(body):
            self._given_by(is_a_method_call(node), parts, seen)
            if not isinstance(node, ast.Assign):
                continue
            for target in node.targets:
                for one, value in self._pairs(ast.Assign([target], node.value)):
                    match one:
                        case ast.Attribute(value=ast.Name(id="self"), attr=attr) if (
                            attr not in dict(parts.members)
                        ):
                            parts.members.append((attr, self._kind(value, known)))

    def _kind(self, value: ast.expr, known: Mapping[str, str]) -> str:  # noqa: PLR0911 - one a kind of node
        """Return the type of a value that a constructor keeps."""
        match value:
            case ast.Constant(value=bool()):
                return "bool"
            case ast.Constant(value=float()):
                return "double"
            case ast.Tuple(elts=[*elts]):
                kinds = [self._kind(one, known) for one in elts]
                return "Vec2" if kinds == ["double"] * 2 else f"std::tuple<{', '.join(kinds)}>"
            case ast.Call(func=ast.Attribute(value=ast.Name(id="control"), attr="AsgIsm")):
                return "AsgBlock"
            case ast.Dict():
                return "Trace"
            case ast.Name(id=name):
                return known.get(name) or self.program.constants[name]
            case ast.Call(func=ast.Attribute(value=ast.Name(id="math"))):
                return "double"
            case ast.Call(func=ast.Name(id=name)) if name in self.program.mutable:
                return name
            case ast.Call(func=ast.Name(id=name)) if name in self.program.functions:
                signature = self.program.functions[name]
                return name if signature.is_struct else signature.returns
            case ast.Attribute(value=ast.Name(id=name), attr=attr) if name in known:
                owner = self.program.functions[known[name]]
                return owner.types[owner.names.index(attr)]
            case _:
                raise NotUnderstoodError(f"the type of {ast.unparse(value)}")

    def _methods(self, parts: ClassParts) -> Iterator[str]:
        for node in parts.bodies:
            signature = parts.methods[node.name]
            head = self._head(node, signature, defaults=True)
            ends = " override" if parts.interface and node.name in ("reset", "step", "at") else ""
            yield f"  {'static ' if is_static(node) else ''}{head}{ends} {{"
            scope = Scope(self.program, parts.methods, signature.names, dict(parts.members))
            yield from scope.block(node.body, "    ")
            yield "  }"

    def _head(self, node: ast.FunctionDef, signature: Signature, *, defaults: bool) -> str:
        inside = ", ".join(self._parameters(signature, defaults=defaults))
        # A function of a header, but for methods, which are in their class.
        before = "" if node.args.args[:1] and node.args.args[0].arg == "self" else "inline "
        kinds = [kind for kind in signature.types if kind in self.program.protocols]
        any_of = f"template <{', '.join(f'typename {kind}' for kind in kinds)}>\n" if kinds else ""
        return (
            f"{any_of}{'' if is_static(node) else before}{signature.returns} {node.name}({inside})"
        )

    def _parameters(self, signature: Signature, *, defaults: bool) -> Iterator[str]:
        scope = Scope(self.program, {}, ())
        for name, kind in zip(signature.names, signature.types, strict=True):
            default = signature.defaults.get(name) if defaults else None
            ends = f" = {scope.of(default)}" if default is not None else ""
            yield f"[[maybe_unused]] {passed(kind, self.program.mutable)} {name}{ends}"
