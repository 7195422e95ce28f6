"""The main job: the paper's stationary target under both laws, on the kinematic and two 6-DOF aircraft side by side."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from harness.commands.telling import number
from harness.flight import Flight, feasibility_margin
from harness.flight_log import FlightLog
from harness.metrics import metrics
from harness.settings import flight_from_document
from harness.simulation import simulate

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
    metrics: Mapping[str, float | None]


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
                yield Flown(case, law, plant, log, metrics(log))


def record_pairs(flown: list[Flown], folder: Path) -> Iterator[Path]:
    """Writes one recording per pair of the kinematic aircraft and an airframe under the same law."""
    from harness.recording import write_recording

    folder.mkdir(parents=True, exist_ok=True)
    for reference in (f for f in flown if f.plant == KINEMATIC):
        for other in (f for f in flown if f[:2] == reference[:2] and f.plant != KINEMATIC):
            path = folder / f"{other.case.name}_{other.law}_{other.plant}.rrd"
            title = f"{other.case.title}: {other.law}, {KINEMATIC} and {other.plant}"
            write_recording(path, {KINEMATIC: reference.log, other.plant: other.log}, title, notes([reference, other]))
            yield path


def notes(flown: list[Flown]) -> str:
    """A Markdown table of the metrics, a column per flight."""
    lines = ["| | " + " | ".join(f.plant for f in flown) + " |", "|---|" + "---|" * len(flown)]
    lines.append("| outcome | " + " | ".join(f.log.outcome.value for f in flown) + " |")
    lines += [f"| {name} | " + " | ".join(number(f.metrics[name]) for f in flown) + " |" for name in flown[0].metrics]
    return "\n".join(lines)


def differences(flown: list[Flown]) -> list[str]:
    """What differs between the plants in one case, in sentences made of the numbers alone."""
    said = []
    case = flown[0].case
    margin = feasibility_margin(flown[0].log.flight)
    if margin < 0:
        worst = max(flown, key=lambda f: f.metrics["range_error_peak_m"] or 0.0)
        least = min(flown, key=lambda f: f.metrics["range_error_peak_m"] or 0.0)
        said.append(
            f"The circle is infeasible at {case.max_heading_rate_deg_s:g} deg/s in this wind; every plant leaves it, "
            f"by "
            f"{_of(least, 'range_error_peak_m', 'm')} ({least.plant}, {least.law}) to "
            f"{_of(worst, 'range_error_peak_m', 'm')} ({worst.plant}, {worst.law}) in the last half."
        )
    for law in LAWS:
        kinematic, *others = [f for f in flown if f.law == law]
        said += [_difference(law, kinematic, other) for other in others]
    return said


def _difference(law: str, kinematic: Flown, other: Flown) -> str:
    parts = [
        _settling(kinematic, other),
        f"range error {_versus(kinematic, other, 'range_error_rms_m', 'm rms')}",
        f"saturated {_percent(kinematic)} -> {_percent(other)} of the last half",
        f"command activity {_versus(kinematic, other, 'command_activity_deg_s2', 'deg/s2')}",
        f"sideslip up to {_of(other, 'sideslip_peak_deg', 'deg')} where the model has none",
    ]
    return f"{law}, kinematic -> {other.plant}: " + "; ".join(parts) + "."


def _settling(kinematic: Flown, other: Flown) -> str:
    before, after = kinematic.metrics["convergence_time_s"], other.metrics["convergence_time_s"]
    if before is None or after is None:
        return f"settles {_time(before)} -> {_time(after)}"
    return f"settles {_time(before)} -> {_time(after)} ({after - before:+.1f} s)"


def _time(value: float | None) -> str:
    return "never" if value is None else f"in {value:.1f} s"


def _versus(kinematic: Flown, other: Flown, metric: str, unit: str) -> str:
    return f"{number(kinematic.metrics[metric])} -> {number(other.metrics[metric])} {unit}"


def _of(one: Flown, metric: str, unit: str) -> str:
    return f"{number(one.metrics[metric])} {unit}"


def _percent(one: Flown) -> str:
    return f"{100.0 * (one.metrics['saturation_fraction'] or 0.0):.0f} %"
