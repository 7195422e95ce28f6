"""An experiment: everything that a settings file may hold.

The schema of every table is read from a dataclass, except for the law's: its class follows from its `name`, and most of
its values come from a named gain set.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Annotated, Literal

from autopilot.laws import LAWS
from autopilot.quantities import About
from harness.flight import Flight
from harness.margins import Assess
from harness.settings.table import Setting, TableSchema, schema_of

CUSTOM = "custom"  # instead of a named gain set: every gain is given


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """The content of a settings file; [flight], [matrix], [[exclude]] and [[include]] are not checked yet."""

    title: Annotated[str, About("heads the results")] = ""
    question: Annotated[str, About("what the results are to answer")] = ""
    flight: Annotated[
        Mapping[str, object], About("one flight, or the settings that all flights of the matrix have in common")
    ]
    matrix: Annotated[Mapping[str, object], About("the axes: each key with its values")] = field(default_factory=dict)
    exclude: Annotated[tuple[Mapping[str, object], ...], About("combinations of the matrix to leave out")] = ()
    include: Annotated[tuple[Mapping[str, object], ...], About("further blocks of flights")] = ()
    assess: Annotated[Assess, About("margins and thresholds of the verdict")] = field(default_factory=Assess)


@cache
def document_table(law: str | None, gains_given: bool) -> TableSchema:
    """The schema of a whole file, which builds its flight. `law` is the law's name, None while it is unknown."""
    table = schema_of(Experiment)
    flight = Setting(Flight, "flight", table=flight_table(law_table(law, gains_given)))
    return TableSchema({**table.settings, "flight": flight}, lambda flight, **others: flight)


def flight_table(law: TableSchema) -> TableSchema:
    """The schema of [flight], with this schema of its law."""
    table = schema_of(Flight)
    return TableSchema({**table.settings, "law": replace(table.settings["law"], table=law)}, table.make)


def law_table(name: str | None, gains_given: bool) -> TableSchema:
    """The schema of [flight.law]; with `gains_given` it asks for every gain. Without a `name`: that of all laws."""
    named = {"name": Setting(Literal[*LAWS], "name")}
    if name is None:
        keys = {
            key: replace(s, required=False) for law in LAWS.values() for key, s in schema_of(law.value).settings.items()
        }
        every = dict.fromkeys(gains for law in LAWS.values() for gains in (*law.sets, CUSTOM))
        return TableSchema({**keys, **named, "gains": Setting(Literal[*every], "gains", required=False)}, dict)
    kind = LAWS[name]
    value = kind.value

    def make(name: str, gains: str = kind.default, **given: float | str) -> object:
        return value(**{"gains": gains, **kind.numbers(gains), **given})

    own = {key: replace(s, required=s.required and gains_given) for key, s in schema_of(value).settings.items()}
    return TableSchema({**named, **own, "gains": Setting(Literal[*kind.sets, CUSTOM], "gains", required=False)}, make)
