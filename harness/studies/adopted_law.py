"""What decides on adopted aircraft? `python -m harness.studies.adopted_law FILE` flies it and writes adopted_law.md.

`make adopted` adopts the aircraft first.
"""

import math
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import click
import numpy as np

import aircraft
from autopilot.nftsm import Nftsm
from harness.chatter import VISIBLE
from harness.error import ArgumentError
from harness.flight import Flight
from harness.limit_cycle.margin import following
from harness.loop import simulate
from harness.plants.identified import identified
from harness.pool import computed
from harness.runs.matrix import read_matrix
from harness.series import rms
from harness.settings import read_settings
from harness.studies.command import counted, out_option, run, write
from harness.studies.paper.job import workers
from harness.template import template

FACTORS = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5)  # on the gains at which the limit cycle is predicted to begin
HALF = "behind_inner_loop"  # the rule that takes half of those gains
SETS = ("scaled", HALF)
PLANTS = ("kinematic", "sixdof")


class LastLap(NamedTuple):
    """The last lap of a flight. SI, rad."""

    ended: str  # how, where it ended early
    swing: float  # half of peak to peak of the command
    frequency: float  # Hz
    error: float  # of the range, rms over the radius

    @property
    def rests(self) -> bool:
        """Whether the command comes to rest, as everywhere in the harness."""
        return not self.ended and self.swing < VISIBLE


class Judged(NamedTuple):
    """A gain set on an aircraft: its predicted margin, and its flights on sixdof and on kinematic."""

    gains: str
    k2: float
    margin: float
    flown: LastLap
    kinematic: LastLap


class Aircraft(NamedTuple):
    """An aircraft under the law, scaled to its circle."""

    name: str
    airspeed: float
    standoff: float
    lag: float  # s, to 63 % of a step
    border: float  # the k2 at which the limit cycle is predicted to begin, 1/s
    ladder: Sequence[LastLap]  # at `FACTORS` times that
    judged: Sequence[Judged]

    @property
    def border_of_circle(self) -> float:
        """k2 R / V, of the border."""
        return self.border * self.standoff / self.airspeed

    @property
    def begins(self) -> tuple[float, float]:
        """The factors between which the limit cycle begins in flight: it rests up to the first; 0 and inf are open."""
        rests = [each.rests for each in self.ladder]
        quiet = rests.index(False) if False in rests else len(rests)
        loud = len(rests) - (rests[::-1].index(True) if True in rests else len(rests))
        return FACTORS[quiet - 1] if quiet else 0.0, FACTORS[loud] if loud < len(rests) else math.inf

    @property
    def mistold(self) -> list[float]:
        """The factors at which the margin is wrong about whether the command rests; at one it says nothing."""
        flights = zip(FACTORS, self.ladder, strict=True)
        return [factor for factor, each in flights if factor != 1.0 and (factor < 1.0) != each.rests]


def flown(key: Hashable, flight: Flight) -> tuple[Hashable, LastLap]:
    """Flies it, and judges its last lap."""
    log, law = simulate(flight), flight.law
    lap = round(2.0 * math.pi * law.standoff / flight.start.airspeed / flight.guidance_period)
    command = log["heading_rate_command"][-lap:]
    spectrum = np.abs(np.fft.rfft(command - command.mean()))
    return key, LastLap(
        ended=log.reason,
        swing=0.5 * float(np.ptp(command)),
        frequency=float(np.argmax(spectrum)) / (len(command) * flight.guidance_period),
        error=rms(log["range_error"][-lap:]) / law.standoff,
    )


