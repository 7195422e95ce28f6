"""`harness list`: what is declared."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import click


def _laws() -> Iterator[str]:
    from autopilot.laws import LAWS
    from harness.tables import number, table

    for i, (name, law) in enumerate(LAWS.items()):
        yield from [""] * bool(i)
        yield f"{name}: {(law.value.__doc__ or '').splitlines()[0]}"
        gains = list(dict.fromkeys(key for values in law.gain_sets.values() for key in values))
        rows = (
            [f"{chosen} (default)" if chosen == law.default else chosen, *(number(values.get(key)) for key in gains)]
            for chosen, values in law.gain_sets.items()
        )
        yield from table(["gain set", *gains], rows, "lr")


def _aircraft() -> Iterator[str]:
    import math

    import aircraft
    from harness.tables import number, table

    rows = []
    for name in aircraft.names():
        airframe = aircraft.folder(name)
        meta, limits = aircraft.data(airframe)["meta"], aircraft.limits(airframe)
        speeds = (number(speed) for speed in (limits.design_airspeed, limits.slowest, limits.fastest))
        rows.append([name, *speeds, number(math.degrees(limits.bank)), f"{meta['long_name']}: {meta['layout']}"])
    headings = ["aircraft", "airspeed\nm/s", "slowest\nm/s", "fastest\nm/s", "bank limit\ndeg", "what it is"]
    yield from table(headings, rows, "lrrrrl")


def _plants() -> Iterator[str]:
    from harness.plants.ladder import PLANTS
    from harness.tables import table

    yield from table(["plant", "what it is"], ([name, plant.about] for name, plant in PLANTS.items()))


def _metrics() -> Iterator[str]:
    from harness.log.metric import METRICS
    from harness.tables import table

    yield from table(["metric", "unit", "meaning"], ([m.name, m.unit, m.meaning] for m in METRICS.values()))


def _margins() -> Iterator[str]:
    from typing import get_args, get_type_hints

    from autopilot.quantities import About
    from harness.margins import Assess
    from harness.settings.table import schema_of
    from harness.settings.written import written
    from harness.tables import number, table

    hints = get_type_hints(Assess, include_extras=True)
    rows = []
    for key, value in written(Assess()).items():
        hint = hints[schema_of(Assess).settings[key].name]
        rows.append([f"assess.{key}", number(value), next(m.text for m in get_args(hint) if isinstance(m, About))])
    yield from table(["margin", "default", "what it bounds, and where its default comes from"], rows, "lrl")


_KINDS: Mapping[str, Callable[[], Iterator[str]]] = {
    "laws": _laws,
    "aircraft": _aircraft,
    "plants": _plants,
    "metrics": _metrics,
    "margins": _margins,
}


@click.command("list")
@click.argument("kind", type=click.Choice(list(_KINDS)))
def list_(kind: str) -> None:
    """List the laws, aircraft, plants, metrics or margins.

    Prints a table: the laws with their gain sets, the aircraft with their limits, the plants from the kinematic one
    up, the metrics with their units and meaning, or the margins of the verdict with their defaults.

    \b
    Examples:
      harness list laws
      harness list margins
    """
    for line in _KINDS[kind]():
        click.echo(line)
