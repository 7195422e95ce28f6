"""`harness list`: what is declared."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import click


def _laws() -> Iterator[str]:
    from autopilot.laws import LAWS
    from harness.settings.law_source import LawError, entries
    from harness.settings.laws import kind_of
    from harness.tables import number, table

    for i, name in enumerate([*LAWS, *entries()]):
        yield from [""] * bool(i)
        try:
            law = kind_of(name, run=True)
        except LawError as error:
            yield f"{name}: {error}"
            continue
        yield f"{name}: {(law.value.__doc__ or '').splitlines()[0]}"
        gains = list(dict.fromkeys(key for values in law.gain_sets.values() for key in values))
        rows = (
            [f"{chosen} (default)" if chosen == law.default else chosen, *(number(values.get(key)) for key in gains)]
            for chosen, values in law.gain_sets.items()
        )
        if gains:
            yield from table(["gain set", *gains], rows, "lr")
        if law.rules:
            yield ""
            by_rule = ([name, rule.base, rule.about] for name, rule in law.rules.items())
            yield from table(["gain set by rule", "starts from", "what it sets"], by_rule)


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
    from harness.margins import Assess
    from harness.settings.catalogue import TABLES, keys_of
    from harness.tables import table

    (margins,) = (part for part in TABLES if part.kind is Assess)
    rows = ([margins.prefix + one.key, one.unit, one.default, one.meaning] for one in keys_of(margins))
    yield from table(["margin", "unit", "default", "what it bounds, and where its default comes from"], rows, "llrl")


def _settings() -> Iterator[str]:
    from harness.settings.catalogue import TABLES, keys_of
    from harness.tables import table

    for i, part in enumerate(TABLES):
        yield from [""] * bool(i)
        yield part.name
        rows = []
        for one in keys_of(part):
            choices = f"; one of {', '.join(one.choices)}" if one.choices else ""
            rows.append([part.prefix + one.key, one.unit, one.default, one.meaning + choices])
        yield from table(["key", "unit", "default", "meaning"], rows)


_KINDS: Mapping[str, Callable[[], Iterator[str]]] = {
    "laws": _laws,
    "aircraft": _aircraft,
    "plants": _plants,
    "metrics": _metrics,
    "margins": _margins,
    "settings": _settings,
}


@click.command("list")
@click.argument("kind", type=click.Choice(list(_KINDS)))
def list_(kind: str) -> None:
    """List the laws, aircraft, plants, metrics, margins or settings.

    Prints a table: the laws with their gain sets, the aircraft with their limits, the plants from the kinematic one
    up, the metrics with their units and meaning, the margins of the verdict with their defaults, or every key of a
    settings file with its unit, default and meaning: `--set` takes these keys.

    \b
    Examples:
      harness list laws
      harness list settings
    """
    for line in _KINDS[kind]():
        click.echo(line)
