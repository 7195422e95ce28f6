"""A closure of pure functions, lifted into a module that Numba compiles and into the numbers that the closure holds.

A law in flight is a function within functions: it holds gains, and other functions that hold theirs. In the lifted
module each of them stands at the top and gets what it held as one more argument, a tuple. So laws that differ in
numbers alone share one module. The text of each function is that of its own file, unchanged but for this, and for
arithmetic that the compiler would do otherwise (`arithmetic`).
"""

import ast
import builtins
import copy
import math
from types import FunctionType, ModuleType
from typing import Any, NamedTuple, cast

from autopilot.guidance import Guidance, Telling, telling
from autopilot.response import dot
from harness.compiled.closure import Closure, NotLiftedError, Shape, closure_of, held, is_record
from harness.compiled.source import node_of
from harness.compiled.variables import mixed, unbound

_BUILTINS = {"abs", "len", "range", "float", "int", "bool", "enumerate", "zip"}
_ARITHMETIC = {
    getattr(math, name): name
    for name in (
        "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "expm1", "log", "log1p", "sqrt",
        "atan2", "copysign", "remainder", "fmod", "hypot", "isfinite", "isnan", "radians", "degrees",
    )
} | {math.pow: "power", dot: "dot", sum: "added"}  # fmt: skip
_OURS = "jit(forceinline=True)"
_OWN = "jit(_nrt=True)"  # a law of one's own may make lists: references are counted there
_REFUSED = {
    ast.Nonlocal: "it keeps a variable from one call to the next",
    ast.Global: "it changes a variable of its module",
    ast.FunctionDef: "it defines a function within",
    ast.Lambda: "it defines a function within",
    ast.GeneratorExp: "it has a generator within",
    ast.Yield: "it is a generator",
    ast.Try: "it catches errors",
    ast.With: "it has a context manager",
}


class Module(NamedTuple):
    """A lifted module."""

    text: str  # without its first lines
    name: str  # of the function in it
    told: tuple[str, ...]  # the names of the channels that a law tells


def module_of(function: Any) -> Module:
    """The lifted module of a function. Raises `NotLiftedError`."""
    lifting = _Lifting()
    name = lifting.function(function)
    if lifting.told and lifting.is_mirrored:
        raise NotLiftedError("it is mirrored, and tells channels of its own")
    return Module("\n\n".join(lifting.texts) + "\n", name, lifting.told or ())


