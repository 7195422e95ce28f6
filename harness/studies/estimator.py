"""Is the estimator as sure as it ought to be? `python -m harness.studies.estimator [SEEDS]`: NEES and NIS.

NEES, the error of the state squared over its covariance, is 4 on average for a filter that is as good as it believes
itself, NIS, the same of the innovation, 2; more is overconfidence. The average over the seeds at one moment lies within
the band of its chi-square distribution 95 % of the time (Bar-Shalom, Li & Kirubarajan 2001, Section 5.4).
"""

import math
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from autopilot.estimator import Estimator, ekf
from harness.knowledge import sensor
from harness.studies.paper.experiments import EXPERIMENTS
from harness.world.randomness import stream
from harness.world.target import Segment, Target, TargetState

Array = NDArray[np.float64]

SEEDS = 200
STATES, MEASURED = 4, 2  # numbers in X and in Z


class Case(NamedTuple):
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


def examine(case: Case, seeds: int = SEEDS) -> Consistency:
    """Runs the filter on the case with every seed."""
    runs = [_run(case, seed) for seed in range(seeds)]
    return Consistency._make(np.array(rows) for rows in zip(*runs, strict=True))


def _run(case: Case, seed: int) -> tuple[Array, Array, Array, Array]:
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
SLOW = Target(speed=2.0, heading=math.radians(-45.0))
_QUARTER = math.radians(90.0) / 250.0
S_SHAPE = Target(
    speed=2.0,
    heading=math.radians(-45.0),
    segments=(
        Segment(from_=0.0, to=250.0, turn_rate=_QUARTER),
        Segment(from_=250.0, to=750.0, turn_rate=-_QUARTER),
        Segment(from_=750.0, to=1000.0, turn_rate=_QUARTER),
    ),
)
MANOEUVRING = EXPERIMENTS["manoeuvres"].target


def fitting_case(distance: float, known: bool) -> Case:
    """30 s of targets that fit, north-east of the sensor; the start known to 1 m and 0.5 m/s, or measured."""
    start = (distance * math.sqrt(0.5), distance * math.sqrt(0.5))
    estimator = replace(PAPER, initial_position=start, initial_velocity_variance=0.25) if known else PAPER
    how = "known start" if known else "first measurement"
    return Case(f"fits, {distance:g} m away, {how}", estimator, fitting(estimator, start, 60))


def cases() -> list[Case]:
    """Those of the table."""
    return [
        *(fitting_case(distance, True) for distance in (14.0, 100.0, 1000.0, 4000.0)),
        *(fitting_case(distance, False) for distance in (14.0, 100.0, 1000.0, 4000.0)),
        Case("stationary (4.1), 100 s", PAPER, moving(Target(), PAPER, 100.0)),
        Case("2 m/s straight, 300 s", PAPER, moving(SLOW, PAPER, 300.0)),
        Case("2 m/s in an S (4.2), 1000 s", PAPER, moving(S_SHAPE, PAPER, 1000.0)),
        Case("manoeuvring (4.3), 600 s", PAPER, moving(MANOEUVRING, PAPER, 600.0)),
    ]


def table_row(case: Case, seeds: int = SEEDS) -> str:
    """A case as a line of the Markdown table."""
    found = examine(case, seeds)
    cells = [case.name]
    for values, numbers in ((found.nees, STATES), (found.nis[:, ~np.isnan(found.nis[0])], MEASURED)):
        at_once = values.mean(axis=0)
        low, high = band(numbers, seeds)
        inside = np.mean((low < at_once) & (at_once < high))
        worst = int(np.argmax(at_once))
        cells += [_shown(at_once.mean()), f"{100.0 * inside:.0f} %"]
        cells += [f"{_shown(at_once[worst])} at {worst * case.estimator.period:g} s"] * (numbers == STATES)
    cells += [_shown(math.sqrt(np.mean(x * x))) for x in (found.error, found.deviation)]
    return f"| {' | '.join(cells)} |"


def _shown(number: float) -> str:
    return f"{number:.3g}" if number < 100.0 else f"{number:.0f}"


def main(seeds: int) -> None:
    """Prints the table."""
    nees, nis = (f"{low:.2f}–{high:.2f}" for low, high in (band(STATES, seeds), band(MEASURED, seeds)))
    titles = (f"target, {seeds} seeds", "NEES", f"in {nees}", "largest", "NIS", f"in {nis}", "error, m rms", "believed")
    print(f"| {' | '.join(titles)} |\n|{'---|' * len(titles)}")
    for case in cases():
        print(table_row(case, seeds), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS)
