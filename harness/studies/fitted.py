"""Which coefficients of NFTSM give Table 3? `python -m harness.studies.fitted` writes the page fitted.md.

The paper prints (alpha2, beta2) = (0.5, 0.2) for NFTSM, with which it never converges; its two rows, 31.2 s from 30 deg
and 72.9 s from 130 deg, are two numbers for two unknowns. The gain set `fitted` is what this study finds.
"""

import csv
import io
import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import click

from harness.pool import computed
from harness.studies.command import counted, out_option, run, write
from harness.studies.paper.decision import metres
from harness.studies.paper.experiments import EXPERIMENTS, Trace, flight, flown, paper_law
from harness.studies.paper.job import workers
from harness.studies.paper.measures import overshoot, peak, restricted, settled
from harness.template import template

PRINTED = (31.2, 72.9)  # s, Table 3
COARSE, FINE = 0.01, 0.001  # s, for which a command is held: to look around, and to decide

ALPHA2 = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0, 1.25, 1.5)
BETA2 = (0.2, 0.5, 0.8, 1.0, 1.2, 1.6, 2.0, 2.4, 2.8, 3.2, 4.0, 5.0, 6.0)
ONE_DECIMAL = [(i / 10.0, j / 10.0) for i in range(1, 16) for j in range(2, 61)]
NEAR_ALPHA2 = [0.390 + 0.001 * i for i in range(19)]
NEAR_BETA2 = [2.30 + 0.01 * j for j in range(21)]
SETS = ((0.4, 2.4), (0.491, 2.965), (0.672, 0.75))  # spots that give both numbers; the first is `fitted`


class Pair(NamedTuple):
    """A pair, how long its command is held, and when it has converged from 30 and from 130 deg; None: never."""

    alpha2: float
    beta2: float
    period: float
    from_30: float | None
    from_130: float | None

    @property
    def prints(self) -> bool:
        """Whether it gives both printed numbers."""
        return (self.from_30, self.from_130) == PRINTED


def trace(experiment: str, alpha2: float, beta2: float, period: float | None = None, duration: float = 0.0) -> Trace:
    """NFTSM with these coefficients in one of the paper's experiments."""
    paper_flight = flight(experiment, "NFTSM", duration=duration or EXPERIMENTS[experiment].measured)
    steering = paper_law("NFTSM", alpha2=alpha2, beta2=beta2, max_heading_rate=paper_flight.law.max_heading_rate)
    period = period or paper_flight.guidance_period
    return flown(replace(paper_flight, law=steering, guidance_period=period, step=min(0.005, period)))


def pair_of(pair: tuple[float, float, float]) -> Pair:
    """Table 3 with a pair; the third number is how long its command is held."""
    alpha2, beta2, period = pair
    return Pair(*pair, settled(trace("30", alpha2, beta2, period)), settled(trace("130", alpha2, beta2, period)))


def candidate(pair: tuple[float, float, float]) -> Pair:
    """The same, from 130 deg only when it is near enough from 30 deg."""
    alpha2, beta2, period = pair
    from_30 = settled(trace("30", alpha2, beta2, period))
    if from_30 is None or abs(from_30 - PRINTED[0]) > 0.25:
        return Pair(*pair, from_30, None)
    return Pair(*pair, from_30, settled(trace("130", alpha2, beta2, period)))


def _time(time: float | None) -> str:
    return "–" if time is None else f"{time:.1f}"


def unfitted_rows() -> list[list[str]]:
    """What the paper prints or says of NFTSM beside Table 3, and what each of `SETS` gives: a row for each quantity."""
    printed = {
        "Table 3 (fitted): from 30° / from 130°": "31.2 s / 72.9 s",
        "overshoot from 30° / 130°": "none mentioned",
        "4.1: restricted until, from 30°": "8 s (its interval is 8 s to 17 s)",
        "4.2: converges": "38.8 s",
        "4.3: converges": "24.3 s",
        "4.3: largest error in the manoeuvres": "±0.1 m",
    }
    columns = [_unfitted(*pair) for pair in SETS]
    return [[what, paper, *ours] for (what, paper), *ours in zip(printed.items(), *columns, strict=True)]


