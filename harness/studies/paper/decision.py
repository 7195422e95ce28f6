"""What is decided of a claim: a verdict, the numbers that it rests on, and the condition where it needs one.

An answer is true, false, or None where a number is missing: then nothing is decided that hangs on it.
"""

import math
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from harness.vocabulary import Verdict

Answer = bool | None


class Decision(NamedTuple):
    """A verdict and the numbers it rests on; the condition goes with `HOLDS_IF`."""

    verdict: Verdict
    number: str
    condition: str = ""

    def __str__(self) -> str:
        return f"**{self.verdict}**{f' {self.condition}' if self.condition else ''}: {self.number}"


def decide(always: Answer, number: str, *, under: Mapping[str, Answer] = MappingProxyType({})) -> Decision:
    """Holds where `always` is true, holds if the first true condition of `under`, fails where all answers are false.

    Undecided where the answer that is needed is missing. `under` maps each condition, in words, to whether the claim
    holds under it.
    """
    if always:
        return Decision(Verdict.HOLDS, number)
    if always is None:
        return Decision(Verdict.UNDECIDED, number)
    for condition, answer in under.items():
        if answer:
            return Decision(Verdict.HOLDS_IF, number, condition)
    return Decision(Verdict.UNDECIDED if None in under.values() else Verdict.FAILS, number)


def less(a: float | None, b: float | None) -> Answer:
    """Whether a < b; None where either is missing or no number."""
    return None if _is_missing(a) or _is_missing(b) else a < b  # type: ignore[operator]


def every(*answers: Answer) -> Answer:
    """Whether all are true: false as soon as any is, else None as soon as any is missing."""
    return False if False in answers else None if None in answers else True


def opposite(answer: Answer) -> Answer:
    """Whether it is false; None where it is missing."""
    return None if answer is None else not answer


def sooner(a: float | None, b: float | None) -> bool:
    """Whether a time comes before another, where None means never."""
    return a is not None and (b is None or a < b)


def _is_missing(x: float | None) -> bool:
    return x is None or math.isnan(x)


def metres(x: float | None) -> str:
    """A distance; one that is rounding only is not given by its digits."""
    if x is None or math.isnan(x):
        return "no number of m"
    if x < 1e-6:
        return "below 1e-6 m"
    return f"{x:.2g} m" if x < 99.5 else f"{x:.0f} m"


def below(x: float | None) -> str:
    """The power of ten that a small error stays below, 1e-9 at the least: further down it is rounding."""
    if x is None or not math.isfinite(x):
        return "no number"
    return f"less than 1e{max(-9, math.floor(math.log10(max(x, 1e-30))) + 1)}"


def within(time: float | None) -> str:
    """In how long, or never."""
    return "never" if time is None else f"in {time:g} s"


def largest(*numbers: float) -> float:
    """The largest of the numbers, NaN where any is: `max` would leave it out or not, by its place."""
    return math.nan if any(map(math.isnan, numbers)) else max(numbers)


def all_less(numbers: Iterable[float], bound: float) -> Answer:
    """Whether all of the numbers are below the bound."""
    return every(*(less(x, bound) for x in numbers))
