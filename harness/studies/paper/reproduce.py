"""The numbers that the paper prints, beside ours, and how ours move with what the paper leaves open."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

from harness.studies.paper.experiments import (
    EKF,
    EXPERIMENTS,
    NEITHER,
    NO_ACCELERATION,
    NO_TURN_RATE,
    TRUTH,
    Reading,
    flight,
    flown,
)
from harness.studies.paper.measures import (
    delay,
    error_after_320_s,
    final_error,
    peak_in_all_manoeuvres,
    peak_while_accelerating,
    restricted,
    settled,
    settled_before_the_manoeuvres,
    settled_to_1_m_before_the_manoeuvres,
)

VARIANTS: Mapping[str, Mapping[str, Any]] = MappingProxyType(  # one thing at a time read differently
    {
        "1 ms": {"period": 0.001},
        "5 ms": {"period": 0.005},
        "50 ms": {"period": 0.05},
        "0.5 s": {"period": 0.5},
        "wind": {"wind": (0.1, 0.2)},
        "limit": {"limited": True},
        "no limit": {"limited": False},
        "a, w": {"known": TRUTH},
        "w": {"known": NO_ACCELERATION},
        "a": {"known": NO_TURN_RATE},
        "neither": {"known": NEITHER},
        "EKF": {"known": EKF},
    }
)
VARIANTS_IN_WORDS = (
    "command held for 1 ms to 0.5 s (the paper's sampling); the wind of Table 1; every law limited to 5 deg/s, or "
    "none; the law told the target's acceleration a and turn rate w, one of them, neither; or the EKF with the "
    "paper's noise"
)

Value = float | tuple[float, float] | None  # a number, an interval, or none: it does not converge


class Number(NamedTuple):
    """A number that the paper prints, and how to find it in a log."""

    where: str
    law: str
    what: str
    printed: str
    value: Value
    places: int  # decimals printed
    experiment: str
    measure: Callable[..., Value]  # of the law's log, and of that of the law `against`
    against: str = ""
    at_most: bool = False  # the paper gives a bound

    def agrees(self, ours: Value) -> bool:
        """Whether our number rounds to the printed one."""
        if ours is None or self.value is None:
            return ours is self.value
        if isinstance(ours, tuple) or isinstance(self.value, tuple):
            return ours == self.value or formatted(self, ours) == formatted(self, self.value)
        return ours <= self.value if self.at_most else round(ours, self.places) == self.value


_FROM_30, _FROM_130 = "converges to 1e-4 m, from 30 deg", "converges to 1e-4 m, from 130 deg"
_BEFORE = settled_before_the_manoeuvres
NUMBERS = (
    Number("Table 3", "NFTSM", _FROM_30, "31.2 s", 31.2, 1, "30", settled),
    Number("Table 3", "SMC", "error after 80 s, from 30 deg", "-0.742 m", -0.742, 3, "30", final_error),
    Number("Table 3", "NFTSM_1", _FROM_30, "37.3 s", 37.3, 1, "30", settled),
    Number("Table 3", "NFTSM", _FROM_130, "72.9 s", 72.9, 1, "130", settled),
    Number("Table 3", "SMC", _FROM_130, "not in 100 s", None, 1, "130", settled),
    Number("Table 3", "NFTSM_1", _FROM_130, "shock", None, 1, "130", settled),
    Number("Table 3", "NFTSM as printed", _FROM_30, "31.2 s", 31.2, 1, "30", settled),
    Number("Table 3", "NFTSM as printed", _FROM_130, "72.9 s", 72.9, 1, "130", settled),
    Number("4.1", "NFTSM", "restricted, from 130 deg", "8-17 s", (8.0, 17.0), 0, "130", restricted),
    Number("4.2", "NFTSM", "converges to 1e-4 m", "38.8 s", 38.8, 1, "S", settled),
    Number("4.2", "NFTSM_1", "converges to 1e-4 m", "81.6 s", 81.6, 1, "S", settled),
    Number("4.2", "SMC", "error after 320 s", "0.18 m", 0.18, 2, "S", error_after_320_s),
    Number("4.3", "NFTSM", "converges to 1e-4 m, before 300 s", "24.3 s", 24.3, 1, "manoeuvres", _BEFORE),
    Number("4.3", "NFTSM_1", "converges to 1e-4 m, before 300 s", "34.2 s", 34.2, 1, "manoeuvres", _BEFORE),
    Number(
        "4.3",
        "SMC",
        "converges to 1 m, before 300 s",
        "113.6 s",
        113.6,
        1,
        "manoeuvres",
        settled_to_1_m_before_the_manoeuvres,
    ),
    Number("4.3", "SMC", "peak while accelerating", "17.4 m", 17.4, 1, "manoeuvres", peak_while_accelerating),
    Number("4.3", "SMC", "heading behind NFTSM's, 350-400 s", "10.3 s", 10.3, 1, "manoeuvres", delay, "NFTSM"),
    Number(
        "4.3", "NFTSM", "peak in all manoeuvres", "<= 0.1 m", 0.1, 1, "manoeuvres", peak_in_all_manoeuvres, at_most=True
    ),
)  # fmt: skip


class Reproduced(NamedTuple):
    """A printed number beside ours, under the experiment's reading and under others."""

    number: Number
    ours: Value
    agrees: bool
    otherwise: Mapping[str, Value]  # by what is read differently; without those that are the reading itself


