"""`harness list`: what there is."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import click


@click.command("list")
@click.argument("kind", type=click.Choice(["laws", "aircraft", "plants", "metrics", "margins"]))
def list_(kind: str) -> None:
    """List what there is of KIND: laws with their gains, aircraft, plants, metrics, or the margins of the verdict.

    \b
    Example:
      harness list laws
    """
    for line in _LINES[kind]():
        click.echo(line)


def _laws() -> Iterator[str]:
    from autopilot.laws import LAWS

    for name, law in LAWS.items():
        yield f"{name}: {(law.value.__doc__ or '').splitlines()[0]}"
        for gains, values in law.gain_sets.items():
            default = " (default)" if gains == law.default else ""
            yield f"    {gains}{default}: " + ", ".join(f"{key} = {value:.4g}" for key, value in values.items())


def _aircraft() -> Iterator[str]:
    import aircraft

    for name in aircraft.names():
        airframe = aircraft.folder(name)
        meta, speed = aircraft.data(airframe)["meta"], aircraft.limits(airframe).design_airspeed
        yield f"{name}: {meta['long_name']}, {meta['layout']}; {speed:g} m/s"


def _plants() -> Iterator[str]:
    from harness.plants.ladder import PLANTS

    for name, plant in PLANTS.items():
        yield f"{name}: {plant.about}"


def _metrics() -> Iterator[str]:
    from harness.metric import METRICS
    from harness.tables import table

    yield from table(["metric", "unit", "meaning"], ([m.name, m.unit, m.meaning] for m in METRICS.values()))


def _margins() -> Iterator[str]:
    from typing import get_args, get_type_hints

    from autopilot.quantities import About
    from harness.margins import Assess
    from harness.settings.table import schema_of
    from harness.settings.written import written

    hints = get_type_hints(Assess, include_extras=True)
    for key, value in written(Assess()).items():
        hint = hints[schema_of(Assess).settings[key].name]
        about = next(mark.text for mark in get_args(hint) if isinstance(mark, About))
        yield f"{f'assess.{key} = {value:.4g}':50} {about}"


_LINES: Mapping[str, Callable[[], Iterator[str]]] = {
    "laws": _laws,
    "aircraft": _aircraft,
    "plants": _plants,
    "metrics": _metrics,
    "margins": _margins,
}
