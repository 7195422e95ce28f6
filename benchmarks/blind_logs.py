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
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import aircraft
import harness
from benchmarks.blind_files import FORMATS, Stream
from harness.files import replacing
from harness.flight import Flight
from harness.log import FlightLog
from harness.loop import simulate
from harness.plants.plant import Start
from harness.pool import computed
from harness.recorded import fitted_plant, response_fit, turn
from harness.recorded.assessment import CANNOT, GAIN, LAG, LATERAL, Assessment, assess
from harness.recorded.recorded_flight import Basis, Channel, LogError, RecordedFlight
from harness.recorded.wind import Fit, track_of
from harness.tables import markdown
from harness.verdict.parts import PARTS
from harness.vocabulary import Verdict
from harness.world.target import Segment, Target
from harness.world.wind import Wind

Array = NDArray[np.float64]

PAGE = Path("docs/answers/blind_logs.md")
LOGS = 200
DECIDED = {Verdict.HOLDS, Verdict.FAILS}
COVERED, WRONG = 0.90, 0.05  # what is asked: of the intervals, at least; of the claims, at most
OTHERS = (
    PARTS["altitude_deviation_peak_m"],
    PARTS["airspeed_deviation"],
    LATERAL,
    GAIN,
)  # parts without a hidden number
CIRCLE = 15.4  # s: the standoff distance of the paper's case over its airspeed
KINDS = ("circles", "manoeuvres", "straight")
SHARES = (0.4, 0.4, 0.2)
TURN, SCALE, WIND, LAG_ROW = "turn relation", "airspeed scale", "wind", "lag"


@dataclass(frozen=True, slots=True)
class Hidden:
    """What `assess` is not told."""

    kind: str
    format: str  # of the file
    scale: float  # true airspeed over the logged one
    wind_reversed: bool  # the autopilot's wind points to where it comes from
    bank_reversed: bool
    of_receipt: bool  # the times are of receipt, with the age of the telemetry
    turbulent: bool
    turn_ratio: float  # of the same windows of the true flight; NaN without turns
    wind: tuple[float, float]  # mean over the flight, m/s north, east
    lag: float  # of the bank behind its command, s; NaN where the command does not move
    words: Mapping[str, str]  # of the other parts, by title, as the true flight has them


@dataclass(frozen=True, slots=True)
class BlindLog:
    """A flight as an autopilot would log it."""

    flight: Flight
    streams: Mapping[str, Stream]
    hidden: Hidden

    def recorded(self) -> RecordedFlight:
        """The log, written to a file and read back."""
        with tempfile.TemporaryDirectory() as folder:
            return FORMATS[self.hidden.format](Path(folder), self.streams, self.hidden.of_receipt)


def flight_of(of: np.random.Generator, kind: str) -> Flight:
    """A flight of this kind: on a circle, behind a target that turns left and right, or straight ahead."""
    name = str(of.choice(aircraft.names()))
    airspeed = aircraft.limits(aircraft.folder(name)).design_airspeed
    standoff, heading = of.uniform(4.5, 16.0) * airspeed, of.uniform(-math.pi, math.pi)
    duration = float(round(of.uniform(100.0, 240.0)))
    target, position = Target(), (-standoff, 0.3 * standoff)
    if kind == "manoeuvres":
        segments, time = [], 10.0
        while time < duration - 10.0:
            end = time + of.uniform(8.0, 20.0)
            rate = of.choice([-1.0, 1.0]) * math.radians(of.uniform(3.0, 12.0))
            segments.append(Segment(from_=time, to=end, turn_rate=float(rate)))
            time = end + of.uniform(3.0, 10.0)
        target = Target(speed=of.uniform(0.3, 0.5) * airspeed, heading=heading, segments=tuple(segments))
        standoff = of.uniform(2.5, 5.0) * airspeed
    elif kind == "straight":
        duration = min(duration, 150.0)
        way = 2.0 * airspeed * duration
        target = Target(position=(way * math.cos(heading), way * math.sin(heading)))
        position = (0.0, 0.0)
    gains: dict[str, Any] = {} if of.random() < 0.7 else {"k2": 0.6, "k3": 0.6}
    law = harness.law(
        "nftsm", str(of.choice(["paper_1", "fitted"])), standoff=standoff,
        max_heading_rate=math.radians(of.uniform(8.0, 20.0)), direction=str(of.choice(["paper", "mirrored"])), **gains,
    )  # fmt: skip
    speed, towards = of.uniform(0.0, 0.35) * airspeed, of.uniform(-math.pi, math.pi)
    return Flight(
        plant="sixdof", law=law, aircraft=name, duration=duration, seed=int(of.integers(10**9)), target=target,
        start=Start(position=position, heading=heading, airspeed=airspeed, altitude=100.0),
        wind=Wind(
            steady=(speed * math.cos(towards), speed * math.sin(towards)),
            turbulence=str(of.choice(["none", "none", "light"])),
        ),
    )  # fmt: skip


