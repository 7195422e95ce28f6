"""Each claim may surprise: it can hold, fail, be undecided, and hold under its condition where it has one.

Theory is given other numbers than those of its formulas. Flights are stubbed: some are what the paper describes, some
are drawn.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from autopilot.nftsm import Nftsm
from harness.flight import Flight
from harness.studies.paper import columns
from harness.studies.paper.claims import CLAIMS
from harness.studies.paper.claims_of_the_manifold import inner_rate
from harness.studies.paper.columns import COLUMNS, GRID, label
from harness.studies.paper.experiments import Trace
from harness.studies.paper.ledger import FlownClaim, TheoryClaim, by_flights
from harness.vocabulary import Verdict

Array = NDArray[np.float64]

THEORY = [claim for claims in CLAIMS.values() for claim in claims if isinstance(claim, TheoryClaim)]
FLOWN = [claim for claims in CLAIMS.values() for claim in claims if isinstance(claim, FlownClaim)]
CONDITIONAL = {  # the claims that name a condition
    "2.2a", "3.1c", "3.1d", "3.1e", "3.1f", "3.2h", "3.2m", "3.2n", "3.3b", "3.4e", "3.4g", "3.4h", "3.4j",
    "2.2e", "2.2f", "3.4b", "3.4d", "3.4k", "4.2d", "4.3c", "4.3e", "4.3i", "4.3j", "4.3k", "4.3l", "5a", "5b", "5c",
}  # fmt: skip
TRIALS = 2000

AN_AIRFRAME = GRID[1]
STUBBED = (
    COLUMNS[0]._replace(periods=(0.1, 0.5)),
    AN_AIRFRAME._replace(periods=(0.1, 0.5)),
)


def every_verdict(key: str) -> set[Verdict]:
    return set(Verdict) if key in CONDITIONAL else set(Verdict) - {Verdict.HOLDS_IF}


@pytest.mark.parametrize("claim", THEORY, ids=lambda claim: claim.key)
def test_every_verdict_of_a_claim_of_theory_is_within_reach(claim: TheoryClaim) -> None:
    numbers = claim.measure()
    draw = np.random.default_rng(0)
    seen = {claim.decide(*numbers).verdict, claim.decide(*[math.nan] * len(numbers)).verdict}
    # What a number may become: itself, missing, of another sign, or of other size.
    scales = (1.0, math.nan, -1.0, 0.0, 1e-9, 0.1, 0.4, 0.9, 0.999, 1.001, 1.1, 2.0, 10.0, 1e9)
    for _ in range(TRIALS):
        if draw.random() < 0.5:
            values = [x * float(draw.choice(scales)) if x else x for x in numbers]
        else:
            values = [float(draw.choice((*numbers, 0.0, 1e-3, 0.3, 1.0, 3.0, 1e3, 1e9))) for _ in numbers]
        seen.add(claim.decide(*values).verdict)
    assert seen == every_verdict(claim.key)


@pytest.mark.parametrize("claim", THEORY, ids=lambda claim: claim.key)
def test_a_claim_of_theory_without_its_numbers_is_undecided(claim: TheoryClaim) -> None:
    assert claim.decide(*[math.nan] * len(claim.measure())).verdict is Verdict.UNDECIDED


# What a stubbed flight shows

Shape = Callable[[Array, Flight], Array]


def settles(at: float) -> Shape:
    return lambda t, one: np.where(t < at - 1e-6, 50.0, 0.0)


def knots(*points: tuple[float, float]) -> Shape:
    x, y = zip(*points, strict=True)
    return lambda t, one: np.interp(t, x, y)


def exponential(t: Array, one: Flight) -> Array:
    """The way through eta, from 1 m at the start."""
    assert isinstance(one.law, Nftsm)
    return np.exp(-inner_rate(one.law) * t)


def slow_targets_only(t: Array, one: Flight) -> Array:
    return np.full_like(t, 0.0 if one.target.speed < 4.0 else 50.0)


def overshoots(at: float, by: float) -> Shape:
    return lambda t, one: np.where(t < at - 10.0, 50.0, np.where(t < at - 1e-6, -by, 0.0))


def spikes(**peaks: float) -> Shape:
    """Zero after 20 s but in some of the manoeuvres of Section 4.3: accelerating, after it, the three turns."""
    spans = {"speed": (300.0, 350.0), "after": (351.0, 399.0), "sharp": (400.0, 410.0), "second": (460.0, 470.0),
             "slow": (550.0, 570.0), "late": (800.0, 900.0)}  # fmt: skip

    def shape(t: Array, one: Flight) -> Array:
        r = np.where(t < 24.3 - 1e-6, 50.0, 0.0)
        for name, height in peaks.items():
            begin, end = spans[name]
            r[(t >= begin) & (t <= end)] = height
        return r

    return shape


RANGE: Mapping[str, Shape] = {
    "on the circle": lambda t, one: np.zeros_like(t),
    "off": lambda t, one: np.full_like(t, 50.0),
    "soon": settles(20.0),
    "late": settles(70.0),
    "flees": lambda t, one: 2.0 + t,
    "exponential": lambda t, one: exponential(t, one) if isinstance(one.law, Nftsm) else np.full_like(t, 2.0),
    "overshoots": overshoots(40.0, 5.0),
    "slow targets only": slow_targets_only,
    "within 1 m": lambda t, one: np.where(t < 30.0, 50.0, 0.5),
    "fades": knots((0.0, 50.0), (80.0, 3.0), (100.0, 2.0), (200.0, 1.5), (300.0, 1.0), (400.0, 0.5), (2000.0, 0.1)),
    "speed": spikes(speed=17.4, after=0.2, sharp=0.05),
    "after the speed": spikes(after=20.0),
    "turns": spikes(sharp=0.5, speed=0.05),
    "turns more": spikes(sharp=60.0, second=30.0, slow=20.0, speed=17.4, late=5.0),
}
COMMANDS: Mapping[str, Shape] = {  # deg/s
    "quiet": lambda t, one: np.full_like(t, 1.0),
    "hard at first": knots((0.0, 50.0), (20.0, 50.0), (20.2, 3.0)),
    "hard at 8 s to 17 s": lambda t, one: np.where((t >= 8.0) & (t < 17.0), 50.0, 1.0),
    "hard always": lambda t, one: np.full_like(t, 50.0),
    "hard late": knots((0.0, 1.0), (599.0, 1.0), (601.0, 50.0)),
    "hard in the turn": lambda t, one: np.where((t > 400.0) & (t < 410.0), 4.0 * np.sin(5.0 * t), 1.0),
}
AZIMUTHS: Mapping[str, Shape] = {
    "round": lambda t, one: -0.06 * t,
    "behind": lambda t, one: np.zeros_like(t),
    "to and fro": lambda t, one: np.sin(t),
    "round, then behind": lambda t, one: -0.06 * np.minimum(t, 400.0),
}
SLIDING: Mapping[str, Shape] = {
    "reached": lambda t, one: np.exp(-30.0 * t),
    "reached when free": lambda t, one: np.exp((-30.0 if math.isinf(one.law.max_heading_rate) else -0.01) * t),
    "not": lambda t, one: np.ones_like(t),
    "rises at the limit": lambda t, one: np.where((t >= 8.0) & (t < 17.0), 1.0 + t, 0.1),
    "rises": lambda t, one: 1.0 + t,
}
HEADINGS: Mapping[str, Shape] = {
    "steady": lambda t, one: np.zeros_like(t),
    "jumps at 360 s": lambda t, one: np.where(t < 360.0, -3.0, 3.0),
    "jumps at 370.3 s": lambda t, one: np.where(t < 370.3 - 1e-6, -3.0, 3.0),
}

_PAPERS_RANGE: Mapping[tuple[float, str], Shape] = {  # by the heading of the start, deg: what Section 4 prints
    (30.0, "NFTSM"): settles(31.2),
    (30.0, "NFTSM as printed"): settles(31.2),
    (30.0, "NFTSM_1"): overshoots(37.3, 5.0),
    (30.0, "SMC"): knots((0.0, -50.0), (80.0, -0.742), (400.0, -0.1)),
    (130.0, "NFTSM"): settles(72.9),
    (130.0, "NFTSM as printed"): settles(72.9),
    (130.0, "NFTSM_1"): RANGE["off"],
    (130.0, "SMC"): knots((0.0, -50.0), (100.0, -3.0), (400.0, -0.1)),
    (70.0, "NFTSM"): settles(38.8),
    (70.0, "NFTSM_1"): lambda t, one: (
        np.where(t < 60.0, 50.0, np.where(t < 81.6 - 1e-6, -0.5, 0.0)) - np.where((t > 60.0) & (t < 70.0), 5.0, 0.0)
    ),
    (70.0, "SMC"): lambda t, one: np.where(t < 100.0, 50.0, np.where(t < 399.0, 0.18, 0.0)),
}


def papers_range(t: Array, one: Flight) -> Array:
    """What the paper prints of the flight, or says of it."""
    name, heading = label(one.law), round(math.degrees(one.start.heading), 6)
    if one.target.speed > 13.0:
        return RANGE["flees"](t, one)
    if isinstance(one.law, Nftsm) and name == "NFTSM" and (one.law.alpha2, one.law.beta2) != (0.4, 2.4):
        sooner = 31.2 - 4.0 * (one.law.alpha2 - 0.4) - (one.law.beta2 - 2.4)
        return (overshoots(sooner, 5.0) if one.law.alpha2 > 1.0 else settles(sooner))(t, one)
    if one.target.segments and heading == 30.0:
        shapes: dict[str, Shape] = {
            "NFTSM": spikes(sharp=0.05, speed=0.01),
            "NFTSM_1": lambda t, one: np.where(t < 34.2 - 1e-6, 50.0, spikes(sharp=0.5)(t, one) * (t > 40.0)),
            "SMC": lambda t, one: np.where(
                t < 113.6 - 1e-6,
                50.0,
                knots((113.6, 0.5), (299.9, 0.1), (300.0, 17.4), (350.0, 17.0), (399.0, 0.1), (460.0, 0.1),
                      (465.0, 20.0), (480.0, 0.1), (900.0, 0.1))(t, one),
            ),
        }  # fmt: skip
        return shapes[name](t, one)
    if (one.target.speed and not one.target.segments) or one.wind.steady != (0.0, 0.0):
        return RANGE["soon"](t, one)
    return _PAPERS_RANGE[heading, name](t, one)


PAPERS: Mapping[str, Shape] = {
    "range": papers_range,
    "command": lambda t, one: COMMANDS["hard at first" if label(one.law) != "SMC" else "quiet"](t, one),
    "unlimited": COMMANDS["hard at 8 s to 17 s"],
    "azimuth": lambda t, one: AZIMUTHS["behind" if one.target.speed > 10.0 else "round, then behind"](t, one),
    "sliding": SLIDING["reached"],
    "heading": lambda t, one: HEADINGS["jumps at 370.3 s" if label(one.law) == "SMC" else "jumps at 360 s"](t, one),
}
DRAWN: Mapping[str, Mapping[str, Shape]] = {
    "range": RANGE,
    "command": COMMANDS,
    "unlimited": COMMANDS,
    "azimuth": AZIMUTHS,
    "sliding": SLIDING,
    "heading": HEADINGS,
}


def stubbed(one: Flight, shapes: Mapping[str, Shape]) -> Trace:
    """A flight that shows these shapes."""
    t = np.linspace(0.0, one.duration, round(one.duration * 10.0) + 1)
    value = {name: shape(t, one) for name, shape in shapes.items()}
    limit = min(one.law.max_heading_rate, math.radians(60.0))
    command = np.clip(np.radians(value["command"]), -limit, limit)
    return Trace(
        one,
        {
            "time": t,
            "north": np.cos(value["azimuth"]),
            "east": np.sin(value["azimuth"]),
            "heading": value["heading"],
            "heading_rate_command": command,
            "unlimited_command": np.radians(value["unlimited"]),
            "sliding_variable": value["sliding"],
            "range_error": value["range"],
            **{f"target_{name}": np.zeros_like(t) for name in ("north", "east", "velocity_north", "velocity_east")},
        },
    )


def _kind(one: Flight) -> tuple[object, ...]:
    """What flights have in common that differ in the target's speed or their length alone: they are drawn alike."""
    return (one.law, one.start.heading, one.target.segments, one.target.speed > 13.0, one.estimator, one.wind.steady)


