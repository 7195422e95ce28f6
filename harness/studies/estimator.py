"""Is the estimator as sure as it ought to be? `python -m harness.studies.estimator` writes the page estimator.md.

NEES, the error of the state squared over its covariance, is 4 on average for a filter that is as good as it believes
itself, NIS, the same of the innovation, 2; more is overconfidence. The average over the seeds at one moment lies within
the band of its chi-square distribution 95 % of the time (Bar-Shalom, Li & Kirubarajan 2001, Section 5.4).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import click
import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from autopilot.estimator import Estimator, ekf
from harness.knowledge import sensor
from harness.studies.command import counted, out_option, run, write
from harness.studies.paper.experiments import EXPERIMENTS, STRAIGHT
from harness.template import template
from harness.world.randomness import stream
from harness.world.target import Target, TargetState

Array = NDArray[np.float64]

SEEDS = 200
STATES, MEASURED = 4, 2  # numbers in X and in Z


class EstimatorCase(NamedTuple):
    """A target under a filter: `motion` gives, by the seed, its states at the sampling times, rows (x, x', y, y')."""

    name: str
    estimator: Estimator
    motion: Callable[[int], Array]


class Consistency(NamedTuple):
    """Rows are seeds, columns sampling times. NIS is NaN where the filter started from the measurement."""

    nees: Array
    nis: Array
    error: Array  # of the position, m
    deviation: Array  # of the position, as the filter believes it, m


def band(numbers: int, seeds: int) -> tuple[float, float]:
    """The 95 % band of the average over the seeds, for a vector of so many numbers."""
    low, high = (float(chi2.ppf(share, numbers * seeds)) / seeds for share in (0.025, 0.975))
    return low, high


def examine(case: EstimatorCase, seeds: int = SEEDS) -> Consistency:
    """Runs the filter on the case with every seed."""
    runs = [_run(case, seed) for seed in range(seeds)]
    return Consistency._make(np.array(rows) for rows in zip(*runs, strict=True))


def _run(case: EstimatorCase, seed: int) -> tuple[Array, Array, Array, Array]:
    truth = case.motion(seed)
    measure, tracker = sensor(case.estimator, seed), ekf(case.estimator)
    states, covariances, nis = [], [], []
    for x, x_dot, y, y_dot in truth.tolist():
        innovation = tracker.update(measure(TargetState(x, y, x_dot, y_dot)))
        states.append(tracker.kalman.x[:, 0])
        covariances.append(tracker.kalman.P)
        nis.append(tracker.kalman.mahalanobis**2 if math.isfinite(innovation.range) else math.nan)
    error, P = truth - np.array(states), np.array(covariances)
    nees = np.sum(error * np.linalg.solve(P, error[:, :, np.newaxis])[:, :, 0], axis=1)
    return nees, np.array(nis), np.hypot(error[:, 0], error[:, 2]), np.sqrt(P[:, 0, 0] + P[:, 2, 2])


def fitting(estimator: Estimator, start: tuple[float, float], samples: int) -> Callable[[int], Array]:
    """Targets that the filter's model fits, from `start`, or spread round it where the estimator is given a position.

    Start and velocity are drawn from the initial covariance, the process noise from Q.
    """
    T_s = estimator.period
    F = np.kron(np.eye(2), [[1.0, T_s], [0.0, 1.0]])
    Q = (estimator.process_position_variance, estimator.process_velocity_variance) * 2
    spread = 0.0 if estimator.initial_position is None else estimator.initial_position_variance
    P = (spread, estimator.initial_velocity_variance) * 2
    mean = np.array([start, estimator.initial_velocity]).T.ravel()

    def motion(seed: int) -> Array:
        draw = stream(seed, "target")
        states = [mean + np.sqrt(P) * draw.standard_normal(STATES)]
        for _ in range(samples - 1):
            states.append(F @ states[-1] + np.sqrt(Q) * draw.standard_normal(STATES))
        return np.array(states)

    return motion


def moving(target: Target, estimator: Estimator, duration: float) -> Callable[[int], Array]:
    """One of the harness's own targets, the same for every seed."""
    at = target.start()
    seen = [at(k * estimator.period) for k in range(round(duration / estimator.period) + 1)]
    states = np.array([(s.target_north, s.target_velocity_north, s.target_east, s.target_velocity_east) for s in seen])
    return lambda seed: states