def blind_log(seed: int) -> BlindLog:
    """The log of this seed, with what is hidden in it."""
    of = np.random.default_rng([seed, 19])
    kind = str(of.choice(KINDS, p=SHARES))
    while True:
        log = simulate(flight_of(of, kind))
        if not log.outcome.failed and log["time"][-1] >= 60.0:
            return logged(log, kind, of)


def logged(log: FlightLog, kind: str, of: np.random.Generator) -> BlindLog:
    """The flight as messages of an autopilot on board, or of its telemetry."""
    of_receipt = bool(of.random() < 0.5)
    written = "CSV" if of_receipt else str(of.choice(list(FORMATS)))  # autopilots log on board in their own formats
    link = of.uniform(0.0, 0.8) if of_receipt else 0.0
    attitude = of.uniform(4.0, 20.0) if of_receipt else of.uniform(10.0, 20.0)
    scale, bank_reversed, wind_reversed = of.uniform(0.88, 1.12), bool(of.random() < 0.2), bool(of.random() < 0.4)
    late = link + (of.uniform(0.0, 0.2) if of_receipt else 0.0)
    sign = -1.0 if bank_reversed else 1.0
    held = np.append(log["bank_command"][1:], log["bank_command"][-1])  # of the period that begins
    repeated = of_receipt and of.random() < 0.6

    def stream(rate: float, age: float, basis: Basis, noise: float, **columns: Array) -> Stream:
        time = np.arange(of.uniform(0.0, 1.0 / rate), log["time"][-1], 1.0 / rate)
        time += of.uniform(0.0, 0.1 / rate, len(time))
        values = {name: _at(log["time"], column, time, basis) for name, column in columns.items()}
        if basis is Basis.COMMANDED:
            return Stream(time + age, basis, values)
        values = {name: column + of.normal(0.0, noise, len(time)) for name, column in values.items()}
        time = time + age
        if repeated:
            rows = np.arange(time[0], time[-1], 1.0 / (of.uniform(1.5, 4.0) * rate))
            latest = np.searchsorted(time, rows, side="right") - 1
            return Stream(rows, basis, {name: column[latest] for name, column in values.items()})
        return Stream(time, basis, values)

    measured, estimated, commanded = Basis.MEASURED, Basis.ESTIMATED, Basis.COMMANDED
    streams = {
        "attitude": stream(attitude, late, estimated, math.radians(of.uniform(0.05, 0.5)),
                           bank=sign * log["bank"], pitch=log["pitch"], yaw=np.unwrap(log["yaw"])),
        "track": stream(of.uniform(4.0, 10.0), link + of.uniform(0.0, 0.25), estimated, of.uniform(0.05, 0.2),
                        velocity_north=log["velocity_north"], velocity_east=log["velocity_east"],
                        velocity_down=log["velocity_down"], altitude=log["altitude"]),
        "airspeed": stream(of.uniform(2.0, 10.0), link, measured, of.uniform(0.1, 0.4),
                           airspeed=log["airspeed"] / scale),
        "command": stream(of.uniform(10.0, 20.0), link, commanded, 0.0, bank_command=sign * held),
        "imu": stream(of.uniform(10.0, 20.0), link, measured, of.uniform(0.05, 0.3),
                      lateral_acceleration=log["lateral_acceleration"] + of.normal(0.0, 0.1)),
        "wind": _wind(log, of, link, -1.0 if wind_reversed else 1.0),
    }  # fmt: skip
    if written == "DataFlash":  # command and attitude in one message
        time = streams["attitude"].time
        streams["command"] = Stream(time, commanded, {"bank_command": _at(log["time"], sign * held, time, commanded)})
    hidden = Hidden(
        kind=kind, format=written, scale=scale, wind_reversed=wind_reversed, bank_reversed=bank_reversed,
        of_receipt=of_receipt,
        turbulent=log.flight.wind.turbulence != "none", turn_ratio=_true_turn_ratio(log),
        wind=(float(log["wind_north"].mean()), float(log["wind_east"].mean())), lag=_true_lag(log, held),
        words=_true_words(log, held),
    )  # fmt: skip
    return BlindLog(log.flight, streams, hidden)


