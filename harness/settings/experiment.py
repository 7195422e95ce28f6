"""An experiment: everything that a settings file may hold.

The schema of every table is read from a dataclass, except for the law's: its class follows from its `name`, and most of
its values come from a named gain set.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache
from typing import Annotated, Literal

from pydantic_core import PydanticCustomError

from autopilot.guidance import Law
from autopilot.laws import LAWS
from autopilot.quantities import About
from autopilot.standoff import StandoffLaw
from harness.flight import Flight
from harness.margins import Assess
from harness.settings.laws import kind_of_class
from harness.settings.mistake import REFUSED
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
def document_table(law: type[Law] | None, gains_given: bool) -> TableSchema:
    """The schema of a whole file, which builds its flight. `law` is the law's class, None while it is unknown."""
    return _document(law_table(law, gains_given))


def without_law() -> TableSchema:
    """The schema of a whole file whose law has been reported as wrong."""
    return _document(TableSchema({}, lambda **given: None, open=True))


def _document(law: TableSchema) -> TableSchema:
    flight = Setting(Flight, "flight", table=flight_table(law))
    return TableSchema({**schema_of(Experiment).settings, "flight": flight}, lambda flight, **others: flight)


def flight_table(law: TableSchema) -> TableSchema:
    """The schema of [flight], with this schema of its law."""
    table = schema_of(Flight)
    return TableSchema({**table.settings, "law": replace(table.settings["law"], table=law)}, table.make)


def law_table(law: type[Law] | None, gains_given: bool) -> TableSchema:
    """The schema of [flight.law]; with `gains_given` it requires every gain. Without a `law`: that of all laws."""
    named = {"name": Setting(Literal[*LAWS], "name")}
    known = kind_of_class(law) if law else None
    if known is None:
        keys = {
            key: replace(s, required=False) for law in LAWS.values() for key, s in schema_of(law.value).settings.items()
        }
        every = dict.fromkeys(gains for law in LAWS.values() for gains in (*law.sets, CUSTOM))
        return TableSchema({**keys, **named, "gains": Setting(Literal[*every], "gains", required=False)}, dict)
    name, kind = known
    value, sets = kind.value, kind.sets
    own = schema_of(value).settings
    parameters = {setting.name for setting in own.values()}
    of_sets = set.intersection(*map(set, kind.gain_sets.values())) if kind.gain_sets and not gains_given else set()

    def make(name: str, gains: str = kind.default, **given: float | str) -> object:
        given = {**({"gains": gains} if gains else {}), **kind.numbers(gains), **given}
        try:
            return value(**{key: number for key, number in given.items() if key in parameters})
        except Exception as error:  # a user-defined law may check itself
            raise PydanticCustomError(REFUSED, "{why}", {"why": str(error)}) from None

    keys = {key: replace(s, required=s.required and s.name not in of_sets) for key, s in own.items()}
    if name not in LAWS:
        named = {"name": Setting(str, "name"), **_left_out(value, own)}
    if sets or "gains" not in own:
        keys["gains"] = Setting(Literal[*sets, CUSTOM], "gains", required=False)
    return TableSchema({**named, **keys}, make)


def _left_out(law: type[Law], own: Mapping[str, Setting]) -> dict[str, Setting]:
    """The keys that all laws of the package have and this one lacks: a file may say of them what is so anyway."""
    said = {f.name: (getattr(law, f.name, None), f.default) for f in fields(StandoffLaw)}
    so = {name: own if isinstance(own, str) else default for name, (own, default) in said.items()}
    shared = schema_of(StandoffLaw).settings
    return {key: Setting(Literal[so[s.name]], s.name, required=False) for key, s in shared.items() if key not in own}
