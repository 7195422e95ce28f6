"""What a recorded flight says of the coordinated-flight assumption, part by part, and what it cannot say.

Words, margins and intervals are those of the verdict. There a seed is one draw; here it is a window of flight, or what
is left when one window is left out (the jackknife), so that wind, airspeed scale and turn relation have intervals that
know of each other. A part that the log cannot answer is refused with its reason, never with a number.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from harness.margins import Assess
from harness.plants.turn import GRAVITY
from harness.recorded import response_fit, turn
from harness.recorded.cannot_judge import CannotJudgeError
from harness.recorded.recorded_flight import Basis, Channel, RecordedFlight
from harness.recorded.response_fit import ResponseFit
from harness.recorded.turning import STOPPED, SteadyWind, Turning, TurnPoint, estimated_of, turning_of
from harness.recorded.wind import Estimated
from harness.verdict.judgement import words
from harness.verdict.parts import PARTS, Bounds, Group, Part, margins_of
from harness.verdict.statistics import LEAST_SEEDS, Evidence, Sample, evidence, seeds_to_decide
from harness.vocabulary import Verdict

Array = NDArray[np.float64]

CANNOT = "cannot be judged from this log"
FLYING = 6.0  # m/s, over the ground or through the air: an aircraft at that speed flies
SHORTEST = 10.0  # s of flight
WINDOW = 10.0  # s
MOST_ALIKE = 0.4  # correlation of a window with the next: windows more alike than that are joined
LEAST_LEAN = math.radians(2.0)  # rms of the bank about its mean, by which a lateral force is told from a zero offset
LEAST_COMMAND = math.radians(1.0)  # rms of a command's change within a quarter of a second
LEAST_EXPLAINED = 0.8  # of the bank, by its command
SAMPLES_IN_LAG = 3.0  # values of the bank within the lag, or it cannot be told

_CIRCULAR = "no vane: an angle made of an estimated wind is circular, since that takes sideslip for zero"

LATERAL = Part(
    "lateral force", "lateral_force", "of g sin(bank)", "turn_ratio", "within", Group.COORDINATED, assumed=0.0
)
LAG = Part("bank follows at once", "bank_lag_s", "s late", "turn_ratio", "at most", Group.FOLLOWED, assumed=0.0)
GAIN = replace(PARTS["heading_rate_gain_slow"], title="bank as commanded", column="bank_gain")


@dataclass(frozen=True, slots=True)
class PartFinding:
    """What the log says of one part."""

    part: Part
    word: str  # of `Verdict`, or `CANNOT`
    reason: str  # why it cannot be judged, or is undecided; else what goes with the number
    value: float = math.nan  # in the part's unit, with its 95 % interval
    low: float = math.nan
    high: float = math.nan
    windows: int = 0  # independent ones
    needed: int | None = None  # windows that would decide, were they like these
    bounds: Bounds = (None, None)  # of the value


@dataclass(frozen=True, slots=True, eq=False)
class Assessment:
    """All that is said of a recorded flight."""

    flight: RecordedFlight  # the part that was assessed, with signs turned the right way round
    begin: float  # s
    end: float
    findings: tuple[PartFinding, ...]
    wind: SteadyWind | None
    estimated: Estimated | None  # the autopilot's wind
    points: tuple[TurnPoint, ...]
    age: float  # s, of the track beyond the bank's; NaN where it is not known
    response: ResponseFit | None
    notes: tuple[str, ...]  # conventions and scales that were found, a sentence each

    def __getitem__(self, title: str) -> PartFinding:
        """The finding of a part, by its title."""
        return next(finding for finding in self.findings if finding.part.title == title)


def assess(
    flight: RecordedFlight, begin: float = -math.inf, end: float = math.inf, margins: Assess | None = None
) -> Assessment:
    """What the flight says between these times, s. See `Assessment`."""
    limits = margins_of(margins or Assess())
    try:
        begin, end = _flown(flight, begin, end)
    except CannotJudgeError as refusal:
        circular = "sideslip" in flight and flight["sideslip"].basis is not Basis.MEASURED
        reasons = [_CIRCULAR if part is _SIDESLIP and circular else str(refusal) for part in _PARTS]
        refused = tuple(PartFinding(part, CANNOT, reason) for part, reason in zip(_PARTS, reasons, strict=True))
        return Assessment(flight, begin, end, refused, None, None, (), math.nan, None, ())
    cut = flight.between(begin, end)
    notes: list[str] = []
    turning, cut = turning_of(cut, notes)
    response, cut = _response(cut, notes)
    made: dict[str, _Made | CannotJudgeError] = {}
    makers: tuple[tuple[Part, Callable[[], _Made]], ...] = (
        (_LEVEL, lambda: _level(cut)),
        (_AIRSPEED, lambda: _airspeed(cut)),
        (_SIDESLIP, lambda: _sideslip(cut)),
        (_TURN, lambda: _turn_relation(turning)),
        (LATERAL, lambda: _lateral(cut)),
        (GAIN, lambda: _gain(response)),
    )
    for part, make in makers:
        try:
            made[part.column] = make()
        except CannotJudgeError as refusal:
            made[part.column] = refusal
    findings = [*_worded(made, limits), _lag(cut, response)]
    return Assessment(
        flight=cut, begin=begin, end=end, findings=tuple(findings),
        wind=turning.wind if isinstance(turning, Turning) else None,
        estimated=turning.estimated if isinstance(turning, Turning) else estimated_of(cut),
        points=turning.points if isinstance(turning, Turning) else (),
        age=turning.age if isinstance(turning, Turning) else math.nan,
        response=response if isinstance(response, ResponseFit) else None, notes=tuple(notes),
    )  # fmt: skip


# What is judged at all


def _flown(flight: RecordedFlight, begin: float, end: float) -> tuple[float, float]:
    """The part of the flight within these times in which the aircraft flies, before a failure.

    Raises `CannotJudgeError`.
    """
    if flight.refusals:
        raise CannotJudgeError(flight.refusals[0])
    for name, channel in flight.channels.items():
        back = np.flatnonzero(np.diff(channel.time) < 0.0)
        if len(back):
            raise CannotJudgeError(f"the clock of {name} goes back at {channel.time[back[0]]:.1f} s")
    begin, end = max(begin, flight.begin), min(end, flight.end)
    if flight.failure:
        if flight.failure.time <= begin + SHORTEST:
            raise CannotJudgeError(f"after a failure at {flight.failure.time:.1f} s ({flight.failure.text})")
        end = min(end, flight.failure.time)
    time, speed = _speed(flight.between(begin, end))
    fast = speed >= FLYING
    if not fast.any():
        most = float(speed.max()) if len(speed) else 0.0
        raise CannotJudgeError(f"never airborne: the largest speed is {most:.1f} m/s")
    edges = np.diff(np.concatenate([[0], fast.astype(int), [0]]))
    runs = list(zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1, strict=True))
    first, last = max(runs, key=lambda run: float(time[run[1]] - time[run[0]]))
    if time[last] - time[first] < SHORTEST:
        raise CannotJudgeError(f"airborne for {time[last] - time[first]:.1f} s at most; {SHORTEST:g} s are needed")
    return (
        begin if first == 0 else float(time[first]),
        end if last == len(time) - 1 else float(time[last]),
    )


def _speed(flight: RecordedFlight) -> tuple[Array, Array]:
    """How fast the aircraft moves, over the ground or through the air, whichever is more; at one time a second."""
    if not len(flight.channels):
        raise CannotJudgeError("the log holds nothing in this time")
    time = np.arange(flight.begin, flight.end, 0.5)
    speeds = []
    if flight.has("velocity_north", "velocity_east"):
        speeds.append(np.hypot(flight["velocity_north"].at(time), flight["velocity_east"].at(time)))
    if flight.has("velocity_forward", "velocity_right"):
        speeds.append(np.hypot(flight["velocity_forward"].at(time), flight["velocity_right"].at(time)))
    speeds += [np.abs(flight[name].at(time)) for name in ("ground_speed", "airspeed") if flight.has(name)]
    if not speeds:
        raise CannotJudgeError("the log has neither a ground velocity nor an airspeed")
    most = np.nanmax(np.vstack([np.full(len(time), -1.0), *speeds]), axis=0)
    known = most >= 0.0
    return time[known], most[known]


# The parts


@dataclass(frozen=True, slots=True)
class _Made:
    """A part's sample, and what goes with it."""

    sample: Sample
    reason: str = ""
    barred: str = ""  # why nothing may be decided by it
    unless_it_holds: str = ""  # why it cannot be judged from what it deviates by; that it holds may still be said