def under(number: Number, reading: Reading) -> Value:
    """The number under a reading."""
    duration = EXPERIMENTS[number.experiment].measured
    laws = (number.law, number.against) if number.against else (number.law,)
    return number.measure(*(flown(flight(number.experiment, law, reading, duration)) for law in laws))


def reproduced(numbers: tuple[Number, ...]) -> list[Reproduced]:
    """The numbers under their experiment's reading, and with one thing at a time read differently.

    All are of one law in one experiment, so that each flight is flown once.
    """
    first = numbers[0]
    reading = EXPERIMENTS[first.experiment].reading
    by_reading = {"": [under(number, reading) for number in numbers]}
    for name, changed in VARIANTS.items():
        other = replace(reading, **changed)
        if flight(first.experiment, first.law, other) != flight(first.experiment, first.law, reading):
            by_reading[name] = [under(number, other) for number in numbers]
    ours = by_reading.pop("")
    return [
        Reproduced(number, ours[i], number.agrees(ours[i]), {name: values[i] for name, values in by_reading.items()})
        for i, number in enumerate(numbers)
    ]


def by_flight() -> list[tuple[Number, ...]]:
    """The numbers by experiment and law: what can be flown apart."""
    groups: dict[tuple[str, str], list[Number]] = {}
    for number in NUMBERS:
        groups.setdefault((number.experiment, number.law), []).append(number)
    return [tuple(group) for group in groups.values()]


def in_order(results: list[Reproduced]) -> list[Reproduced]:
    """As the paper has them."""
    return sorted(results, key=lambda result: NUMBERS.index(result.number))


def formatted(number: Number, value: Value) -> str:
    """A value of ours with as many decimals as the paper prints, or a dash for none."""
    if value is None:
        return "-"
    if isinstance(value, tuple):
        return "-".join(f"{end:.{number.places}f}" for end in value)
    return f"{value + 0.0:.{number.places}f}"


def table(results: list[Reproduced]) -> list[str]:
    """The numbers in lines: the paper's, ours, whether they agree."""
    lines = [f"{'where':8}{'law':18}{'what':36}{'paper':>13}{'ours':>8} agrees"]
    for r in results:
        n = r.number
        agrees = "yes" if r.agrees else "no"
        lines.append(f"{n.where:8}{n.law:18}{n.what:36}{n.printed:>13}{formatted(n, r.ours):>8} {agrees:>6}")
    return lines


def moved(results: list[Reproduced]) -> list[str]:
    """Ours again, and what they become when one thing is read differently; a point: that is the reading itself."""
    lines = [f"{'law':18}{'what':36}{'ours':>7}" + "".join(f"{name:>9}" for name in VARIANTS)]
    for r in results:
        n = r.number
        others = (formatted(n, r.otherwise[name]) if name in r.otherwise else "." for name in VARIANTS)
        lines.append(f"{n.law:18}{n.what:36}{formatted(n, r.ours):>7}" + "".join(f"{text:>9}" for text in others))
    return lines