def _at(time: Array, column: Array, when: Array, basis: Basis) -> Array:
    if basis is Basis.COMMANDED:
        return np.asarray(column[np.clip(np.searchsorted(time, when, side="right") - 1, 0, None)])
    return np.interp(when, time, column)


def _wind(log: FlightLog, of: np.random.Generator, age: float, sign: float) -> Stream:
    """An estimate that settles, with an error that stays."""
    time = np.arange(0.5, log["time"][-1], 0.5)
    settling = np.exp(-time / of.uniform(5.0, 30.0))[:, np.newaxis]
    wind = np.array(log.flight.wind.steady) + of.normal(0.0, 0.3, 2) + of.normal(0.0, 3.0, 2) * settling
    north, east = sign * (wind + of.normal(0.0, 0.05, wind.shape)).T
    return Stream(time + age, Basis.ESTIMATED, {"wind_north": north, "wind_east": east})


def true_flight(log: FlightLog) -> RecordedFlight:
    """The flight with every value as it was, on board."""
    names = ("bank", "velocity_north", "velocity_east", "airspeed", "altitude", "lateral_acceleration")
    channels = {name: Channel(log["time"], log[name], Basis.MEASURED, "", len(log)) for name in names}
    return RecordedFlight(name="true", sources=(), clock="", channels=channels)


def _true_turn_ratio(log: FlightLog) -> float:
    """The relation over the windows of the true flight in the wind that there was."""
    flight = true_flight(log)
    windows = turn.windows(flight["bank"])
    if not windows:
        return math.nan
    of = turn.integrals(flight["bank"], float(log["time"][0]), float(log["time"][-1]))
    wind = Fit(float(log["wind_north"].mean()), float(log["wind_east"].mean()), 1.0)
    return turn.relation(track_of(flight), of, wind, windows, 0.0, bank_error=False)[0].slope


def _true_lag(log: FlightLog, held: Array) -> float:
    period = log.flight.guidance_period
    command = Channel(log["time"] + 0.5 * period, held, Basis.COMMANDED, "", len(log))  # each is there at once
    fit = response_fit.fitted(command, Channel(log["time"], log["bank"], Basis.MEASURED, "", len(log)))
    return fit.lag if fit else math.nan


def _true_words(log: FlightLog, held: Array) -> dict[str, str]:
    command = Channel(log["time"] + 0.5 * log.flight.guidance_period, held, Basis.COMMANDED, "", len(log))
    found = assess(true_flight(log).with_channel("bank_command", command))
    return {part.title: found[part.title].word for part in OTHERS}


class Told(NamedTuple):
    """What was said of one hidden number; None where nothing was."""

    covered: bool | None = None
    width: float = math.nan  # of the interval
    wrong: bool = False  # a word that the truth contradicts


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
    told = {TURN: Told(), SCALE: Told(), WIND: Told(), LAG_ROW: Told()}
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
    lag = found[LAG.title]
    if lag.word != CANNOT:
        told[LAG_ROW] = _told(hidden.lag, lag.low, lag.high)
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
    for name in (TURN, WIND, SCALE, LAG_ROW):
        told = [answer.told[name] for answer in answers if answer.told[name].covered is not None]
        inside = sum(bool(each.covered) for each in told)
        share = f"{inside} of {len(told)} ({inside / max(1, len(told)):.0%})"
        width = f"{np.median([each.width for each in told]):.3g}" if told else ""
        rows.append([name, share, width, str(len(answers) - len(told)), str(sum(each.wrong for each in told))])
    yield from markdown(
        ["hidden", "within its 95 % interval", "width, median", "refused", "claimed wrongly"], rows, "lrrrr"
    )
    yield ""
    yield f"Asked: {COVERED:.0%} of {len(answers)} logs within the interval, {WRONG:.0%} claimed wrongly at most."
    yield "The turn relation is that of the same windows of the true flight; wind in m/s, both components within; the"
    yield "lag in s, of a fit to the true bank and command: where the age of the telemetry is in the times, the"
    yield "interval is an upper bound."
    decided, contradicted = (sum(answer.decided for answer in answers), [t for a in answers for t in a.contradicted])
    yield f"Level flight, constant airspeed, lateral force and bank as commanded hold or fail {decided} times;"
    yield f"{len(contradicted)} of these words contradict the true flight's."
    signs = sum(answer.signs_right for answer in answers)
    yield f"The signs of wind and bank were told right in {signs} of {len(answers)} logs."
    yield ""
    straight = [answer for answer in answers if answer.kind == "straight"]
    refused = [answer for answer in straight if answer.reason]
    yield f"{len(refused)} of {len(straight)} straight flights have no turn relation:"
    yield ""
    reasons = [answer.reason for answer in answers if answer.reason]
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