def _turn_relation(turning: "Turning | CannotJudgeError") -> _Made:
    if isinstance(turning, CannotJudgeError):
        raise turning
    return _Made(turning.sample, barred=turning.barred)


def _level(flight: RecordedFlight) -> _Made:
    if flight.has("altitude_error"):
        channel, about = flight["altitude_error"], "from the commanded altitude"
        off = channel.values
    elif flight.has("altitude"):
        channel = flight["altitude"]
        commanded = flight.has("altitude_command")
        off = channel.values - (flight["altitude_command"].at(channel.time) if commanded else np.median(channel.values))
        about = "from the commanded altitude" if commanded else "from the flight's median: the log has no command"
        if not commanded:
            asked = "the altitude changes, and the log has no command: a climb that was asked for is no deviation"
            return _Made(_windowed(channel.time, np.abs(off), np.max), about, unless_it_holds=asked)
    else:
        raise CannotJudgeError("the log has no altitude")
    return _Made(_windowed(channel.time, np.abs(off), np.max), about)


def _airspeed(flight: RecordedFlight) -> _Made:
    if not flight.has("airspeed") or flight["airspeed"].basis is not Basis.MEASURED:
        raise CannotJudgeError("the log has no measured airspeed")
    channel = flight["airspeed"]
    usual = float(np.median(channel.values))  # not the command: the sensor's scale is no deviation
    if usual <= STOPPED:
        raise CannotJudgeError(f"the airspeed sensor shows {usual:.1f} m/s in flight")
    time, values = averaged(channel, 1.0)
    return _Made(_windowed(time, np.abs(values / usual - 1.0), _rms), "from the flight's median")