def _unfitted(alpha2: float, beta2: float) -> tuple[str, ...]:
    at_30, at_130 = trace("30", alpha2, beta2), trace("130", alpha2, beta2)
    held = restricted(at_30)
    manoeuvring = trace("manoeuvres", alpha2, beta2)
    return (
        f"{_time(settled(at_30))} / {_time(settled(at_130))}",
        f"{metres(overshoot(at_30))} / {metres(overshoot(at_130))}",
        "–" if held is None else f"{held[1]:.1f} s",
        _time(settled(trace("S", alpha2, beta2))),
        _time(settled(manoeuvring, until=300.0)),
        metres(peak(manoeuvring, 300.0)),
    )


def map_csv(pairs: Iterable[Pair]) -> str:
    """When each pair has converged, a line each; an empty cell: not in the 80 s and 100 s flown."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("alpha2", "beta2", "held for, s", "converged from 30 deg, s", "converged from 130 deg, s"))
    writer.writerows(pairs)
    return text.getvalue()


def page(one_decimal: Iterable[Pair], near: Iterable[Pair]) -> str:
    """The page: of the pairs with one decimal that come near, decided finely, and of the grid round the fitted one."""
    exact = [p for p in one_decimal if p.prints]
    inside = [p for p in near if p.prints]
    area = 0.001 * 0.01 * len(inside)
    return (
        template("harness.studies", "fitted.md.jinja").render(
            asked=len(ONE_DECIMAL),
            exact=exact,
            misses=sorted((p for p in one_decimal if not p.prints), key=_off)[:4],
            from_printed=sum(p.alpha2 == 0.5 or p.beta2 == 0.2 for p in exact),
            inside=len(inside),
            alpha2=[f(p.alpha2 for p in inside) for f in (min, max)],
            beta2=[f(p.beta2 for p in inside) for f in (min, max)],
            area=area,
            chance=100.0 * area / (0.1 * 0.1),  # of a pair with one decimal to lie in it
            sets=SETS,
            rows=unfitted_rows(),
            coarse=1000.0 * COARSE,
            time=_time,
        )
        + "\n"
    )


def _off(p: Pair) -> float:
    if p.from_30 is None or p.from_130 is None:
        return math.inf
    return math.hypot(p.from_30 - PRINTED[0], p.from_130 - PRINTED[1])


@click.command()
@out_option
def main(out: Path) -> None:
    """Fly NFTSM with many pairs of coefficients, and write OUT/fitted.md and OUT/fitted.csv. Takes two minutes."""
    # Below beta2 = 1 a coarsely held command chatters: there the finer one decides at once.
    one_decimal = _computed(candidate, [(a, b, COARSE if b >= 1.0 else FINE) for a, b in ONE_DECIMAL])
    decided = _computed(pair_of, [(p.alpha2, p.beta2, FINE) for p in one_decimal if p.from_130 is not None])
    near = _computed(pair_of, [(a, b, COARSE) for a in NEAR_ALPHA2 for b in NEAR_BETA2])
    coarse = _computed(pair_of, [(a, b, COARSE) for a in ALPHA2 for b in BETA2])
    write(out, {"fitted.md": page(decided, near), "fitted.csv": map_csv(coarse)})


def _computed(of: Callable[[tuple[float, float, float]], Pair], pairs: list[tuple[float, float, float]]) -> list[Pair]:
    """The pairs flown, in order."""
    jobs = [partial(of, pair) for pair in pairs]
    return sorted(counted(computed(jobs, workers()), len(jobs), "flying pairs of coefficients"))


if __name__ == "__main__":
    run(main, "harness.studies.fitted")
