"""Writes the pages of docs/reference/ that follow from the code: `python -m docs.write_reference`.

`pages()` makes them; a test holds what is in the repository against it.
"""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import click
from jinja2 import Environment, FileSystemLoader, StrictUndefined

import aircraft
from autopilot.laws import LAWS
from harness.cli.main import COMMANDS, harness, load
from harness.log.metric import METRICS
from harness.margins import Assess
from harness.plants.ladder import PLANTS
from harness.settings.catalogue import REQUIRED, TABLES, SettingsTable, about, keys_of
from harness.settings.experiment import Experiment
from harness.settings.table import schema_of
from harness.tables import markdown

FOLDER = Path(__file__).parent / "reference"
WIDTH = 96  # columns of a help text


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
        "settings.md": {
            "parts": [(p.name, list(_settings(p))) for p in TABLES if p.kind is not Assess],
            "top": list(_top()),
        },
        "metrics.md": {"table": list(_metrics())},
        "margins.md": {"table": list(_margins())},
        "laws.md": {"laws": list(_laws())},
        "plants.md": {"table": list(_plants())},
        "airframes.md": {"table": list(_airframes())},
        "command_line.md": {"groups": list(_commands())},
    }
    return {name: environment.get_template(f"{name}.jinja").render(content) for name, content in contents.items()}


def _top() -> Iterator[str]:
    rows = (
        [f"`{key}`", about(Experiment, setting.name).text] for key, setting in schema_of(Experiment).settings.items()
    )
    return markdown(["key", "meaning"], rows)


def _settings(part: SettingsTable) -> Iterator[str]:
    rows = (
        [f"`{one.key}`", one.unit, _code(one.default), ", ".join(map(_code, one.choices)) or one.allowed, one.meaning]
        for one in keys_of(part)
    )
    return markdown(["key", "unit", "default", "allowed", "meaning"], rows)


def _code(text: str) -> str:
    """A value as code; what is none is in brackets, or a dash."""
    return text.strip("()") if text.startswith("(") or text in ("", REQUIRED) else f"`{text}`"


def _metrics() -> Iterator[str]:
    rows = (
        [f"`{name}`", metric.heading, metric.label, f"{metric.ideal:g}" if metric.compared else "–", metric.meaning]
        for name, metric in METRICS.items()
    )
    return markdown(["name", "heading in tables", "unit", "ideal", "meaning"], rows)


def _margins() -> Iterator[str]:
    (margins,) = (part for part in TABLES if part.kind is Assess)
    rows = ([f"`{one.key}`", one.default, one.unit, one.meaning] for one in keys_of(margins))
    return markdown(["key in `[assess]`", "default", "unit", "meaning and source"], rows, "lrl")


def _laws() -> Iterator[tuple[str, str, list[str]]]:
    for name, law in LAWS.items():
        gains = list(next(iter(law.gain_sets.values())))
        rows = ([f"`{label}`", *(f"{values[gain]:.4g}" for gain in gains)] for label, values in law.gain_sets.items())
        doc = " ".join((law.value.__doc__ or "").split())
        rules = ([f"`{label}`", f"`{rule.base}`", rule.about] for label, rule in law.rules.items())
        by_rule = ["", *markdown(["gain set by rule", "starts from", "what it sets"], rules)] if law.rules else []
        yield name, doc, [*markdown(["gain set", *gains], rows, "lr"), *by_rule]


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
    for heading, commands in COMMANDS.items():
        texts = []
        for name in commands:
            command = load(name)
            context = click.Context(command, info_name=name, parent=parent, terminal_width=WIDTH)
            texts.append((name, command.get_help(context)))
        yield heading, texts


if __name__ == "__main__":
    for name, text in pages().items():
        (FOLDER / name).write_text(text, encoding="utf-8")
        print(f"wrote docs/reference/{name}")
