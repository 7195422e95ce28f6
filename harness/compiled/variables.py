"""Variables that are something else in Python than when compiled.

One that is read before it has a value: Python raises there, a compiled function reads a zero. One that is a whole
number here and a float there: compiled it is a float throughout, and minus zero is not zero.
"""

import ast
from collections.abc import Iterator, Sequence

_LEAVES = (ast.Return, ast.Raise, ast.Break, ast.Continue)


def unbound(body: Sequence[ast.stmt], local: set[str], arguments: set[str]) -> str:
    """The first of the local variables that may be read before it has a value; empty where each has one.

    A loop counts as one that may have no turns, and each branch as one that may be taken.
    """
    found = _Reading(local)
    found.after(body, frozenset(arguments))
    return found.unbound


def mixed(body: Sequence[ast.stmt]) -> str:
    """The first variable, or choice, that is a whole number here and another there; empty where there is none."""
    given: dict[str, list[ast.expr]] = {}
    for node in (node for statement in body for node in ast.walk(statement)):
        match node:
            case ast.Assign(targets=[*targets], value=value):
                for target in targets:
                    for name, of in _pairs(target, value):
                        given.setdefault(name, []).append(of)
            case ast.AnnAssign(target=ast.Name(id=name), value=ast.expr() as value):
                given.setdefault(name, []).append(value)
            case ast.NamedExpr(target=ast.Name(id=name), value=value):
                given.setdefault(name, []).append(value)
            case ast.AugAssign(target=ast.Name(id=name) as target, op=op, value=value):
                given.setdefault(name, []).append(ast.BinOp(ast.Name(name, ast.Load()), op, value))
            case ast.For(target=ast.Name(id=name), iter=ast.Call(func=ast.Name(id="range"))):
                given.setdefault(name, []).append(ast.Constant(0))
    whole = set[str]()  # somewhere
    while more := {name for name in given if any(_is_whole(of, whole) for of in given[name])} - whole:
        whole |= more
    for name in sorted(whole):
        if not all(_is_whole(of, whole) for of in given[name]):
            return name
    for node in (node for statement in body for node in ast.walk(statement)):
        if isinstance(node, ast.IfExp) and _is_whole(node.body, whole) is not _is_whole(node.orelse, whole):
            return ast.unparse(node)
    return ""


def _pairs(target: ast.expr, value: ast.expr) -> Iterator[tuple[str, ast.expr]]:
    """The variables of an assignment, each with its value."""
    if isinstance(target, ast.Name):
        yield target.id, value
    elif isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple) and len(target.elts) == len(value.elts):
        for each, of in zip(target.elts, value.elts, strict=True):
            yield from _pairs(each, of)


def _is_whole(node: ast.expr, whole: set[str]) -> bool:
    """Whether an expression is a whole number, where these variables are."""
    match node:
        case ast.Constant(value=value):
            return type(value) is int
        case ast.Name(id=name):
            return name in whole
        case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=of):
            return _is_whole(of, whole)
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.Mult() | ast.FloorDiv() | ast.Mod(), right=right):
            return _is_whole(left, whole) and _is_whole(right, whole)
        case ast.IfExp(body=one, orelse=other):
            return _is_whole(one, whole) and _is_whole(other, whole)
        case ast.Call(func=ast.Name(id="len")):
            return True
    return False


class _Reading:
    """A function read from its first statement to its last."""

    def __init__(self, local: set[str]) -> None:
        self.local, self.unbound = local, ""

    def after(self, body: Sequence[ast.stmt], bound: frozenset[str]) -> frozenset[str] | None:
        """The variables that have a value after these statements; None where nothing comes after them."""
        for statement in body:
            match statement:
                case ast.If(test=test):
                    self._reads(test, bound)
                    bound |= _stored(test)
                    ways = [self.after(way, bound) for way in (statement.body, statement.orelse)]
                    going_on = [way for way in ways if way is not None]
                    if not going_on:
                        return None
                    bound = frozenset.intersection(*going_on)
                case ast.For(iter=of) | ast.While(test=of):
                    self._reads(of, bound)
                    inside = bound | (_stored(statement.target) if isinstance(statement, ast.For) else _stored(of))
                    self.after(statement.body, inside)
                    self.after(statement.orelse, bound)
                case ast.AnnAssign(value=None):
                    pass
                case _:
                    self._reads(statement, bound)
                    if isinstance(statement, _LEAVES):
                        return None
                    bound |= _stored(statement)
        return bound

    def _reads(self, node: ast.AST, bound: frozenset[str]) -> None:
        for name in _read(node):
            if name in self.local - bound:
                self.unbound = self.unbound or name


def _read(node: ast.AST, own: frozenset[str] = frozenset()) -> Iterator[str]:
    """What is read in a statement, but for the variables of a comprehension, its `own`."""
    if isinstance(node, ast.ListComp | ast.SetComp | ast.DictComp):
        own |= {x.id for each in node.generators for x in ast.walk(each.target) if isinstance(x, ast.Name)}
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id not in own:
        yield node.id
    elif isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
        yield node.target.id
    for child in ast.iter_child_nodes(node):
        yield from _read(child, own)


def _stored(node: ast.AST) -> frozenset[str]:
    """What gets a value in a statement; the variables of a comprehension do not outlive it."""
    own = {id(x) for each in ast.walk(node) if isinstance(each, ast.comprehension) for x in ast.walk(each.target)}
    names = (x for x in ast.walk(node) if isinstance(x, ast.Name) and isinstance(x.ctx, ast.Store))
    return frozenset(name.id for name in names if id(name) not in own)
