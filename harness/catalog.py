"""What there is, in lines for `harness list`."""

from collections.abc import Iterator
from importlib import import_module
from typing import get_args, get_type_hints

import aircraft
from autopilot.laws import LAWS
from autopilot.quantities import About
from harness.flight import Flight
from harness.metrics import MEANING
from harness.settings.table import table_of
from harness.settings.written import written
from harness.verdict.assess import Assess


def lines(kind: str) -> Iterator[str]:
    """The lines of one kind: laws, aircraft, plants, metrics or margins."""
    match kind:
        case "laws":
            for name, law in LAWS.items():
                yield f"{name}: {(law.value.__doc__ or '').splitlines()[0]}"
                for gains, values in law.gain_sets.items():
                    yield f"    {gains}: " + ", ".join(f"{key} = {value:.4g}" for key, value in values.items())
        case "aircraft":
            for name in aircraft.names():
                airframe = aircraft.folder(name)
                meta, speed = aircraft.data(airframe)["meta"], aircraft.limits(airframe).design_airspeed
                yield f"{name}: {meta['long_name']}, {meta['layout']}; {speed:g} m/s"
        case "plants":
            for name in get_args(get_type_hints(Flight)["plant"]):
                yield f"{name}: {(import_module(f'harness.plants.{name}').__doc__ or '').splitlines()[0]}"
        case "metrics":
            for name, meaning in MEANING.items():
                yield f"{name:30} {meaning}"
        case "margins":
            for key, value in written(Assess()).items():
                yield f"{f'assess.{key} = {value:.4g}':50} {_about(key)}"


def _about(key: str) -> str:
    hint = get_type_hints(Assess, include_extras=True)[table_of(Assess).settings[key].name]
    return next(mark.text for mark in get_args(hint) if isinstance(mark, About))
