"""Signals that several metrics share: the window in which circling is judged, and the response to the command."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from harness.chatter import Oscillation, oscillation, rests
from harness.feasibility import feasibility_margin
from harness.log.flight_log import FlightLog
from harness.plants.plant import Outcome
from harness.series import azimuth, settling_time, unwrapped

Array = NDArray[np.float64]

SETTLED_FOR = 5.0  # s: shortest remaining flight after convergence
LEAST_PACE = (
    0.1  # least mean angular rate over v_a / R_d, its value in still air: exceeded everywhere up to w = 0.9 v_a
)
AVERAGED_OVER = 0.25  # s: averaging time of the heading-rate error, and time over which a command must change
LONGEST_LAG = 2.0  # s: largest lag that is searched
LEAST_EXCITATION = np.radians(0.5)  # rad/s: least standard deviation of a command, or turn, for a lag or ratio
AS_WELL = 0.9  # a smaller delay is preferred if it explains this share of what the best delay explains
LEAST_EXPLAINED = 0.5  # least share of the flown rate's variance explained by the command for a lag


class Window(NamedTuple):
    """The rows over which circling is judged: from `first` to the end of the flight."""

    first: int
    laps: int | None  # whole laps; 0: less than one is left after convergence; None: the last half of the flight


@dataclass(frozen=True)
class Signals:
    """A flight's log and the signals derived from it, computed once. SI, rad. The log has at least one row."""

    log: FlightLog

    @cached_property
    def period(self) -> float:
        """Guidance period, s: the time from one row to the next."""
        return self.log.flight.guidance_period

    @cached_property
    def held_command(self) -> Array:
        """Heading-rate command of each period but the last, rad/s."""
        return self.log["heading_rate_command"][:-1]

    @cached_property
    def flown_rate(self) -> Array:
        """Mean heading rate while each of these commands was held, rad/s."""
        return np.diff(unwrapped(self.log["heading"])) / self.period

    @cached_property
    def lag_and_gain(self) -> tuple[float | None, float | None]:
        """Delay, s, of the flown heading rate behind the command, and their ratio at that delay."""
        return _lag_and_gain(self.held_command, self.flown_rate, self.period)

    def settling_time(self, tolerances: float = 1.0) -> float | None:
        """Time from which |range error| stays below `tolerances` times the flight's tolerance, s; see `SETTLED_FOR`.

        None for a flight that ended early, since its continuation is unknown, and for one that does not move around its
        target from then on: on its circle, but held in place by the wind.
        """
        if self.log.outcome is not Outcome.COMPLETED:
            return None
        tolerance = tolerances * self.log.flight.metrics.tolerance
        settled = settling_time(self.log["time"], self.log["range_error"], tolerance, SETTLED_FOR)
        return settled if settled is not None and self.goes_round(self._row(settled)) else None

    @cached_property
    def around(self) -> Array:
        """Direction from the target to the aircraft, rad, unwrapped."""
        log = self.log
        return azimuth(log["north"] - log["target_north"], log["east"] - log["target_east"])

    def goes_round(self, first: int) -> bool:
        """Whether the aircraft moves around its target from this row on, on average at `LEAST_PACE` or more."""
        flight, time = self.log.flight, self.log["time"]
        in_still_air = flight.start.airspeed / flight.law.standoff * (time[-1] - time[first])
        return bool(abs(self.around[-1] - self.around[first]) >= LEAST_PACE * in_still_air)

    def _row(self, time: float) -> int:
        """The first row that is not before this time, s."""
        return int(np.searchsorted(self.log["time"], time))

    @cached_property
    def window(self) -> Window:
        """The last whole laps around the target after convergence, or all that remains if that is less than a lap.

        For a flight that does not converge it is the last half. So it is for a circle that the heading-rate limit
        cannot hold, which the aircraft leaves in every lap: an end near the circle does not make the flight settled.
        """
        log, converged = self.log, self.settling_time()
        if converged is None or feasibility_margin(log.flight) < 0.0:
            return Window(len(log) // 2, None)
        first = self._row(converged)
        around = self.around[first:]
        left = np.abs(around[-1] - around)  # rad round the target from each row to the end
        laps = int(left[0] / math.tau)
        return Window(first + int(np.flatnonzero(left >= laps * math.tau)[-1]) if laps else first, laps)

    def circling(self, column: str) -> Array:
        """The rows of a column over which circling is judged: see `window`."""
        return self.log[column][self.window.first :]

    @cached_property
    def oscillation(self) -> Oscillation | None:
        """The strongest oscillation in the judged window; None if the record is too short."""
        first = self.window.first
        return oscillation(self.held_command[first:], self.flown_rate[first:], self.period)

    @cached_property
    def chatters(self) -> bool | None:
        """Whether there is a limit cycle in the judged window; None if the record does not decide."""
        first = self.window.first
        if rests(self.held_command[first:], self.flown_rate[first:], self.period):
            return False
        return self.oscillation.chatters if self.oscillation else None

    @property
    def limit_cycle(self) -> Oscillation | None:
        """The limit cycle in the judged window; None if there is none or the record does not decide."""
        return self.oscillation if self.chatters else None


def at_limit(log: FlightLog) -> NDArray[np.bool_]:
    """The rows in which the command saturates at the limit of its law; a filtered command may be below its demand.

    A limit in course rate is a different heading rate in each direction: there the law reports its unlimited command.
    """
    command, law = np.abs(log["heading_rate_command"]), log.flight.law
    if law.command == "course_rate":
        return command < np.abs(log["unlimited_command"])
    return np.asarray(command >= law.max_heading_rate * (1.0 - 1e-12))


def _lag_and_gain(command: Array, flown: Array, period: float) -> tuple[float | None, float | None]:
    """The delay at which the command explains most of the flown rate's variance, and the ratio there.

    Both by least squares, and exact for a pure delay: over a period, a held command delayed by a fraction of a period
    is a mix of two neighbours. With a periodic command, as in a limit cycle, delays longer by a period fit as well: the
    smallest is taken, since a self-sustained oscillation lags by less than its period.

    The delay is reported only if the command excites it (standard deviation of its change over `AVERAGED_OVER` of at
    least `LEAST_EXCITATION`) and explains at least `LEAST_EXPLAINED` of the output variance.
    """
    longest = min(round(LONGEST_LAG / period), len(command) // 2)
    if longest < 1 or np.std(command) < LEAST_EXCITATION:
        return None, None
    y = flown[longest:]  # what was commanded before the flight is not known
    explained, share = _mixes(command, y, longest)
    peaks = (explained >= AS_WELL * explained.max()) & (explained >= np.append(explained[1:], -np.inf))
    n = int(np.argmax(peaks))  # the first
    u, later = (command[longest - k : len(command) - k] for k in (n, n + 1))
    mixed = (1.0 - share[n]) * u + share[n] * later
    gain = float(mixed @ y) / max(float(mixed @ mixed), 1e-300)
    apart = max(1, round(AVERAGED_OVER / period))
    is_quick = np.std(command[apart:] - command[:-apart]) >= LEAST_EXCITATION
    is_told = is_quick and explained[n] >= LEAST_EXPLAINED * len(y) * np.var(y)
    return float((n + share[n]) * period) if is_told else None, gain


def _mixes(command: Array, y: Array, longest: int) -> tuple[Array, Array]:
    """The sum of squares of y explained by the best mix of the command delayed by n and n + 1 samples; the mix.

    The mix is the share of the delay n + 1, for n below `longest`. Sums of squares about the means; negative weights
    are excluded.
    """
    c, size = command - command.mean(), len(y)  # so that the running sums lose no digits
    y = y - y.mean()
    begin = longest - np.arange(longest + 1)  # of each window
    total = _sums(c, begin, size)
    square = np.maximum(_sums(c * c, begin, size) - total * total / size, 1e-20 * (c @ c))  # less is rounding
    uu, ll = square[:-1], square[1:]
    ul = _sums(c[1:] * c[:-1], begin[1:], size) - total[:-1] * total[1:] / size
    products = np.correlate(c, y, "valid")[begin]
    uy, ly = products[:-1], products[1:]
    det = uu * ll - ul * ul
    both = det > 1e-12 * uu * ll
    a, b = ((v / np.where(both, det, 1.0)) for v in (uy * ll - ly * ul, ly * uu - uy * ul))
    both &= (a >= 0.0) & (b >= 0.0) & (a + b > 0.0)
    first, second = (np.maximum(v, 0.0) ** 2 / w for v, w in ((uy, uu), (ly, ll)))  # of one alone
    explained = np.where(both, a * uy + b * ly, np.maximum(first, second))
    return explained, np.where(both, b / np.where(both, a + b, 1.0), second > first)


def _sums(x: Array, begin: NDArray[np.intp], size: int) -> Array:
    """The sum of x over each window."""
    running: Array = np.concatenate([[0.0], np.cumsum(x)])
    return running[begin + size] - running[begin]