PAPER = Estimator(kind="ekf")


def fitting_case(distance: float, known: bool) -> EstimatorCase:
    """30 s of targets that fit, north-east of the sensor; the start known to 1 m and 0.5 m/s, or measured."""
    start = (distance * math.sqrt(0.5), distance * math.sqrt(0.5))
    estimator = replace(PAPER, initial_position=start, initial_velocity_variance=0.25) if known else PAPER
    how = "known start" if known else "first measurement"
    return EstimatorCase(f"fits, {distance:g} m away, {how}", estimator, fitting(estimator, start, 60))


def cases() -> list[EstimatorCase]:
    """Those of the table."""
    return [
        *(fitting_case(distance, True) for distance in (14.0, 100.0, 1000.0, 4000.0)),
        *(fitting_case(distance, False) for distance in (14.0, 100.0, 1000.0, 4000.0)),
        EstimatorCase("stationary (4.1), 100 s", PAPER, moving(Target(), PAPER, 100.0)),
        EstimatorCase("2 m/s straight, 300 s", PAPER, moving(STRAIGHT, PAPER, 300.0)),
        EstimatorCase("2 m/s in an S (4.2), 1000 s", PAPER, moving(EXPERIMENTS["S"].target, PAPER, 1000.0)),
        EstimatorCase("manoeuvring (4.3), 600 s", PAPER, moving(EXPERIMENTS["manoeuvres"].target, PAPER, 600.0)),
    ]


class Assessed(NamedTuple):
    """What a case comes to, of all seeds."""

    name: str
    nees: float  # the mean
    nees_inside: float  # %: of the sampling times at which the average over the seeds is in its band
    nees_largest: float
    largest_at: float  # s
    nis: float
    nis_inside: float  # %
    error: float  # m rms
    believed: float  # m rms, by the filter's own covariance


def assessed(case: EstimatorCase, seeds: int = SEEDS) -> Assessed:
    """Runs the case and sums it up."""
    runs = examine(case, seeds)
    nees, nis = runs.nees.mean(axis=0), runs.nis[:, ~np.isnan(runs.nis[0])].mean(axis=0)
    worst = int(np.argmax(nees))
    return Assessed(
        case.name,
        float(nees.mean()),
        _inside(nees, STATES, seeds),
        float(nees[worst]),
        worst * case.estimator.period,
        float(nis.mean()),
        _inside(nis, MEASURED, seeds),
        math.sqrt(np.mean(runs.error**2)),
        math.sqrt(np.mean(runs.deviation**2)),
    )


def _inside(averages: Array, numbers: int, seeds: int) -> float:
    low, high = band(numbers, seeds)
    return 100.0 * float(np.mean((low < averages) & (averages < high)))


def table_row(case: Assessed) -> str:
    """A case as a line of the page's table."""
    cells = (
        case.name,
        _digits(case.nees),
        f"{case.nees_inside:.0f} %",
        f"{_digits(case.nees_largest)} at {case.largest_at:g} s",
        _digits(case.nis),
        f"{case.nis_inside:.0f} %",
        _digits(case.error),
        _digits(case.believed),
    )
    return f"| {' | '.join(cells)} |"


def _digits(number: float) -> str:
    return f"{number:.3g}" if number < 100.0 else f"{number:.0f}"


def page(results: Sequence[Assessed], seeds: int) -> str:
    """The page."""
    return (
        template("harness.studies", "estimator.md.jinja").render(
            results=results,
            seeds=seeds,
            nees_band=band(STATES, seeds),
            nis_band=band(MEASURED, seeds),
            table_row=table_row,
            numbers=(STATES, MEASURED),
        )
        + "\n"
    )


@click.command()
@click.option("--seeds", type=click.IntRange(2, 10_000), default=SEEDS, show_default=True, help="Runs of each case.")
@out_option
def main(seeds: int, out: Path) -> None:
    """Run the filter on targets that fit its model and on the paper's; write OUT/estimator.md. Takes two minutes."""
    every = cases()
    results = list(counted((assessed(case, seeds) for case in every), len(every), "running the filter"))
    write(out, {"estimator.md": page(results, seeds)})


if __name__ == "__main__":
    run(main, "harness.studies.estimator")