def examined(flights: Sequence[Flight]) -> list[Aircraft]:
    """Each aircraft of these flights, which are flown, and with the gains around the border of its limit cycle.

    Raises `ArgumentError` for flights that are not those of experiments/adopted.toml.
    """
    base = {(flight.aircraft, flight.plant, _nftsm(flight).gains): flight for flight in flights}
    names = list(dict.fromkeys(flight.aircraft for flight in flights))
    if base.keys() != {(name, plant, gains) for name in names for plant in PLANTS for gains in SETS}:
        raise ArgumentError(f"each aircraft must fly on {' and '.join(PLANTS)}, with the gains {' and '.join(SETS)}")
    borders = {name: 2.0 * _nftsm(base[name, "sixdof", HALF]).k2 for name in names}  # the rule halves it
    jobs: list[Callable[[], tuple[Hashable, LastLap]]] = [partial(flown, *item) for item in base.items()]
    for name, border in borders.items():
        flight = base[name, "sixdof", HALF]
        for factor in FACTORS:
            law = replace(_nftsm(flight), k2=factor * border, k3=0.5 * factor * border)
            jobs.append(partial(flown, (name, factor), replace(flight, law=law)))
    found = dict(counted(computed(jobs, workers()), len(jobs), "flying"))
    return [
        Aircraft(
            name=Path(name).name,
            airspeed=(flight := base[name, "sixdof", HALF]).start.airspeed,
            standoff=flight.law.standoff,
            lag=identified(aircraft.folder(name), flight.start.airspeed).measured["lag_s"],
            border=border,
            ladder=[found[name, factor] for factor in FACTORS],
            judged=[
                Judged(
                    gains=gains,
                    k2=_nftsm(base[name, "sixdof", gains]).k2,
                    margin=_margin(base[name, "sixdof", gains]),
                    flown=found[name, "sixdof", gains],
                    kinematic=found[name, "kinematic", gains],
                )
                for gains in SETS
            ],
        )
        for name, border in borders.items()
    ]


def _margin(flight: Flight) -> float:
    margin = following(flight, cycle=False).margin
    return math.nan if margin is None else margin


def _nftsm(flight: Flight) -> Nftsm:
    if not isinstance(flight.law, Nftsm):
        raise ArgumentError(f"the law is {flight.law}, must be nftsm")
    return flight.law


def page(found: Sequence[Aircraft]) -> str:
    """The page."""
    by_set = {gains: [set_ for each in found for set_ in each.judged if set_.gains == gains] for gains in SETS}
    margins = [set_.margin for set_ in by_set["scaled"]]
    wrong = [factor for each in found for factor in each.mistold]
    flights = len(found) * (len(FACTORS) - 1)
    return template("harness.studies", "adopted_law.md.jinja").render(
        aircraft=found,
        factors=FACTORS,
        visible=math.degrees(VISIBLE),
        half=HALF,
        told=f"{flights - len(wrong)} of {flights}",
        wrong=f"{min(wrong):g} to {max(wrong):g}" if wrong else "",
        scaled_rest=sum(set_.flown.rests for set_ in by_set["scaled"]),
        scaled_margins=f"{min(margins):.2g} to {max(margins):.2g}",
        half_rest=sum(set_.flown.rests for set_ in by_set[HALF]),
        half_error=100.0 * max(set_.flown.error for set_ in by_set[HALF]),
        span=_span,
        swing=lambda flown: flown.ended or _number(math.degrees(flown.swing)),
        error=lambda flown: _number(100.0 * flown.error),
    )


def _span(each: Aircraft) -> str:
    quiet, loud = each.begins
    if not quiet:
        return f"below {FACTORS[0]:g}"
    return f"{quiet:g} to {loud:g}" if loud < math.inf else f"beyond {FACTORS[-1]:g}"


def _number(value: float) -> str:
    return f"{value:.2g}" if 1e-3 <= value < 10.0 else f"{value:.0f}" if value >= 10.0 else "< 0.001"


@click.command()
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@out_option
def main(file: Path, out: Path) -> None:
    """Fly FILE, experiments/adopted.toml, and gains around each border; write OUT/adopted_law.md, what decides there.

    \b
    Example:
        python -m harness.studies.adopted_law experiments/adopted.toml
    """
    matrix = read_matrix(read_settings(file))
    write(out, {"adopted_law.md": page(examined([matrix.flight(each) for each in matrix.combinations()]))})


if __name__ == "__main__":
    run(main, "harness.studies.adopted_law")
