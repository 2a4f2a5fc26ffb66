"""The bodies of functions: statements and expressions as C++."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping, Sequence

from hil.core.to_cpp.kinds import NotUnderstoodError, Program, Signature, cpp_name

_OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.BitOr: "|"}
_COMPARISONS = {
    ast.Eq: "==", ast.NotEq: "!=", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=",
}  # fmt: skip


class Scope:
    """Translates the body of one function."""

    def __init__(
        self,
        program: Program,
        methods: Mapping[str, Signature],
        names: Iterable[str],
        members: Mapping[str, str] | None = None,
    ) -> None:
        self._program = program
        self._methods = methods
        self._members = members or {}  # of the object: their types
        self._known = [set(names)]
        self._made = 0

    # -- statements ----------------------------------------------------------------------------

    def block(self, body: Sequence[ast.stmt], indent: str) -> Iterator[str]:
        """Yield the lines of a block."""
        self._known.append(set())
        for statement in body:
            yield from (indent + line for line in self._statement(statement, indent))
        self._known.pop()

    def _statement(self, node: ast.stmt, indent: str) -> Iterator[str]:  # noqa: PLR0912 - one a kind of node
        match node:
            case ast.Expr(value=ast.Constant()):
                return
            case ast.Expr(value=value):
                yield f"{self.of(value)};"
            case ast.Return(value=None):
                yield "return;"
            case ast.Return(value=value):
                assert value is not None
                yield f"return {self.of(value)};"
            case ast.Assign(
                targets=[ast.Name(id=name)], value=ast.Subscript(slice=ast.Call()) as value
            ):
                self._known[-1].add(name)
                yield f"const auto& {name} = {self.of(value)};"
            case ast.Assign(targets=[target], value=value):
                yield from self._assign(target, value)
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    yield from self._assign(target, value)
            case ast.AugAssign(target=target, op=op, value=value):
                yield f"{self.of(target)} {_OPERATORS[type(op)]}= {self.of(value)};"
            case ast.If(test=test, body=body, orelse=orelse):
                yield f"if ({self.of(test)}) {{"
                yield from (line.removeprefix(indent) for line in self.block(body, indent + "  "))
                if orelse:
                    yield "} else {"
                    yield from (
                        line.removeprefix(indent) for line in self.block(orelse, indent + "  ")
                    )
                yield "}"
            case ast.For(
                target=ast.Name(id=name),
                iter=ast.Call(func=ast.Name(id="range"), args=[end]),
                body=body,
            ):
                yield f"for (int {name} = 0; {name} < {self.of(end)}; ++{name}) {{"
                yield from (line.removeprefix(indent) for line in self.block(body, indent + "  "))
                yield "}"
            case ast.For(
                target=ast.Tuple(elts=[*targets]),
                iter=ast.Call(func=ast.Name(id="zip"), args=over, keywords=[strict]),
            ) if ast.unparse(strict) == "strict=True" and len(targets) == len(over):
                yield from self._each(node, targets, over, indent)
            case ast.For(target=ast.Name() as target, iter=ast.Attribute() as one):
                yield from self._each(node, [target], [one], indent)
            case ast.For(
                target=ast.Tuple(elts=[ast.Name(id=one), ast.Name(id=other)]),
                iter=ast.Call(
                    func=ast.Name(id=pairs),
                    args=[ast.Call(func=ast.Name(id="tuple"), args=[ast.Name(id=trace)])],
                ),
                body=body,
            ) if pairs == self._program.pairs:
                yield f"for (const auto& [{one}, {other}] : this->pairs) {{"
                yield f"  if (!{trace}.has({one}) || !{trace}.has({other})) continue;"
                yield from (line.removeprefix(indent) for line in self.block(body, indent + "  "))
                yield "}"
            case _:
                raise NotUnderstoodError(f"line {node.lineno}: {ast.unparse(node)}")

    def _each(
        self, loop: ast.For, targets: Sequence[ast.expr], over: Sequence[ast.expr], indent: str
    ) -> Iterator[str]:
        """Yield a loop over the entries of tuples, which are those entries themselves."""
        names = [target.id for target in targets if isinstance(target, ast.Name)]
        inside = [node for statement in loop.body for node in ast.walk(statement)]
        leaves = any(isinstance(n, ast.Return | ast.Break | ast.Continue) for n in inside)
        changed = {n.id for n in inside if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        if len(names) < len(targets) or leaves or changed & set(names) or loop.orelse:
            raise NotUnderstoodError(f"line {loop.lineno}: {ast.unparse(loop)}")
        heads = ", ".join(f"[[maybe_unused]] auto&& {cpp_name(name)}" for name in names)
        yield f"m::each([&]({heads}) {{"
        yield from (line.removeprefix(indent) for line in self.block(loop.body, indent + "  "))
        yield f"}}, {', '.join(map(self.of, over))});"

    def _is_shared(self, value: ast.expr) -> bool:
        """Say whether a value is a part of the object with a state: another name for it is no copy."""
        match value:
            case ast.Attribute(value=ast.Name(id="self"), attr=attr):
                kind = self._members.get(attr, "")
                return any(
                    name in kind.replace("<", " ").replace(",", " ").replace(">", " ").split()
                    for name in self._program.mutable
                )
        return False

    def _assign_shared(self, target: ast.expr, value: ast.expr) -> Iterator[str]:
        """Yield new names for such a part, or for the entries of a tuple of them."""
        entries = target.elts if isinstance(target, ast.Tuple) else [target]
        whole = self.of(value)
        for place, entry in enumerate(entries):
            known = isinstance(entry, ast.Name) and any(entry.id in names for names in self._known)
            if not isinstance(entry, ast.Name) or known:
                raise NotUnderstoodError(
                    f"line {target.lineno}: {ast.unparse(target)} for a second name"
                )
            self._known[-1].add(entry.id)
            part = f"m::item<{place}>({whole})" if isinstance(target, ast.Tuple) else whole
            yield f"[[maybe_unused]] auto& {cpp_name(entry.id)} = {part};"

    def _assign(self, target: ast.expr, value: ast.expr) -> Iterator[str]:
        if self._is_shared(value):
            yield from self._assign_shared(target, value)
            return
        if isinstance(target, ast.Tuple):
            if isinstance(value, ast.Tuple) and len(value.elts) == len(target.elts):
                if any(map(self._is_shared, value.elts)):
                    raise NotUnderstoodError(
                        f"line {value.lineno}: {ast.unparse(value)} among others"
                    )
                # Python works out every value before it assigns one.
                made = [self._fresh() for _ in value.elts]
                for name, element in zip(made, value.elts, strict=True):
                    yield f"const auto {name} = {self.of(element)};"
                for element, name in zip(target.elts, made, strict=True):
                    yield from self._assign_text(element, name)
                return
            yield from self._unpack(target, self.of(value))
            return
        yield from self._assign_text(target, self.of(value))

    def _assign_text(self, target: ast.expr, text: str) -> Iterator[str]:
        match target:
            case ast.Name(id="_"):
                yield f"static_cast<void>({text});"
            case ast.Name(id=name) if any(name in names for names in self._known):
                yield f"{name} = {text};"
            case ast.Name(id=name):
                self._known[-1].add(name)
                yield f"auto {name} = {text};"
            case ast.Attribute():
                yield f"{self.of(target)} = {text};"
            case ast.Subscript(value=value, slice=ast.Name(id=key)):
                yield f"{self.of(value)}.set({key}, {text});"
            case ast.Tuple():
                yield from self._unpack(target, text)
            case _:
                raise NotUnderstoodError(ast.unparse(target))

    def _unpack(self, target: ast.Tuple, text: str) -> Iterator[str]:
        whole = self._fresh()
        yield f"const auto {whole} = {text};"
        for place, element in enumerate(target.elts):
            if isinstance(element, ast.Name) and element.id == "_":
                continue
            yield from self._assign_text(element, f"m::item<{place}>({whole})")

    def _fresh(self) -> str:
        self._made += 1
        return f"made{self._made}"

    # -- expressions ---------------------------------------------------------------------------

    def of(self, node: ast.expr) -> str:  # noqa: PLR0911, PLR0912 - one a kind of node
        """Return an expression."""
        match node:
            case ast.Constant(value=None):
                return "m::None{}"
            case ast.Constant(value=bool() as value):
                return "true" if value else "false"
            case ast.Constant(value=str() as value):
                return f'"{value}"'
            case ast.Constant(value=int() | float() as value):
                return repr(value)
            case ast.Name(id=name):
                return cpp_name(name)
            case ast.Attribute(value=ast.Name(id="self"), attr=attr):
                return f"this->{attr}"
            case ast.Attribute(value=ast.Name(id="math"), attr=attr):
                return f"m::{attr}"
            case ast.Attribute(value=value, attr=attr):
                return f"{self.of(value)}.{attr}"
            case ast.Subscript(value=value, slice=ast.Constant(value=int() as place)):
                return f"m::item<{place}>({self.of(value)})"
            case ast.Subscript(value=value, slice=place):
                return f"m::element({self.of(value)}, {self.of(place)})"
            case ast.Tuple(elts=elts):
                return f"m::tup({', '.join(map(self.of, elts))})"
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return f"(-{self.of(operand)})"
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return f"(!{self.of(operand)})"
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                return f"m::power({self.of(left)}, {self.of(right)})"
            case ast.BinOp(left=left, op=ast.Div(), right=right):
                return f"m::quotient({self.of(left)}, {self.of(right)})"
            case ast.BinOp(left=ast.List(elts=[one]), op=ast.Mult(), right=ast.Constant(value=2)):
                return f"m::both({self.of(one)})"
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
                return f"({self.of(left)} {_OPERATORS[type(op)]} {self.of(right)})"
            case ast.BoolOp(op=op, values=values):
                word = " && " if isinstance(op, ast.And) else " || "
                return f"({word.join(map(self.of, values))})"
            case ast.Compare(left=left, ops=[ast.Is()], comparators=[ast.Constant(value=None)]):
                return f"m::is_none({self.of(left)})"
            case ast.Compare(left=left, ops=[op], comparators=[right]):
                return f"({self.of(left)} {_COMPARISONS[type(op)]} {self.of(right)})"
            case ast.IfExp(test=test, body=body, orelse=orelse):
                return f"({self.of(test)} ? {self.of(body)} : {self.of(orelse)})"
            case ast.List(elts=[one]):
                return f"m::both({self.of(one)})"
            case ast.ListComp(elt=one, generators=[loop]):
                return self._listed(one, loop)
            case ast.Call(
                func=ast.Name(id="tuple"), args=[ast.GeneratorExp(elt=one, generators=[loop])]
            ):
                return self._listed(one, loop)
            case ast.Dict():
                return self._trace(node)
            case ast.Call():
                return self._call(node)
            case _:
                raise NotUnderstoodError(f"line {node.lineno}: {ast.unparse(node)}")

    def _listed(self, one: ast.expr, loop: ast.comprehension) -> str:
        """Return so many values as a tuple, made in order; a list of them is not changed afterwards."""
        match loop:
            case ast.comprehension(
                target=ast.Name(id=name),
                iter=ast.Call(func=ast.Name(id="range"), args=[ast.Constant(value=int() as count)]),
                ifs=[],
            ):
                return f"m::listed<{count}>([&](int {name}) {{ return {self.of(one)}; }})"
        raise NotUnderstoodError(f"line {one.lineno}: {ast.unparse(one)} {ast.unparse(loop)}")

    def _trace(self, node: ast.Dict) -> str:
        text = "Trace{}"
        for key, value in zip(node.keys, node.values, strict=True):
            if key is None:
                text = f"({text} | {self.of(value)})"
                continue
            assert isinstance(key, ast.Constant)
            name = str(key.value)
            if name not in self._program.keys:
                self._program.keys.append(name)
            text += f".with({self._program.keys.index(name)}, {self.of(value)})"
        return text

    def _call(self, node: ast.Call) -> str:  # noqa: PLR0911 - one a kind of call
        match node.func:
            case ast.Attribute(value=ast.Name(id="math"), attr="hypot") if isinstance(
                node.args[0], ast.Starred
            ):
                both = self.of(node.args[0].value)
                return f"m::hypot(m::item<0>({both}), m::item<1>({both}))"
            case ast.Attribute(value=ast.Name(id="control"), attr="AsgIsm"):
                values = {word.arg: self.of(word.value) for word in node.keywords}
                fields = " ".join(f"g.{name} = {value};" for name, value in values.items())
                return f"AsgBlock([&] {{ AsgBlock::Gains g; {fields} return g; }}())"
            case ast.Attribute(value=ast.Name(id="self"), attr=attr):
                return f"this->{attr}({self._arguments(node, self._methods.get(attr))})"
            case ast.Attribute(value=value, attr="_replace"):
                return self._replaced(value, node)
            case ast.Attribute():
                return f"{self.of(node.func)}({self._arguments(node, None)})"
            case ast.Name(id=name) if name in self._program.functions:
                signature = self._program.functions[name]
                inside, whole = self._arguments(node, signature), self._program.owners[name] + name
                return f"{whole}{{{inside}}}" if signature.is_struct else f"{whole}({inside})"
            case ast.Name(id="dict"):
                return f"Trace({self.of(node.args[0])})"
            case ast.Name(id="replace"):
                return self._replaced(node.args[0], node)
            case ast.Name(id="float"):
                return f"static_cast<double>({self.of(node.args[0])})"
            case ast.Name(id="abs" | "max" | "min" | "len" | "bisect_right" as name):
                return f"m::{name}({', '.join(map(self.of, node.args))})"
            case _:
                raise NotUnderstoodError(f"line {node.lineno}: {ast.unparse(node)}")

    def _replaced(self, value: ast.expr, node: ast.Call) -> str:
        changed = " ".join(f"made.{w.arg} = {self.of(w.value)};" for w in node.keywords)
        return f"[&] {{ auto made = {self.of(value)}; {changed} return made; }}()"

    def _arguments(self, node: ast.Call, signature: Signature | None) -> str:
        values = list(node.args)
        if node.keywords:
            if signature is None:
                raise NotUnderstoodError(f"line {node.lineno}: {ast.unparse(node)}")
            given = {word.arg: word.value for word in node.keywords}
            for name in signature.names[len(values) :]:
                value = given.pop(name, None) or signature.defaults.get(name)
                if value is None:
                    raise NotUnderstoodError(f"line {node.lineno}: {name} of {ast.unparse(node)}")
                values.append(value)
        return ", ".join(map(self.of, values))