def _sideslip(flight: RecordedFlight) -> _Made:
    if "sideslip" not in flight:
        raise CannotJudgeError("no vane: the log has no sideslip")
    channel = flight["sideslip"]
    if channel.basis is not Basis.MEASURED:
        raise CannotJudgeError(_CIRCULAR)
    return _Made(_windowed(channel.time, np.degrees(np.abs(channel.values)), _rms))


def _lateral(flight: RecordedFlight) -> _Made:
    """The slope of the lateral specific force on g sin(bank): the turn relation less one, from another sensor."""
    if not flight.has("lateral_acceleration", "bank"):
        raise CannotJudgeError("the log has no lateral specific force" if "bank" in flight else "the log has no bank")
    time, force = averaged(flight["lateral_acceleration"], 1.0)
    bank = flight["bank"].at(time)
    known = np.isfinite(bank) & np.isfinite(force) & (np.abs(bank) <= turn.STEEPEST)
    time, force, lean = time[known], force[known], GRAVITY * np.sin(bank[known])
    if len(time) < 4 or np.std(lean) < GRAVITY * LEAST_LEAN:
        raise CannotJudgeError("the bank hardly changes, so that a force is not told from the sensor's zero")
    count = int((time[-1] - time[0]) / WINDOW)
    if count < LEAST_SEEDS:
        raise CannotJudgeError(f"{count} windows of {WINDOW:g} s; {LEAST_SEEDS} are needed")
    block = np.minimum((count * (time - time[0]) / (time[-1] - time[0])).astype(int), count - 1)

    def slope(used: NDArray[np.bool_]) -> float:
        return float(np.polyfit(lean[used], force[used], 1)[0])

    whole = slope(np.ones(len(time), bool))
    pseudo = [count * whole - (count - 1) * slope(block != k) for k in range(count)]
    turned = force - np.polyfit(lean, force, 1)[1]
    return _Made(Sample(np.array(pseudo), count, drawn=True), f"{_rms(turned):.2f} m/s2 rms")


def _gain(response: "ResponseFit | CannotJudgeError") -> _Made:
    if isinstance(response, CannotJudgeError):
        raise response
    return _Made(response.sample(response_fit.GAIN))


def _response(flight: RecordedFlight, notes: list[str]) -> tuple["ResponseFit | CannotJudgeError", RecordedFlight]:
    """The fitted response of the bank; the flight with its command the right way round."""
    try:
        found = _fitted(flight)
        if found.gain < 0.0:
            flight = flight.changed(np.negative, "bank_command")
            notes.append("bank command: the sign is the wrong way round beside the bank's; turned")
            found = _fitted(flight)
    except CannotJudgeError as refusal:
        return refusal, flight
    return found, flight


def _fitted(flight: RecordedFlight) -> ResponseFit:
    if not flight.has("bank_command", "bank"):
        raise CannotJudgeError("the log has no bank command" if "bank" in flight else "the log has no bank")
    if float(np.std(flight["bank_command"].values)) < LEAST_COMMAND:
        raise CannotJudgeError("not excited: the bank command hardly changes")
    fit = response_fit.fitted(flight["bank_command"], flight["bank"])
    if fit is None:
        raise CannotJudgeError("too few samples: half a minute of bank and bank command is needed")
    if fit.excited < LEAST_COMMAND:
        changes = math.degrees(fit.excited)
        raise CannotJudgeError(
            f"not excited: the bank command changes by {changes:.2g} deg rms within a quarter of a second"
        )
    if abs(fit.explained) < LEAST_EXPLAINED:
        raise CannotJudgeError(f"the command explains {100 * max(0.0, fit.explained):.0f} % of the bank's variation")
    return fit


