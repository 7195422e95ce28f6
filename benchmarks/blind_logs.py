"""Whether `harness assess` recovers what was hidden in logs: python -m benchmarks.blind_logs.

The harness flies its 6-DOF aircraft and writes the flights as an autopilot would: rates, noise, telemetry age, airspeed
scale, wind, signs and repeated rows are drawn at random, and `assess` is told none of them. Writes
docs/answers/blind_logs.md.
"""

import collections
import math
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import aircraft
import harness
from benchmarks.blind_flights import FOLLOWED, OTHERS, Hidden, blind_log
from harness.files import replacing
from harness.flight import Flight
from harness.loop import simulate
from harness.plants.plant import Start
from harness.pool import computed
from harness.recorded import fitted_plant
from harness.recorded.assessment import Assessment, assess
from harness.recorded.part_finding import CANNOT
from harness.recorded.recorded_flight import LogError
from harness.tables import markdown
from harness.verdict.parts import PARTS
from harness.vocabulary import Verdict

Array = NDArray[np.float64]

PAGE = Path("docs/answers/blind_logs.md")
LOGS = 200
DECIDED = {Verdict.HOLDS, Verdict.FAILS}
COVERED, WRONG = 0.90, 0.05  # what is asked: of the intervals, at least; of the claims, at most
CIRCLE = 15.4  # s: the standoff distance of the paper's case over its airspeed
TURN, SCALE, WIND = "turn relation", "airspeed scale", "wind"


class Told(NamedTuple):
    """What was said of one hidden number; None where nothing was."""

    covered: bool | None = None
    width: float = math.nan  # of the interval
    wrong: bool = False  # a word that the truth contradicts
    at_most: bool = False  # an upper bound, which has no lower one


class Gains(NamedTuple):
    """What became of the limit cycle of the paper's gains with those that follow from the log."""

    refused: str = ""  # why no aircraft could be fitted
    before: bool | None = None  # whether the aircraft that wrote the log is in a limit cycle; None: not to be told
    after: bool | None = None


class Answer(NamedTuple):
    """What `assess` made of one log."""

    seed: int
    kind: str
    format: str
    told: Mapping[str, Told]
    signs_right: bool
    reason: str  # why there is no turn relation; empty where there is one
    gains: Gains
    decided: int  # words, holds or fails, of the other parts
    contradicted: Sequence[str]  # those of them that the true flight has the other way


def answered(seed: int) -> Answer:
    """One log, written and assessed."""
    blind = blind_log(seed)
    found = assess(blind.recorded())
    return compared(seed, blind.hidden, found)._replace(gains=gains_of(blind.flight, found))


