"""The metrics that a flight is judged by: each is declared once, in `METRICS`, and measured from the log alone.

All that names, prints, compares or stores a metric reads its declaration: `harness list metrics`, the tables of `fly`,
`run` and `show`, the columns of results, the comparison and its report. To add a metric, write one entry.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

import aircraft
from harness.log.flight_log import FlightLog
from harness.log.signals import AVERAGED_OVER, LEAST_EXCITATION, Signals, at_limit
from harness.plants.ladder import PLANTS
from harness.plants.turn import bank_of_turn, rate_of_turn
from harness.series import overshoot, peak, rms

Array = NDArray[np.float64]
Value = (
    float | bool | None
)  # None, or NaN from `Metric.measure`: the plant has no such quantity, or the flight does not excite it

YES_OR_NO = "yes/no"  # the unit of a metric that is true or false


@dataclass(frozen=True, slots=True, kw_only=True)
class Metric:
    """One number, or truth value, that every flight is judged by."""

    name: str  # its key in every table and file, which ends with the unit
    unit: str  # "s", "deg/s2"; "1" of a ratio; `YES_OR_NO`
    meaning: str  # one line
    measure: Callable[[Signals], Value]  # what is not finite counts as None
    heading: str  # what tables and figures call it
    statistic: str = ""  # printed after the unit: "rms", "peak"
    percent: bool = False  # a share, in percent where the heading says so
    in_short_tables: bool = False  # those that `run` and `demo` print
    of_circling: bool = False  # it means something only where the law circles its target
    ideal: float = 0.0  # the best there can be
    worst: float | None = None  # the worst there can be; None: there is no bound
    compared: bool = True  # False: no row of its own in the tables of a comparison

    @property
    def label(self) -> str:
        """The unit as it stands beside a heading: "m rms", "share"."""
        return " ".join(word for word in ("" if self.unit == "1" else self.unit, self.statistic) if word) or "1"

    @property
    def column_heading(self) -> str:
        """Heading and unit over a narrow column, a line for each word of the heading: shares are in percent."""
        unit = "% yes" if self.unit == YES_OR_NO else "%" if self.percent else self.label
        return "\n".join([*self.heading.split(), unit])

    @property
    def scale(self) -> float:
        """How many of the column's unit make the metric's own."""
        return 100.0 if self.percent or self.unit == YES_OR_NO else 1.0


def measure(log: FlightLog) -> dict[str, float | bool | None]:
    """All metrics of a flight by their names, in their units. Each of them None when the log has no row."""
    if not len(log):
        return dict.fromkeys(METRICS)
    signals = Signals(log)
    return {name: _known(metric.measure(signals)) for name, metric in METRICS.items()}


def _known(value: Value) -> Value:
    """The value, or None if it is not finite: the plant has no such quantity."""
    return value if value is None or math.isfinite(value) else None


def window_in_words(metrics: Mapping[str, Value]) -> str:
    """The window in which circling was judged, in words, from the metrics; empty for a flight without a row."""
    begin, end, laps = (metrics.get(name) for name in ("window_begin_s", "window_end_s", "window_laps"))
    if begin is None or end is None:
        return ""
    if laps is None:
        left = metrics["convergence_time_s"] is not None
        which = f"the last half, since {'the circle cannot be held' if left else 'the flight did not converge'}"
    elif not laps:
        which = "what is left after convergence, less than a lap, with the end of the approach in it"
    else:
        which = "the last whole lap" if laps == 1 else f"the last {laps:g} whole laps"
    return f"Circling is judged from {begin:g} s to {end:g} s: {which}."


def _saturation(signals: Signals) -> float:
    return float(np.mean(at_limit(signals.log)[signals.window.first :]))


def _activity(signals: Signals) -> float:
    time, command = signals.circling("time"), signals.circling("heading_rate_command")
    return float(np.degrees(np.abs(np.diff(command)).sum() / max(time[-1] - time[0], signals.period)))


def _heading_rate_error(signals: Signals) -> float:
    apart = signals.flown_rate - signals.held_command
    return math.degrees(rms(_averaged(apart, AVERAGED_OVER / signals.period)))


def _turn_ratio(signals: Signals) -> float | None:
    log = signals.log
    bank = log["bank"]
    if np.isnan(bank).all():  # the plant has none
        return None
    coordinated = rate_of_turn(log["airspeed"], bank)
    if rms(coordinated) < LEAST_EXCITATION:
        return None
    return float(coordinated @ log["heading_rate"] / (coordinated @ coordinated))


def _bank_reserve(signals: Signals) -> float | None:
    flight = signals.log.flight
    if not PLANTS[flight.plant].banks:
        return None
    needed = bank_of_turn(flight.start.airspeed, flight.law.max_heading_rate)
    return math.degrees(aircraft.limits(aircraft.folder(flight.aircraft)).bank - needed)


def _limit_cycle_amplitude(signals: Signals) -> float | None:
    if signals.limit_cycle:
        return math.degrees(signals.limit_cycle.heading_rate)
    return None if signals.chatters is None else 0.0


def _averaged(x: Array, samples: float) -> Array:
    """A centred moving average, without delay."""
    window = np.ones(max(1, round(samples)))
    return np.convolve(x, window / window.size, mode="valid") if len(x) >= window.size else x


_METRICS = (
    Metric(
        name="convergence_time_s",
        unit="s",
        meaning="settling time: from then to the end, 5 s or more, |range error| < tolerance while circling the target",
        measure=lambda signals: signals.settling_time(),
        heading="convergence time",
        in_short_tables=True,
        of_circling=True,
    ),
    Metric(
        name="infeasible_s",
        unit="s",
        meaning="time in which holding the circle requires more than the command limit (negative feasibility margin)",
        measure=lambda signals: float(np.sum(signals.log["feasibility_margin"][:-1] < 0.0)) * signals.period,
        heading="infeasible",
        compared=False,
    ),
    Metric(
        name="convergence_time_half_tolerance_s",
        unit="s",
        meaning="settling time at half the tolerance; if it reverses the ranking of two laws, the tolerance decides",
        measure=lambda signals: signals.settling_time(0.5),
        heading="convergence time",
        statistic="at half the tolerance",
        of_circling=True,
        compared=False,
    ),
    Metric(
        name="convergence_time_double_tolerance_s",
        unit="s",
        meaning="settling time at twice the tolerance",
        measure=lambda signals: signals.settling_time(2.0),
        heading="convergence time",
        statistic="at twice the tolerance",
        of_circling=True,
        compared=False,
    ),
    Metric(
        name="window_begin_s",
        unit="s",
        meaning="begin of the judged window: the last whole laps after convergence, else see window_laps",
        measure=lambda signals: float(signals.circling("time")[0]),
        heading="judged from",
        compared=False,
    ),
    Metric(
        name="window_end_s",
        unit="s",
        meaning="end of the judged window",
        measure=lambda signals: float(signals.circling("time")[-1]),
        heading="judged until",
        compared=False,
    ),
    Metric(
        name="window_laps",
        unit="1",
        meaning="whole laps in that window; 0: less than one after convergence; none: the last half of the flight",
        measure=lambda signals: None if signals.window.laps is None else float(signals.window.laps),
        heading="laps judged",
        compared=False,
    ),
    Metric(
        name="laps",
        unit="1",
        meaning="laps around the target over the whole flight",
        measure=lambda signals: abs(float(signals.around[-1] - signals.around[0])) / math.tau,
        heading="laps",
        compared=False,
    ),
    Metric(
        name="goes_round",
        unit=YES_OR_NO,
        meaning="true if the mean angular rate around the target in the judged window is at least a tenth of V / R_d",
        measure=lambda signals: signals.goes_round(signals.window.first),
        heading="goes round",
        compared=False,
    ),
    Metric(
        name="range_error_final_m",
        unit="m",
        meaning="range error at the end",
        measure=lambda signals: float(signals.log["range_error"][-1]),
        heading="settled error",
        statistic="final",
        of_circling=True,
    ),
    Metric(
        name="range_error_rms_m",
        unit="m",
        meaning="range error in the judged window",
        measure=lambda signals: rms(signals.circling("range_error")),
        heading="settled error",
        statistic="rms",
        in_short_tables=True,
        of_circling=True,
    ),
    Metric(
        name="range_error_peak_m",
        unit="m",
        meaning="largest |range error| in the judged window",
        measure=lambda signals: peak(signals.circling("range_error")),
        heading="settled error",
        statistic="peak",
        in_short_tables=True,
        of_circling=True,
    ),
    Metric(
        name="overshoot_m",
        unit="m",
        meaning="largest range error of the opposite sign after the first crossing; 0 without a crossing",
        measure=lambda signals: overshoot(signals.log["range_error"]),
        heading="overshoot",
        in_short_tables=True,
        of_circling=True,
    ),
    Metric(
        name="saturation_fraction",
        unit="1",
        meaning="share of time in which the command saturates, in the judged window",
        measure=_saturation,
        heading="saturation",
        statistic="share",
        percent=True,
        in_short_tables=True,
        of_circling=True,
        worst=1.0,
    ),
    Metric(
        name="command_activity_deg_s2",
        unit="deg/s2",
        meaning="total variation of the command per second, in the judged window",
        measure=_activity,
        heading="command activity",
        in_short_tables=True,
        of_circling=True,
    ),
    Metric(
        name="chatters",
        unit=YES_OR_NO,
        meaning="true if a limit cycle is detected; null if undecided: gusts, below 0.2 Hz, or a window below 30 s",
        measure=lambda signals: signals.chatters,
        heading="limit cycle",
        of_circling=True,
    ),
    Metric(
        name="limit_cycle_hz",
        unit="Hz",
        meaning="frequency of that limit cycle",
        measure=lambda signals: signals.limit_cycle.frequency if signals.limit_cycle else None,
        heading="limit cycle",
        of_circling=True,
    ),
    Metric(
        name="limit_cycle_amplitude_deg_s",
        unit="deg/s",
        meaning="amplitude (half of peak to peak) of the flown heading rate in that limit cycle; 0 without one",
        measure=_limit_cycle_amplitude,
        heading="limit cycle",
        statistic="amplitude",
        of_circling=True,
    ),
    Metric(
        name="heading_rate_error_rms_deg_s",
        unit="deg/s",
        meaning="flown minus commanded heading rate, both averaged over 0.25 s (-3 dB at 1.8 Hz)",
        measure=_heading_rate_error,
        heading="heading-rate error",
        statistic="rms",
    ),
    Metric(
        name="heading_rate_lag_s",
        unit="s",
        meaning="delay of the flown behind the commanded heading rate, by least squares",
        measure=lambda signals: signals.lag_and_gain[0],
        heading="heading-rate lag",
    ),
    Metric(
        name="heading_rate_gain",
        unit="1",
        meaning="flown over commanded heading rate, at that delay",
        measure=lambda signals: signals.lag_and_gain[1],
        heading="heading-rate gain",
        ideal=1.0,
    ),
    Metric(
        name="turn_ratio",
        unit="1",
        meaning="flown heading rate over g tan(bank) / V",
        measure=_turn_ratio,
        heading="turn ratio",
        ideal=1.0,
    ),
    Metric(
        name="bank_peak_deg",
        unit="deg",
        meaning="largest |bank|",
        measure=lambda signals: math.degrees(peak(signals.log["bank"])),
        heading="bank",
        statistic="peak",
        in_short_tables=True,
    ),
    Metric(
        name="bank_reserve_deg",
        unit="deg",
        meaning="bank limit of the inner loop minus the bank of a coordinated turn at the heading-rate limit",
        measure=_bank_reserve,
        heading="bank in reserve",
    ),
    Metric(
        name="sideslip_rms_deg",
        unit="deg",
        meaning="sideslip over the flight",
        measure=lambda signals: math.degrees(rms(signals.log["sideslip"])),
        heading="sideslip",
        statistic="rms",
    ),
    Metric(
        name="sideslip_peak_deg",
        unit="deg",
        meaning="largest |sideslip|",
        measure=lambda signals: math.degrees(peak(signals.log["sideslip"])),
        heading="sideslip",
        statistic="peak",
        in_short_tables=True,
    ),
    Metric(
        name="lateral_acceleration_rms_mps2",
        unit="m/s2",
        meaning="lateral specific force (body y); zero in a coordinated turn",
        measure=lambda signals: rms(signals.log["lateral_acceleration"]),
        heading="lateral acceleration",
        statistic="rms",
    ),
    Metric(
        name="airspeed_deviation_rms_mps",
        unit="m/s",
        meaning="airspeed minus the nominal airspeed",
        measure=lambda signals: rms(signals.log["airspeed"] - signals.log.flight.start.airspeed),
        heading="airspeed deviation",
        statistic="rms",
    ),
    Metric(
        name="altitude_deviation_peak_m",
        unit="m",
        meaning="largest |altitude minus the commanded altitude|",
        measure=lambda signals: peak(signals.log["altitude"] - signals.log.flight.start.altitude),
        heading="altitude deviation",
        statistic="peak",
    ),
)
METRICS: Mapping[str, Metric] = MappingProxyType({metric.name: metric for metric in _METRICS})
