"""Writes the pages of docs/reference/ that follow from the code: `python -m docs.write_reference`.

`pages()` makes them; a test holds what is in the repository against it.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from types import EllipsisType
from typing import Any, Literal, NamedTuple, get_args, get_origin, get_type_hints

import click
from annotated_types import Ge, Gt, Le, Lt
from jinja2 import Environment, FileSystemLoader, StrictUndefined

import aircraft
from autopilot.laws import LAWS
from autopilot.quantities import About, Unit
from autopilot.standoff import StandoffLaw
from harness.cli.main import COMMANDS, harness, load
from harness.flight import Flight
from harness.log.metric import METRICS
from harness.margins import Assess
from harness.plants.ladder import PLANTS
from harness.settings.experiment import Experiment
from harness.settings.table import Setting, schema_of
from harness.settings.written import written
from harness.tables import markdown
from harness.world.target import Segment
from harness.world.wind import Gust

FOLDER = Path(__file__).parent / "reference"
WIDTH = 96  # columns of a help text
_UNITS = {
    "": "",
    "s": "s",
    "m": "m",
    "m2": "m²",
    "mps": "m/s",
    "mps2": "m/s²",
    "mps_per_m": "(m/s)/m",
    "m2_s2": "m²/s²",
    "deg": "°",
    "deg_s": "°/s",
    "deg_s2": "°/s²",
    "rad2": "rad²",
}
_BOUNDS = {Gt: ">", Ge: "≥", Lt: "<", Le: "≤"}


class Part(NamedTuple):
    """A table of a settings file."""

    name: str  # its heading
    kind: type
    inherited: type | None = None  # what its keys share with others, and is documented there


PARTS = (
    Part("[flight]", Flight),
    Part("[flight.law]", StandoffLaw),
    *(Part(f'[flight.law] with name = "{name}"', law.value, StandoffLaw) for name, law in LAWS.items()),
    *(
        Part(f"[flight.{key}]", setting.table.make)
        for key, setting in schema_of(Flight).settings.items()
        if setting.table and isinstance(setting.table.make, type)
    ),
    Part("An entry of flight.target.segments", Segment),
    Part("An entry of flight.wind.gusts", Gust),
)


def pages() -> Mapping[str, str]:
    """Each page's text by its file name."""
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    contents: Mapping[str, Mapping[str, Any]] = {
        "settings.md": {"parts": [(part.name, list(_settings(part))) for part in PARTS], "top": list(_top())},
        "metrics.md": {"table": list(_metrics())},
        "margins.md": {"table": list(_margins())},
        "laws.md": {"laws": list(_laws())},
        "plants.md": {"table": list(_plants())},
        "airframes.md": {"table": list(_airframes())},
        "command_line.md": {"groups": list(_commands())},
    }
    return {name: environment.get_template(f"{name}.jinja").render(content) for name, content in contents.items()}


def _top() -> Iterator[str]:
    rows = ([f"`{key}`", about(Experiment, setting.name)] for key, setting in schema_of(Experiment).settings.items())
    return markdown(["key", "meaning"], rows)


def _settings(part: Part) -> Iterator[str]:
    elsewhere = schema_of(part.inherited).settings if part.inherited else {}
    defaults = {f.name: f.default for f in fields(part.kind)}
    rows = []
    for key, setting in schema_of(part.kind).settings.items():
        meaning = about(part.kind, setting.name)
        if key in elsewhere or key == "gains" or not meaning:  # a table without a meaning of its own has a section
            continue
        default = "of the set" if elsewhere else _default(setting, defaults[setting.name])
        rows.append([f"`{key}`", _UNITS[setting.unit.suffix], default, _allowed(setting), meaning])
    return markdown(["key", "unit", "default", "allowed", "meaning"], rows)


def _default(setting: Setting, default: object) -> str:
    if setting.required:
        return "–"
    if default is None:
        return "none"
    if default is MISSING:
        return ""
    return f"`{_in_file(default, setting.unit)}`"