class Stubs:
    """Flights of one trial: each kind of flight is what the paper describes, or drawn."""

    def __init__(self, seed: int) -> None:
        self.draw = np.random.default_rng(seed)
        self.papers = (1.0, 0.7, 0.3)[seed % 3]  # the chance that a flight is what the paper describes
        self.kinds: dict[tuple[object, ...], Mapping[str, Shape]] = {}

    def flown(self, one: Flight) -> Trace:
        one = replace(one, plant="kinematic")
        shapes = self.kinds.setdefault(_kind(one), self._shapes())
        return stubbed(one, shapes)

    def _shapes(self) -> Mapping[str, Shape]:
        if self.draw.random() < self.papers:
            return PAPERS
        return {name: shapes[str(self.draw.choice(list(shapes)))] for name, shapes in DRAWN.items()}

    def measured(self, one: Flight) -> tuple[Mapping[str, float | None], str, bool]:
        bad = self.draw.random() > self.papers
        values: dict[str, float | None] = {
            "heading_rate_error_rms_deg_s": 5.0 if bad else 0.01,
            "airspeed_deviation_rms_mps": 0.01,
            "altitude_deviation_peak_m": 0.1,
            "turn_ratio": 0.5 if bad else 1.0,
            "sideslip_peak_deg": 0.1,
        }
        if self.draw.random() < 0.2:
            values[str(self.draw.choice(list(values)))] = None
        return values, "", False


