"""An experiment: all that a settings file may hold.

Only the law is told here and not read off a dataclass: its class follows from its `name`, and most of its values from a
named set of gains.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Annotated, Literal

from autopilot.laws import LAWS
from autopilot.quantities import About
from harness.flight import Flight
from harness.margins import Assess
from harness.settings.table import Setting, Table, table_of

CUSTOM = "custom"  # in the place of a named set: every gain is given


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """What a file may hold; its tables as they stand there."""

    title: Annotated[str, About("heads the results")] = ""
    question: Annotated[str, About("what the results are to answer")] = ""
    flight: Annotated[Mapping[str, object], About("one flight, or what all have in common")]
    matrix: Annotated[Mapping[str, object], About("every key an axis, with its values")] = field(default_factory=dict)
    exclude: Annotated[tuple[Mapping[str, object], ...], About("flights to leave out")] = ()
    include: Annotated[tuple[Mapping[str, object], ...], About("flights to add")] = ()
    assess: Annotated[Assess, About("margins and thresholds of the verdict")] = field(default_factory=Assess)


@cache
def document_table(law: str | None, gains_given: bool) -> Table:
    """The whole file's table, which makes its flight; the law by its name, None while that is not known."""
    table = table_of(Experiment)
    flight = Setting(Flight, "flight", table=flight_table(law_table(law, gains_given)))
    return Table({**table.settings, "flight": flight}, lambda flight, **others: flight)


def flight_table(law: Table) -> Table:
    """The table of [flight], with that of its law."""
    table = table_of(Flight)
    return Table({**table.settings, "law": replace(table.settings["law"], table=law)}, table.make)


def law_table(name: str | None, gains_given: bool) -> Table:
    """The table of a law; while its name is not known, that is all it asks for."""
    named = {"name": Setting(Literal[*LAWS], "name")}
    if name is None:
        return Table(named, dict, open=True)
    kind = LAWS[name]
    value, sets = kind.value, {**kind.gain_sets, CUSTOM: {}}

    def make(name: str, gains: str = kind.default, **given: float | str) -> object:
        return value(**{"gains": gains, **sets[gains], **given})

    own = {key: replace(s, required=s.required and gains_given) for key, s in table_of(value).settings.items()}
    return Table({**named, **own, "gains": Setting(Literal[*sets], "gains", required=False)}, make)