def _in_file(value: object, unit: Unit) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(_in_file(element, unit) for element in value)}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(round(value / unit.si, 10))
    return repr(value).replace("'", '"')


def _allowed(setting: Setting) -> str:
    """What a value may be, in words."""
    if get_origin(setting.kind) is Literal:
        return ", ".join(f"`{name}`" for name in get_args(setting.kind))
    kind = {float: "number", int: "whole number", str: "text", bool: "`true`, `false`"}.get(setting.kind, "table")  # type: ignore[call-overload]
    bounds = " and ".join(f"{_BOUNDS[type(b)]} {_plain(getattr(b, type(b).__name__.lower()))}" for b in setting.bounds)
    words = f"{kind} {bounds}".strip()
    if setting.infinite:
        words += ", or `inf`"
    if isinstance(setting.length, EllipsisType):
        return f"list of {words}s"
    return f"{setting.length} × {words}" if setting.length else words


def _plain(bound: float) -> str:
    return f"{bound:g}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")


def about(kind: type, name: str) -> str:
    """A field's meaning, from its declaration."""
    marks = get_args(get_type_hints(kind, include_extras=True)[name])
    return next((mark.text for mark in marks if isinstance(mark, About)), "")


def _metrics() -> Iterator[str]:
    rows = (
        [f"`{name}`", metric.heading, metric.label, f"{metric.ideal:g}" if metric.compared else "–", metric.meaning]
        for name, metric in METRICS.items()
    )
    return markdown(["name", "heading in tables", "unit", "ideal", "meaning"], rows)


def _margins() -> Iterator[str]:
    settings, rows = schema_of(Assess).settings, []
    for key, value in written(Assess()).items():
        rows.append([f"`{key}`", f"{value:.4g}", _UNITS[settings[key].unit.suffix], about(Assess, settings[key].name)])
    return markdown(["key in `[assess]`", "default", "unit", "meaning and source"], rows, "lrl")


def _laws() -> Iterator[tuple[str, str, list[str]]]:
    for name, law in LAWS.items():
        gains = list(next(iter(law.gain_sets.values())))
        rows = ([f"`{label}`", *(f"{values[gain]:.4g}" for gain in gains)] for label, values in law.gain_sets.items())
        doc = " ".join((law.value.__doc__ or "").split())
        yield name, doc, list(markdown(["gain set", *gains], rows, "lr"))


def _plants() -> Iterator[str]:
    rows = ([f"`{name}`", plant.about, plant.adds] for name, plant in PLANTS.items())
    return markdown(["name", "what it is", "what it adds to the one above"], rows)


def _airframes() -> Iterator[str]:
    rows = []
    for name in aircraft.names():
        folder = aircraft.folder(name)
        data, limits = aircraft.data(folder), aircraft.limits(folder)
        rows.append(
            [
                f"`{name}`",
                data["meta"]["long_name"],
                f"{data['mass']['m']['v']:g}",
                f"{data['ref']['b']['v']:.3g}",
                f"{limits.design_airspeed:g}",
                f"{limits.slowest:g} to {limits.fastest:g}",
                f"{math.degrees(limits.bank):.0f}",
            ]
        )
    headings = ["name", "aircraft", "mass, kg", "span, m", "airspeed, m/s", "flown at, m/s", "bank limit, °"]
    return markdown(headings, rows, "llr")


def _commands() -> Iterator[tuple[str, list[tuple[str, str]]]]:
    parent = click.Context(harness, info_name="harness")
    for heading, entries in COMMANDS.items():
        texts = []
        for name in entries:
            command = load(name)
            context = click.Context(command, info_name=name, parent=parent, terminal_width=WIDTH)
            texts.append((name, command.get_help(context)))
        yield heading, texts


if __name__ == "__main__":
    for name, text in pages().items():
        (FOLDER / name).write_text(text, encoding="utf-8")
        print(f"wrote docs/reference/{name}")