def gains_of(flight: Flight, found: Assessment) -> Gains:
    """Flies the paper's gains, and those by rule for the fitted aircraft, on the one that wrote the log."""
    speed = flight.start.airspeed
    standoff = CIRCLE * speed
    circle: dict[str, Any] = {"standoff": standoff, "max_heading_rate": math.radians(10.0)}
    start = Start(position=(-0.5 * standoff, 0.3 * standoff), heading=0.5, airspeed=speed)
    before = Flight(
        plant="sixdof", law=harness.law("nftsm", "paper_1", **circle), aircraft=flight.aircraft, start=start,
        duration=150.0,
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "my_flight.toml"
        try:
            file.write_text(fitted_plant.document(found), encoding="utf-8")
        except LogError as error:
            return Gains(refused=str(error))
        recorded = replace(start, airspeed=aircraft.limits(file).design_airspeed)
        fitted = replace(before, plant="lagged", aircraft=str(file), start=recorded)
        law = harness.law("nftsm", "behind_inner_loop", flight=fitted, **circle)
    told = [simulate(each).metrics["chatters"] for each in (before, replace(before, law=law))]
    return Gains("", *(None if each is None else bool(each) for each in told))


def compared(seed: int, hidden: Hidden, found: Assessment) -> Answer:
    """What was said beside what was hidden."""
    told = {TURN: Told(), SCALE: Told(), WIND: Told(), **{of.lag.title: Told() for of in FOLLOWED}}
    relation = found[PARTS["turn_ratio"].title]
    if relation.word != CANNOT:
        low, high = relation.bounds
        assert low is not None
        assert high is not None
        word = Verdict.HOLDS if low <= hidden.turn_ratio <= high else Verdict.FAILS
        wrong = relation.word not in (word, Verdict.UNDECIDED)
        told[TURN] = _told(hidden.turn_ratio, relation.low, relation.high)._replace(wrong=wrong)
    if found.wind and found.wind.source == "track":
        parts = [
            _told(true, low, high)
            for true, (_, low, high) in zip(hidden.wind, (found.wind.north, found.wind.east), strict=True)
        ]
        told[WIND] = Told(all(part.covered for part in parts), max(part.width for part in parts))
        if found.wind.scale:
            told[SCALE] = _told(hidden.scale, *found.wind.scale[1:])
    for of in FOLLOWED:
        lag = found[of.lag.title]
        if lag.word != CANNOT:
            one = _told(hidden.lags[of.noun], lag.low, lag.high)
            told[of.lag.title] = one._replace(at_most=lag.value == lag.high)
    signs = (
        found.estimated is None
        or relation.word == CANNOT
        or (found.estimated.is_reversed is hidden.wind_reversed or math.hypot(*hidden.wind) < 1.0)
    ) and (relation.word == CANNOT or any("bank: the sign" in note for note in found.notes) is hidden.bank_reversed)
    reason = relation.reason if relation.word == CANNOT else ""
    decided = {part.title: found[part.title].word for part in OTHERS if found[part.title].word in DECIDED}
    contradicted = [title for title, word in decided.items() if {word, hidden.words[title]} == DECIDED]
    return Answer(seed, hidden.kind, hidden.format, told, signs, reason, Gains(), len(decided), contradicted)


def _told(true: float, low: float, high: float) -> Told:
    return Told(bool(low <= true <= high), high - low)


def page(answers: Sequence[Answer]) -> Iterator[str]:
    """The lines of the page."""
    yield "# Blind logs"
    yield ""
    yield "Does `harness assess` recover what is hidden in a log?"
    yield ""
    yield "`python -m benchmarks.blind_logs` computes and writes this page (a few minutes)."
    formats = collections.Counter(answer.format for answer in answers)
    yield f"The logs are files: {', '.join(f'{count} {name}' for name, count in sorted(formats.items()))}."
    yield "The harness flies its 6-DOF aircraft, in circles, behind a target that turns left and right, or straight"
    yield "ahead, in wind up to a third of the airspeed, a third of the flights in light turbulence, and logs them as"
    yield "an autopilot would. Drawn at random and hidden: the messages' rates and noise, the age of the telemetry, the"
    yield "airspeed's scale (0.88 to 1.12), the wind and the autopilot's estimate of it, the signs of wind and bank,"
    yield "and how often rows repeat. In a straight flight there is no turn to judge."
    yield ""
    rows = []
    for name in (TURN, WIND, SCALE, *(of.lag.title for of in FOLLOWED)):
        told = [answer.told[name] for answer in answers if answer.told[name].covered is not None]
        for at_most in (True, False):
            some = [each for each in told if each.at_most is at_most]
            if some or (not at_most and not told):
                rows.append(_row(f"{name}, at most" if at_most else name, some, len(answers) - len(told)))
    yield from markdown(
        ["hidden", "within its 95 % interval", "width, median", "refused", "claimed wrongly"], rows, "lrrrr"
    )
    yield ""
    yield f"Asked: {COVERED:.0%} of {len(answers)} logs within the interval, {WRONG:.0%} claimed wrongly at most."
    yield "The turn relation is that of the same windows of the true flight; wind in m/s, both components within; the"
    yield "lags in s, of a fit to the true flight: upper bounds where the age of the telemetry is in the times, or new"
    yield "values are few. Heading rates are commanded in the CSV files alone."
    decided, contradicted = (sum(answer.decided for answer in answers), [t for a in answers for t in a.contradicted])
    yield "Level flight, constant airspeed, lateral force, and bank or heading rate as commanded hold or fail"
    yield f"{decided} times;"
    yield f"{len(contradicted)} of these words contradict the true flight's."
    signs = sum(answer.signs_right for answer in answers)
    yield f"The signs of wind and bank were told right in {signs} of {len(answers)} logs."
    yield ""
    straight = [answer for answer in answers if answer.kind == "straight"]
    refused = [answer for answer in straight if answer.reason]
    reasons = [answer.reason for answer in answers if answer.reason]
    yield f"{len(reasons)} logs have no turn relation, {len(refused)} of them of the {len(straight)} straight flights:"
    yield ""
    for reason in sorted(set(map(_without_numbers, reasons))):
        count = sum(_without_numbers(each) == reason for each in reasons)
        yield f"- {reason}: {count}"
    yield ""
    yield "## The gains that follow"
    yield ""
    yield "`harness assess --fit` writes the aircraft of the log; the gain set `behind_inner_loop` is computed for it."
    yield "Flown on the 6-DOF aircraft that wrote the log, on the paper's circle in still air:"
    yield ""
    fitted = [answer.gains for answer in answers if not answer.gains.refused]
    states: tuple[tuple[bool | None, str], ...] = ((True, "limit cycle"), (None, "not to be told"), (False, "none"))
    counts = [
        [word, str(sum(each.before is state for each in fitted)), str(sum(each.after is state for each in fitted))]
        for state, word in states
    ]
    yield from markdown(["of the logs with a fit", "the paper's gains", "gains by the fit"], counts, "lrr")
    yield ""
    yield f"No aircraft was fitted to {len(answers) - len(fitted)} of {len(answers)} logs:"
    yield ""
    refusals = [_without_numbers(answer.gains.refused.partition(": ")[2]) for answer in answers if answer.gains.refused]
    yield from (f"- {reason}: {refusals.count(reason)}" for reason in sorted(set(refusals)))


def _row(name: str, told: Sequence[Told], refused: int) -> list[str]:
    inside = sum(bool(each.covered) for each in told)
    share = f"{inside} of {len(told)} ({inside / max(1, len(told)):.0%})"
    width = f"{np.median([each.width for each in told]):.3g}" if told else ""
    return [name, share, width, str(refused), str(sum(each.wrong for each in told))]


def _without_numbers(reason: str) -> str:
    return " ".join("N" if any(c.isdigit() for c in word) else word for word in reason.split())


def main(logs: int = LOGS, page_path: Path = PAGE, workers: int | None = None) -> list[Answer]:
    """Writes and assesses the logs, and writes the page."""
    jobs = [partial(answered, seed) for seed in range(logs)]
    answers = sorted(computed(jobs, (os.cpu_count() or 1) if workers is None else workers), key=lambda one: one.seed)
    with replacing(page_path) as partial_page:
        partial_page.write_text("\n".join(page(answers)) + "\n", encoding="utf-8")
    print(page_path)
    return answers


if __name__ == "__main__":
    main()