def _lag(flight: RecordedFlight, response: "ResponseFit | CannotJudgeError") -> PartFinding:
    """The lag: an upper bound where the telemetry's age is in it, or where samples are too few."""
    if isinstance(response, CannotJudgeError):
        return PartFinding(LAG, CANNOT, str(response))
    low, high = response.lag_interval()
    count = len(response.pseudo)
    why = []
    if flight.of_receipt:
        why.append("the age of the telemetry is in it")
    if response.interval * SAMPLES_IN_LAG > response.lag:
        rate = 1.0 / response.interval
        why.append(f"the bank has {rate:.2g} new values a second")
    if why:
        return PartFinding(LAG, Verdict.UNDECIDED, f"at most: {', and '.join(why)}", high, 0.0, high, count)
    if low <= 0.0:
        return PartFinding(LAG, Verdict.UNDECIDED, "the interval holds zero", response.lag, low, high, count)
    return PartFinding(LAG, Verdict.FAILS, "", response.lag, low, high, count)


def _worded(made: "dict[str, _Made | CannotJudgeError]", limits: dict[str, float]) -> Iterator[PartFinding]:
    """The findings, judged as one family."""
    tests: dict[str, Evidence] = {}
    for column, each in made.items():
        if isinstance(each, _Made):
            if each.sample.seeds < LEAST_SEEDS:
                made[column] = CannotJudgeError(f"{each.sample.seeds} independent windows; {LEAST_SEEDS} are needed")
            else:
                tests[column] = evidence(each.sample, *_bounds(_BY_COLUMN[column], limits))
    family = dict(zip(tests, words(list(tests.values()), limits["significance"]), strict=True))
    for column, each in made.items():
        part = _BY_COLUMN[column]
        if isinstance(each, CannotJudgeError):
            yield PartFinding(part, CANNOT, str(each))
            continue
        sample, bounds, word = each.sample, _bounds(part, limits), family[column]
        if each.unless_it_holds and word is not Verdict.HOLDS:
            yield PartFinding(part, CANNOT, each.unless_it_holds)
            continue
        low, high = sample.interval() or (math.nan, math.nan)
        needed, reason = None, each.reason
        if each.barred:
            word, reason = Verdict.UNDECIDED, each.barred
        elif word is Verdict.UNDECIDED:
            level = limits["significance"] / max(1, sum(test.can_err for test in tests.values()))
            needed = seeds_to_decide(sample, *bounds, level)
            reason = "; ".join(filter(None, [reason, "the interval crosses the margin"]))
        yield PartFinding(part, word, reason, sample.mean, low, high, sample.seeds, needed, bounds)


def _bounds(part: Part, limits: dict[str, float]) -> Bounds:
    """Of the value itself."""
    low, high = part.bounds(limits)
    assumed = part.assumed or 0.0
    return (None if low is None else assumed + low), (None if high is None else assumed + high)


# Windows


def _windowed(time: Array, values: Array, of: Callable[[Array], float]) -> Sample:
    """A number for each window of flight; windows are as long as makes neighbours differ. Raises `CannotJudgeError`."""
    known = np.isfinite(values)
    time, values = time[known], values[known]
    length = WINDOW
    while True:
        count = int((time[-1] - time[0]) / length) if len(time) else 0
        if count < LEAST_SEEDS:
            raise CannotJudgeError(f"{count} independent windows of {length:g} s; {LEAST_SEEDS} are needed")
        window = np.minimum((count * (time - time[0]) / (time[-1] - time[0])).astype(int), count - 1)
        numbers = np.array([of(values[window == k]) for k in range(count) if (window == k).any()])
        off = numbers - numbers.mean()
        alike = float(off[1:] @ off[:-1]) / max(float(off @ off), 1e-30)
        if alike < MOST_ALIKE or int((time[-1] - time[0]) / (2.0 * length)) < LEAST_SEEDS:
            return Sample(numbers, len(numbers), drawn=True)
        length *= 2.0


def averaged(channel: Channel, over: float) -> tuple[Array, Array]:
    """Means over so many seconds each, with their middles: noise of single values is no deviation."""
    if channel.interval >= over:
        return channel.time, channel.values
    place = ((channel.time - channel.time[0]) / over).astype(int)
    number = np.bincount(place)
    there = number > 0
    means = np.bincount(place, weights=channel.values)[there] / number[there]
    return np.bincount(place, weights=channel.time)[there] / number[there], means


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


_LEVEL, _AIRSPEED = PARTS["altitude_deviation_peak_m"], PARTS["airspeed_deviation"]
_SIDESLIP, _TURN = PARTS["sideslip_rms_deg"], PARTS["turn_ratio"]
_PARTS = (_LEVEL, _AIRSPEED, _SIDESLIP, _TURN, LATERAL, GAIN, LAG)
_BY_COLUMN = {part.column: part for part in _PARTS}
