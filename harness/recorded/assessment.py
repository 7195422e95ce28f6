"""The coordinated-flight assumption judged on a recorded flight, part by part, with reasons for what cannot be judged.

Terms, margins and intervals are those of the verdict. There a seed is one draw; here it is a window of flight, or the
flight without one window (the jackknife), so that the intervals of wind, airspeed scale and turn relation include each
other's uncertainty. A part that cannot be judged is refused with its reason, never with a number.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from harness.margins import Assess
from harness.plants.turn import GRAVITY
from harness.recorded import response_fit, turn
from harness.recorded.cannot_judge import CannotJudgeError
from harness.recorded.following import BANK, HEADING_RATE, Fitted, lag_of, response_of
from harness.recorded.part_finding import CANNOT, PartFinding
from harness.recorded.recorded_flight import Basis, Channel, RecordedFlight
from harness.recorded.response_fit import ResponseFit
from harness.recorded.turning import STOPPED, SteadyWind, Turning, TurnPoint, estimated_of, turning_of
from harness.recorded.wind import Estimated
from harness.verdict.judgement import words
from harness.verdict.parts import PARTS, Bounds, Group, Part, margins_of
from harness.verdict.statistics import LEAST_SEEDS, Evidence, Sample, evidence, seeds_to_decide
from harness.vocabulary import Verdict

Array = NDArray[np.float64]

FLYING = 6.0  # m/s: ground speed or airspeed from which an aircraft counts as flying
SHORTEST = 10.0  # s: shortest flight that is judged
WINDOW = 10.0  # s: shortest window
MOST_ALIKE = 0.4  # largest correlation of neighbouring windows; windows with more are joined
LEAST_LEAN = math.radians(2.0)  # least rms of the bank about its mean, to separate a lateral force from a sensor offset

_CIRCULAR = "no vane: an angle derived from an estimated wind is circular, since the filter assumes zero sideslip"

LATERAL = Part(
    "lateral force", "lateral_force", "of g sin(bank)", "turn_ratio", "within", Group.COORDINATED, assumed=0.0
)


@dataclass(frozen=True, slots=True, eq=False)
class Assessment:
    """The assessment of a recorded flight."""

    flight: RecordedFlight  # the assessed part, with corrected signs
    begin: float  # s
    end: float
    findings: tuple[PartFinding, ...]
    wind: SteadyWind | None
    estimated: Estimated | None  # the autopilot's wind
    points: tuple[TurnPoint, ...]
    age: float  # s: latency of the track minus that of the bank; NaN if unknown
    bank: ResponseFit | None  # response to its command
    heading_rate: ResponseFit | None
    notes: tuple[str, ...]  # conventions and scales that were found, a sentence each

    def __getitem__(self, title: str) -> PartFinding:
        """The finding of a part, by its title."""
        return next(finding for finding in self.findings if finding.part.title == title)


def assess(
    flight: RecordedFlight, begin: float = -math.inf, end: float = math.inf, margins: Assess | None = None
) -> Assessment:
    """The assessment of the flight between these times, s."""
    limits = margins_of(margins or Assess())
    try:
        begin, end = _flown(flight, begin, end)
    except CannotJudgeError as refusal:
        circular = "sideslip" in flight and flight["sideslip"].basis is not Basis.MEASURED
        reasons = [_CIRCULAR if part is _SIDESLIP and circular else str(refusal) for part in _PARTS]
        refused = tuple(PartFinding(part, CANNOT, reason) for part, reason in zip(_PARTS, reasons, strict=True))
        return Assessment(flight, begin, end, refused, None, None, (), math.nan, None, None, ())
    cut = flight.between(begin, end)
    notes: list[str] = []
    turning, cut = turning_of(cut, notes)
    bank, cut = response_of(cut, BANK, notes)
    heading_rate, cut = response_of(cut, HEADING_RATE, notes)
    made: dict[str, _Made | CannotJudgeError] = {}
    makers: tuple[tuple[Part, Callable[[], _Made]], ...] = (
        (_LEVEL, lambda: _level(cut)),
        (_AIRSPEED, lambda: _airspeed(cut)),
        (_SIDESLIP, lambda: _sideslip(cut)),
        (_TURN, lambda: _turn_relation(turning)),
        (LATERAL, lambda: _lateral(cut)),
        (BANK.gain, lambda: _gain(bank)),
        (HEADING_RATE.gain, lambda: _gain(heading_rate)),
    )
    for part, make in makers:
        try:
            made[part.column] = make()
        except CannotJudgeError as refusal:
            made[part.column] = refusal
    lags = [lag_of(fit, of, cut.of_receipt) for fit, of in ((bank, BANK), (heading_rate, HEADING_RATE))]
    findings = [*_worded(made, limits), *lags]
    return Assessment(
        flight=cut, begin=begin, end=end, findings=tuple(findings),
        wind=turning.wind if isinstance(turning, Turning) else None,
        estimated=turning.estimated if isinstance(turning, Turning) else estimated_of(cut),
        points=turning.points if isinstance(turning, Turning) else (),
        age=turning.age if isinstance(turning, Turning) else math.nan,
        bank=bank if isinstance(bank, ResponseFit) else None,
        heading_rate=heading_rate if isinstance(heading_rate, ResponseFit) else None, notes=tuple(notes),
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
    """Ground speed or airspeed, whichever is larger, m/s, once a second."""
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
    unless_it_holds: str = ""  # why a violation cannot be judged, although it may be shown to hold


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
            asked = "the altitude changes, and the log has no command: a commanded climb is no deviation"
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
    """The slope of the lateral specific force over g sin(bank): the turn relation minus one, from another sensor."""
    if not flight.has("lateral_acceleration", "bank"):
        raise CannotJudgeError("the log has no lateral specific force" if "bank" in flight else "the log has no bank")
    time, force = averaged(flight["lateral_acceleration"], 1.0)
    bank = flight["bank"].at(time)
    known = np.isfinite(bank) & np.isfinite(force) & (np.abs(bank) <= turn.STEEPEST)
    time, force, lean = time[known], force[known], GRAVITY * np.sin(bank[known])
    if len(time) < 4 or np.std(lean) < GRAVITY * LEAST_LEAN:
        raise CannotJudgeError("not excited: the bank hardly changes, so the force cannot be separated from an offset")
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


def _gain(fit: Fitted) -> _Made:
    if isinstance(fit, CannotJudgeError):
        raise fit
    return _Made(fit.sample(response_fit.GAIN))


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
            reason = "; ".join(filter(None, [reason, sample.why_not or "the interval crosses the margin"]))
        yield PartFinding(part, word, reason, sample.mean, low, high, sample.seeds, needed, bounds)


def _bounds(part: Part, limits: dict[str, float]) -> Bounds:
    """The margin of the value itself."""
    low, high = part.bounds(limits)
    assumed = part.assumed or 0.0
    return (None if low is None else assumed + low), (None if high is None else assumed + high)


# Windows


def _windowed(time: Array, values: Array, of: Callable[[Array], float]) -> Sample:
    """A number for each window; windows are long enough to be independent. Raises `CannotJudgeError`."""
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
    """Means over so many seconds each, with their middle times, to remove the noise of single values."""
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
_FOLLOWED = (BANK.gain, HEADING_RATE.gain, BANK.lag, HEADING_RATE.lag)
_PARTS = (_LEVEL, _AIRSPEED, _SIDESLIP, _TURN, LATERAL, *_FOLLOWED)
_BY_COLUMN = {part.column: part for part in _PARTS}
