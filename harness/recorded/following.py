"""How an aircraft follows its command of bank or heading rate: gain and lag of each."""

import math
from dataclasses import dataclass, replace

import numpy as np

from harness.recorded import response_fit
from harness.recorded.cannot_judge import CannotJudgeError
from harness.recorded.part_finding import CANNOT, PartFinding
from harness.recorded.recorded_flight import RecordedFlight
from harness.recorded.response_fit import ResponseFit
from harness.verdict.parts import PARTS, Group, Part
from harness.vocabulary import Verdict

LEAST_EXPLAINED = 0.8  # least share of the flown variance explained by the command
SAMPLES_IN_LAG = 3.0  # least number of flown samples within the lag for the lag to be identified

_GAIN = PARTS["heading_rate_gain_slow"]
_LAG = Part("", "", "s late", "turn_ratio", "at most", Group.FOLLOWED, assumed=0.0)


@dataclass(frozen=True, slots=True)
class Commanded:
    """A commanded quantity, and the two parts that judge how it is followed: gain and lag."""

    noun: str
    command: str  # its channel
    flown: str  # the channel of what follows
    is_rate: bool  # what follows is an angle, and its rate is commanded
    least: float  # rms of the command's change within a quarter of a second; SI, rad
    gain: Part
    lag: Part


BANK = Commanded(
    noun="bank",
    command="bank_command",
    flown="bank",
    is_rate=False,
    least=math.radians(1.0),
    gain=replace(_GAIN, title="bank as commanded", column="bank_gain"),
    lag=replace(_LAG, title="bank follows at once", column="bank_lag_s"),
)
HEADING_RATE = Commanded(
    noun="heading rate",
    command="heading_rate_command",
    flown="yaw",
    is_rate=True,
    least=math.radians(0.5),
    gain=replace(_GAIN, title="heading rate as commanded", column="heading_rate_gain"),
    lag=replace(_LAG, title="heading rate follows at once", column="heading_rate_lag_s"),
)

Fitted = ResponseFit | CannotJudgeError


class _UnexplainedError(CannotJudgeError):
    """The command explains too little of the flown signal."""


def response_of(flight: RecordedFlight, followed: Commanded, notes: list[str]) -> tuple[Fitted, RecordedFlight]:
    """The fitted response; the flight with its command, inverted if its sign requires it."""
    try:
        return _fitted(flight, followed), flight
    except _UnexplainedError as refusal:
        turned = flight.changed(np.negative, followed.command)
        try:
            found = _fitted(turned, followed)
        except CannotJudgeError:
            return refusal, flight
    except CannotJudgeError as refusal:
        return refusal, flight
    notes.append(f"{followed.noun} command: the sign is opposite to the {followed.flown}'s; inverted")
    return found, turned


def _fitted(flight: RecordedFlight, followed: Commanded) -> ResponseFit:
    noun, command, flown = followed.noun, followed.command, followed.flown
    if not flight.has(command, flown):
        raise CannotJudgeError(f"the log has no {f'{noun} command' if flown in flight else flown}")
    if float(np.std(flight[command].values)) < followed.least:
        raise CannotJudgeError(f"not excited: the {noun} command hardly changes")
    fit = response_fit.fitted(flight[command], flight[flown], followed.is_rate)
    if fit is None:
        raise CannotJudgeError(f"too few samples: half a minute of {flown} and {noun} command is needed")
    if fit.excited < followed.least:
        changes, unit = math.degrees(fit.excited), "deg/s" if followed.is_rate else "deg"
        raise CannotJudgeError(
            f"not excited: the {noun} command changes by {changes:.2g} {unit} rms within a quarter of a second"
        )
    if fit.explained < LEAST_EXPLAINED:
        share = 100 * max(0.0, fit.explained)
        raise _UnexplainedError(f"the command explains {share:.0f} % of the {flown}'s variation")
    return fit


def lag_of(fit: Fitted, followed: Commanded, of_receipt: bool) -> PartFinding:
    """The lag: an upper bound if it includes telemetry latency, or if samples are too few."""
    part = followed.lag
    if isinstance(fit, CannotJudgeError):
        return PartFinding(part, CANNOT, str(fit))
    low, high = fit.lag_interval()
    count = len(fit.pseudo)
    why = []
    if of_receipt:
        why.append("it includes the latency of the telemetry")
    if fit.interval * SAMPLES_IN_LAG > fit.lag:
        why.append(f"the {followed.flown} has {1.0 / fit.interval:.2g} new values a second")
    if why:
        return PartFinding(part, Verdict.UNDECIDED, f"at most: {', and '.join(why)}", high, 0.0, high, count)
    if low <= 0.0:
        return PartFinding(part, Verdict.UNDECIDED, "the interval contains zero", fit.lag, low, high, count)
    return PartFinding(part, Verdict.FAILS, "", fit.lag, low, high, count)