@pytest.mark.parametrize("claim", FLOWN, ids=lambda claim: claim.key)
def test_every_verdict_of_a_flown_claim_is_within_reach(claim: FlownClaim, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = set()
    wanted = every_verdict(claim.key) - {Verdict.UNDECIDED}
    for seed in range(TRIALS):
        stubs = Stubs(seed)
        monkeypatch.setattr(columns, "flown", stubs.flown)
        monkeypatch.setattr(columns, "_measured", stubs.measured)
        seen |= {by_flights(claim, column).verdict for column in STUBBED}
        if wanted <= seen:
            break
    assert wanted <= seen <= every_verdict(claim.key)


@pytest.mark.parametrize("claim", FLOWN, ids=lambda claim: claim.key)
def test_a_claim_whose_flights_failed_is_undecided(claim: FlownClaim, monkeypatch: pytest.MonkeyPatch) -> None:
    def failed(one: Flight) -> Any:
        return Trace(one, {}, "invalid after 1.0 s (a number is not finite)", failed=True)

    monkeypatch.setattr(columns, "flown", failed)
    monkeypatch.setattr(columns, "_measured", lambda one: ({}, "invalid after 1.0 s", True))
    decision = by_flights(claim, STUBBED[0])
    assert decision.verdict is Verdict.UNDECIDED
    assert "ended: invalid" in decision.number


@pytest.mark.parametrize("metric", ["heading_rate_error_rms_deg_s", "airspeed_deviation_rms_mps",
                                    "altitude_deviation_peak_m", "turn_ratio", "sideslip_peak_deg"])  # fmt: skip
def test_a_claim_on_metrics_is_undecided_when_one_is_missing(metric: str, monkeypatch: pytest.MonkeyPatch) -> None:
    values = {
        "heading_rate_error_rms_deg_s": 0.01,
        "airspeed_deviation_rms_mps": 0.01,
        "altitude_deviation_peak_m": 0.1,
        "turn_ratio": 1.0,
        "sideslip_peak_deg": 0.1,
    }
    claims = [claim for claim in FLOWN if claim.key in ("2.1a", "2.1c")]
    monkeypatch.setattr(columns, "_measured", lambda one: (values, "", False))
    assert [by_flights(claim, AN_AIRFRAME).verdict for claim in claims] == [Verdict.HOLDS] * 2
    monkeypatch.setattr(columns, "_measured", lambda one: ({**values, metric: None}, "", False))
    assert Verdict.UNDECIDED in [by_flights(claim, AN_AIRFRAME).verdict for claim in claims]