class _Lifting:
    """A module in the making."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self.told: tuple[str, ...] | None = None
        self.is_mirrored = False
        self._names: dict[Shape, str] = {}

    def function(self, function: Any) -> str:
        """The name in the module of a function."""
        shape, _ = held(function)
        if shape not in self._names:
            of = closure_of(function)
            node = node_of(of.function.__code__)
            name = self._names[shape] = f"f{len(self._names)}_{_plain(of.function.__name__)}"
            self.texts.append(_Writer(self, of, node, shape).text(name))
        return self._names[shape]

    def record(self, name: str, names: tuple[str, ...]) -> str:
        """The name in the module of a named tuple."""
        key = ("record", name, names)
        if key not in self._names:
            self._names[key] = f"r{len(self._names)}_{_plain(name)}"
            self.texts.append(f"{self._names[key]} = namedtuple({name!r}, {list(names)!r})")
        return self._names[key]

    def telling(self, names: tuple[str, ...]) -> str:
        """The name in the module of the function that adds channels to an answer."""
        of = [*Guidance._fields, *(f"law_{name}" for name in names)]
        key = ("telling", *names)
        if key not in self._names:
            record, name = self.record("Telling", tuple(of)), f"t{len(self._names)}"
            values = [f"g.{field}" for field in Guidance._fields] + of[len(Guidance._fields) :]
            arguments = ", ".join(["g", *of[len(Guidance._fields) :]])
            self.texts.append(f"@jit\ndef {name}({arguments}):\n    return {record}({', '.join(values)})")
            self._names[key] = name
        return self._names[key]


class _Writer(ast.NodeTransformer):
    """Writes one function of the module."""

    def __init__(self, lifting: _Lifting, of: Closure, node: ast.FunctionDef | ast.Lambda, shape: Shape) -> None:
        self._lifting, self._of, self._node = lifting, of, copy.deepcopy(node)
        self._kinds = {name: tuple(kind) for name, *kind in shape[1:]}
        code = of.function.__code__
        self._local = {*code.co_varnames, *code.co_cellvars} - set(self._kinds)
        for each in ast.walk(self._node):
            if isinstance(each, ast.comprehension):
                self._local |= {one.id for one in ast.walk(each.target) if isinstance(one, ast.Name)}
        self._records = {}  # the named tuple that a parameter is annotated with, by its name
        for argument in self._node.args.args:
            of_type = self._looked_up(argument.annotation)
            if is_record(of_type):
                self._records[argument.arg] = of_type

    def text(self, name: str) -> str:
        """The function's text. Raises `NotLiftedError`."""
        node, arguments = self._node, self._node.args
        if arguments.vararg or arguments.kwarg or arguments.kwonlyargs or arguments.defaults:
            raise NotLiftedError(f"{self._of.function.__name__} has other arguments than plain ones")
        body: list[ast.stmt] = [ast.Return(node.body)] if isinstance(node, ast.Lambda) else node.body
        for statement in body:
            for inner in ast.walk(statement):
                if why := _REFUSED.get(type(inner)):
                    raise NotLiftedError(f"{self._of.function.__name__}: {why}")
        if variable := unbound(body, self._local, {a.arg for a in [*arguments.posonlyargs, *arguments.args]}):
            raise NotLiftedError(f"{self._of.function.__name__}: {variable} may be without a value")
        if variable := mixed(body):
            raise NotLiftedError(
                f"{self._of.function.__name__}: {variable} is a whole number here and a float there: write 0.0 for 0"
            )
        names = [a.arg for a in [*arguments.posonlyargs, *arguments.args] if a.arg not in self._kinds]
        lines: list[str] = []
        if kept := self._kept():
            names.append("held_")
            lines.append(f"    ({', '.join(kept)},) = held_")
        for each, kind in self._kinds.items():
            if kind[0] == "record":
                lines.append(f"    {each} = {self._lifting.record(kind[1], kind[2])}(*{each}_)")
        for statement in body:
            made = self.visit(statement)
            for one in made if isinstance(made, list) else [made] if made else []:
                text = ast.unparse(ast.fix_missing_locations(one))
                lines += [f"    {line}" for line in text.splitlines()]
        decorator = _OURS if _is_ours(self._of.function) else _OWN
        return f"@{decorator}\ndef {name}({', '.join(names)}):\n" + "\n".join(lines or ["    pass"])

    def _kept(self) -> list[str]:
        """The names of the values in `held_`, in their order."""
        names = []
        for name, kind in self._kinds.items():
            if kind[0] in ("number", "tuple"):
                names.append(name)
            elif kind[0] == "record" or (kind[0] == "function" and self._needs(kind[1])):
                names.append(f"{name}_")
        return names

    @staticmethod
    def _needs(shape: Shape) -> bool:
        """Whether a function of this shape holds any number."""
        return any(
            k[0] in ("number", "tuple", "record") or (k[0] == "function" and _Writer._needs(k[1]))
            for _, *k in shape[1:]
        )

    # what names stand for

    def _looked_up(self, node: ast.expr | None) -> Any:
        """The object that an expression means before the flight; `_UNKNOWN` for one of the flight."""
        if isinstance(node, ast.Name):
            if node.id in self._local:
                return _UNKNOWN
            if node.id in self._kinds:
                return self._of.held[node.id]
            space = self._of.function.__globals__
            return space.get(node.id, getattr(builtins, node.id, _UNKNOWN))
        if isinstance(node, ast.Attribute):
            owner = self._looked_up(node.value)
            if isinstance(owner, ModuleType | type):
                return getattr(owner, node.attr, _UNKNOWN)
        return _UNKNOWN

    def _constant(self, value: Any) -> ast.expr:
        """What stands in the module for an object that is known before the flight."""
        if value is None or isinstance(value, str | bool | int):
            return ast.Constant(value)
        if isinstance(value, float):
            return (
                ast.Constant(value)
                if math.isfinite(value)
                else _arithmetic({math.inf: "inf", -math.inf: "minus_inf"}.get(value, "nan"))
            )
        if isinstance(value, tuple) and not is_record(type(value)):
            return ast.Tuple([self._constant(x) for x in value], ast.Load())
        if is_record(value):
            return _name(self._lifting.record(value.__name__, value._fields))
        if value in _ARITHMETIC:
            return _arithmetic(_ARITHMETIC[value])
        if isinstance(value, FunctionType) and not self._needs(held(value)[0]):
            return _name(self._lifting.function(value))
        name = getattr(value, "__name__", "")
        is_error = isinstance(value, type) and issubclass(value, BaseException)
        is_builtin = name in _BUILTINS and (name != "int" or _is_ours(self._of.function))  # without an end in Python
        if getattr(builtins, name, None) is value and (is_builtin or is_error):
            return _name(name)
        raise NotLiftedError(f"{self._of.function.__name__} uses {getattr(value, '__name__', value)!r}")

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id in self._local or not isinstance(node.ctx, ast.Load):
            return node
        if node.id in self._kinds and self._kinds[node.id][0] != "constant":
            if self._kinds[node.id][0] == "function":
                raise NotLiftedError(f"{self._of.function.__name__} hands on the function {node.id}")
            return node
        return self._constant(self._known(node))

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        if (value := self._looked_up(node)) is not _UNKNOWN:
            return self._constant(value)
        self.generic_visit(node)
        return node

    def _known(self, node: ast.Name) -> Any:
        value = self._looked_up(node)
        if value is _UNKNOWN:
            raise NotLiftedError(f"{self._of.function.__name__} uses {node.id}")
        return value

    def visit_Call(self, node: ast.Call) -> ast.expr:
        called = node.func
        if isinstance(called, ast.Attribute) and called.attr == "_replace" and isinstance(called.value, ast.Name):
            return self._replaced(called.value, node)
        what = self._looked_up(called)
        if what is isinstance and self._looked_up(node.args[1]) is Telling:
            self._lifting.is_mirrored = True
            return ast.Constant(False)
        if what is telling:
            return self._telling(node)
        if (what is min or what is max) and len(node.args) > 1 and not node.keywords:
            name = "smaller" if what is min else "larger"
            first, *rest = [self.visit(argument) for argument in node.args]
            for each in rest:
                first = ast.Call(_arithmetic(name), [first, each], [])
            return cast(ast.expr, first)
        if record := _is_made(what):
            (of,) = node.args
            values: list[ast.expr] = of.elts if isinstance(of, ast.Tuple) else [ast.Starred(of, ast.Load())]
            return self._record(record, values, [])
        if is_record(what):
            return self._record(what, node.args, node.keywords)
        if node.keywords:
            raise NotLiftedError(f"{self._of.function.__name__} names arguments in a call")
        arguments = [self.visit(argument) for argument in node.args]
        if isinstance(called, ast.Name) and self._kinds.get(called.id, ("",))[0] == "function":
            if self._needs(self._kinds[called.id][1]):
                arguments.append(_name(f"{called.id}_"))
            return ast.Call(_name(self._lifting.function(self._of.held[called.id])), arguments, [])
        return ast.Call(self.visit(called), arguments, [])

    def _record(self, record: Any, values: list[ast.expr], named: list[ast.keyword]) -> ast.expr:
        """A named tuple, with its defaults written out."""
        name = _name(self._lifting.record(record.__name__, record._fields))
        made = [self.visit(value) for value in values]
        if any(isinstance(value, ast.Starred) for value in made):
            return ast.Call(name, made, [])
        by_name = {one.arg: self.visit(one.value) for one in named}
        for field in record._fields[len(made) :]:
            if field not in by_name and field not in record._field_defaults:
                raise NotLiftedError(f"{self._of.function.__name__} leaves out {field} of {record.__name__}")
            made.append(by_name[field] if field in by_name else self._constant(record._field_defaults[field]))
        if record is Guidance:
            made = [ast.Call(_name("float"), [value], []) for value in made]
        return ast.Call(name, made, [])

    def _telling(self, node: ast.Call) -> ast.expr:
        """An answer with channels, as a named tuple of both."""
        names = tuple(one.arg or "" for one in node.keywords)
        if self._lifting.told not in (None, names) or "" in names:
            raise NotLiftedError(f"{self._of.function.__name__} tells now these channels, now others")
        self._lifting.told = names
        told: list[ast.expr] = [ast.Call(_name("float"), [self.visit(one.value)], []) for one in node.keywords]
        return ast.Call(_name(self._lifting.telling(names)), [self.visit(node.args[0]), *told], [])

    def _replaced(self, what: ast.Name, node: ast.Call) -> ast.expr:
        """`_replace` of a parameter that is annotated with its named tuple."""
        if what.id not in self._records:
            raise NotLiftedError(f"{self._of.function.__name__}: what {what.id} is, is not annotated")
        record = self._records[what.id]
        new = {one.arg: one.value for one in node.keywords}
        values = [new.get(f, ast.Attribute(what, f, ast.Load())) for f in record._fields]
        return self._record(record, values, [])

    # what is written otherwise

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        if isinstance(node.op, ast.Pow):
            return ast.Call(_arithmetic("power"), [node.left, node.right], [])
        return node

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.stmt:
        """`x **= y` as `x = x ** y`."""
        if isinstance(node.op, ast.Pow) and isinstance(node.target, ast.Name):
            return ast.Assign([node.target], self.visit(ast.BinOp(_name(node.target.id), node.op, node.value)))
        self.generic_visit(node)
        return node

    def visit_Tuple(self, node: ast.Tuple) -> ast.expr:
        self.generic_visit(node)
        if not any(isinstance(one, ast.Starred) for one in node.elts) or not isinstance(node.ctx, ast.Load):
            return node
        parts: list[ast.expr] = []
        for one in node.elts:
            if isinstance(one, ast.Starred):
                parts.append(one.value)
            elif parts and isinstance(parts[-1], ast.Tuple):
                parts[-1].elts.append(one)
            else:
                parts.append(ast.Tuple([one], ast.Load()))
        first, *rest = parts
        for part in rest:
            first = ast.BinOp(first, ast.Add(), part)
        return first

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.stmt | None:
        return ast.Assign([node.target], self.visit(node.value)) if node.value else None

    def visit_If(self, node: ast.If) -> Any:
        test = self._test(node.test)
        if isinstance(test, ast.Constant):
            return [made for one in (node.body if test.value else node.orelse) for made in _listed(self.visit(one))]
        node.test = test
        node.body = [made for one in node.body for made in _listed(self.visit(one))] or [ast.Pass()]
        node.orelse = [made for one in node.orelse for made in _listed(self.visit(one))]
        return node

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        test = self._test(node.test)
        if isinstance(test, ast.Constant):
            chosen: ast.expr = self.visit(node.body if test.value else node.orelse)
            return chosen
        return ast.IfExp(test, self.visit(node.body), self.visit(node.orelse))

    def _test(self, node: ast.expr) -> ast.expr:
        """A condition; a constant where it is known before the flight."""
        if isinstance(node, ast.Name) and self._kinds.get(node.id, ("",))[0] == "function":
            return ast.Constant(True)
        made: ast.expr = self.visit(node)
        return made

    def visit_Expr(self, node: ast.Expr) -> ast.stmt | None:
        if isinstance(node.value, ast.Constant):
            return None  # a docstring
        self.generic_visit(node)
        return node


class _Unknown:
    """Stands for what is not known before the flight."""

    __hash__ = object.__hash__


_UNKNOWN = _Unknown()


def _listed(made: Any) -> list[Any]:
    return made if isinstance(made, list) else [made] if made is not None else []


def _name(name: str) -> ast.Name:
    return ast.Name(name, ast.Load())


def _arithmetic(name: str) -> ast.Attribute:
    return ast.Attribute(_name("arithmetic_"), name, ast.Load())


def _plain(name: str) -> str:
    return name if name.isidentifier() else "lambda_"


def _is_ours(function: FunctionType) -> bool:
    """Whether it is a function of the harness: none of them makes a list or an array."""
    return function.__globals__.get("__name__", "").partition(".")[0] in ("harness", "autopilot")


def _is_made(value: Any) -> Any:
    """The named tuple whose `_make` it is, or None."""
    owner = getattr(value, "__self__", None)
    return owner if getattr(value, "__name__", "") == "_make" and is_record(owner) else None
