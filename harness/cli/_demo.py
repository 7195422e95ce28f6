"""The main job: the paper's stationary target under both laws, on the kinematic and two 6-DOF aircraft side by side."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from harness.feasibility import feasibility_margin, needed_rate
from harness.flight import Flight
from harness.log import FlightLog
from harness.loop import simulate
from harness.metric import METRICS, measure
from harness.settings import flight_from_document
from harness.tables import number, table

LAWS = MappingProxyType({"NFTSM_1": {"name": "nftsm", "gains": "paper_1"}, "SMC": {"name": "smc", "gains": "paper"}})
KINEMATIC = "kinematic"
AIRFRAMES = ("ultra_stick_25e", "skywalker_x8")
DURATION_S = 200.0


class Case(NamedTuple):
    """A wind and a limit, in file units."""

    name: str
    title: str
    wind_mps: tuple[float, float]
    max_heading_rate_deg_s: float


CASES = (
    Case("still-air", "Still air, the paper's 5 deg/s", (0.0, 0.0), 5.0),
    Case("wind-5", "3 m/s of wind, 5 deg/s", (3.0, 0.0), 5.0),
    Case("wind-8", "3 m/s of wind, 8 deg/s", (3.0, 0.0), 8.0),
)


class Flown(NamedTuple):
    """One flight of the main job, judged."""

    case: Case
    law: str
    plant: str  # kinematic, or the airframe
    log: FlightLog
    metrics: Mapping[str, float | bool | None]


def flight(case: Case, law: str, plant: str) -> Flight:
    """Table 1 with heading 30 deg, in the air and under the limit of `case`."""
    airframe = {} if plant == KINEMATIC else {"aircraft": plant}
    return flight_from_document(
        {
            "plant": KINEMATIC if plant == KINEMATIC else "sixdof",
            **airframe,
            "duration_s": DURATION_S,
            "law": {**LAWS[law], "max_heading_rate_deg_s": case.max_heading_rate_deg_s},
            "wind": {"steady_mps": list(case.wind_mps)},
        }
    )


def fly_all() -> Iterator[Flown]:
    """The flights of the main job, case by case, law by law, the kinematic one first."""
    for case in CASES:
        for law in LAWS:
            for plant in (KINEMATIC, *AIRFRAMES):
                log = simulate(flight(case, law, plant))
                yield Flown(case, law, plant, log, measure(log))


def record_pairs(flown: list[Flown], folder: Path) -> Iterator[Path]:
    """Writes one recording per pair of the kinematic aircraft and an airframe under the same law."""
    from harness.review.recording import write_recording

    for reference in (f for f in flown if f.plant == KINEMATIC):
        for other in (f for f in flown if f[:2] == reference[:2] and f.plant != KINEMATIC):
            path = folder / f"{other.case.name}_{other.law}_{other.plant}.rrd"
            title = f"{other.case.title}: {other.law}, {KINEMATIC} and {other.plant}"
            write_recording(path, {KINEMATIC: reference.log, other.plant: other.log}, title, command="harness demo")
            yield path


SHOWN = [metric for metric in METRICS.values() if metric.in_short_tables]


def lines(flown: list[Flown]) -> Iterator[str]:
    """One case side by side, a line per flight: settling to 1 m; error, saturation and activity over the last half."""
    headings = ["law", "aircraft", *(metric.column_heading for metric in SHOWN)]
    rows = ([one.law, one.plant, *(number(one.metrics[m.name], m.scale) for m in SHOWN)] for one in flown)
    return table(headings, rows, "llr")


def differences(flown: list[Flown]) -> list[str]:
    """What differs between the plants in one case, in sentences made of the numbers alone."""
    case, said = flown[0].case, []
    feasible = feasibility_margin(flown[0].log.flight) >= 0
    if not feasible:
        needed = math.degrees(needed_rate(flown[0].log.flight))
        said.append(
            f"Infeasible: holding the circle in this wind takes up to {needed:.2f} deg/s, the limit is "
            f"{case.max_heading_rate_deg_s:g}. Every plant leaves it once a lap; what settles has only come back from "
            "the last time."
        )
    return said + [_law_across_plants([one for one in flown if one.law == law], feasible) for law in LAWS]


def _law_across_plants(flown: list[Flown], feasible: bool) -> str:
    """`flown` is one law's flights, the kinematic one first."""
    kinematic, *others = flown
    activity = [one.metrics["command_activity_deg_s2"] or 0.0 for one in flown]
    chatters = min(activity[1:]) > CHATTER * max(activity[0], 0.1)
    arrives = _beside(flown, "convergence_time_s", "settles {}", "in {:.1f} s", "{:+.1f} s", "never")
    leaves = _beside(flown, "range_error_peak_m", "leaves the circle {}", "by {:.1f} m", "{:+.1f} m", "not at all")
    return (
        f"{kinematic.law} {arrives if feasible else leaves}. Over the last half, on the same aircraft, its command is "
        f"at the limit {_each(flown, 'saturation_fraction', 100.0)} % of the time and moves by "
        f"{_each(flown, 'command_activity_deg_s2')} deg/s2"
        f"{': behind an inner loop it chatters' if chatters else ''}; the range error is "
        f"{_each(flown, 'range_error_rms_m')} m rms. "
        f"Sideslip, which the kinematic aircraft has not, reaches {_each(others, 'sideslip_peak_deg')} deg."
    )


CHATTER = 10.0  # times the kinematic activity, itself taken as 0.1 deg/s2 at least


def _beside(flown: list[Flown], metric: str, sentence: str, told: str, difference: str, none: str) -> str:
    """A metric on each aircraft, and how far it is from the kinematic one's, in words."""
    reference, words = flown[0].metrics[metric], []
    for i, one in enumerate(flown):
        value = one.metrics[metric]
        where = one.plant if i else "the kinematic aircraft"
        words.append(f"{none if value is None else told.format(value)} on {where}")
        if i and value is not None and reference is not None:
            words[-1] += f" ({difference.format(value - reference)})"
    return sentence.format(", ".join(words))


def _each(flown: list[Flown], metric: str, scale: float = 1.0) -> str:
    return " / ".join(number(one.metrics[metric], scale) for one in flown)
