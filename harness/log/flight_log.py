"""The log of a flight: one row per guidance period, a column per quantity."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from autopilot.estimator import Estimate, Measurement
from autopilot.guidance import Guidance
from harness.error import did_you_mean
from harness.flight import Flight
from harness.plants.plant import Outcome
from harness.plants.state import State
from harness.world.target import TargetState

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

# The loop writes the first columns row by row; the others are computed at the end of the flight.
GUIDANCE_COLUMNS = ("heading_rate_command", "range_error_seen", *Guidance._fields[2:])  # computed by the law
LOOP_COLUMNS = ("time", *State._fields, *TargetState._fields, *GUIDANCE_COLUMNS)
# The target as the law knew it: without a filter the truth, with NaN as its variances. The innovation is that of the
# latest measurement since the row before, NaN if there was none.
SEEN_COLUMNS = (
    *(f"{name}_seen" for name in Estimate._fields[:4]),
    *Estimate._fields[4:],
    *(f"innovation_{name}" for name in Measurement._fields),
)
COLUMNS = (*LOOP_COLUMNS, "range_error", "feasibility_margin", *SEEN_COLUMNS)  # the range error is the true one
# The columns of the digest: motion of aircraft and target, and the command. They are listed by name, so that a new
# column of the log does not change any digest.
TRAJECTORY = (
    "north", "east", "altitude", "velocity_north", "velocity_east", "velocity_down", "airspeed", "heading",
    "heading_rate", "bank", "roll_rate", "pitch", "yaw", "pitch_rate", "yaw_rate", "aileron", "elevator", "rudder",
    "throttle", "target_north", "target_east", "target_velocity_north", "target_velocity_east",
    "target_acceleration", "target_turn_rate", "heading_rate_command",
)  # fmt: skip
_TRAJECTORY = [COLUMNS.index(name) for name in TRAJECTORY]
_ROWS_AT_ONCE = 128


@dataclass(frozen=True, slots=True, eq=False)  # equal flights have equal digests
class FlightLog:
    """A flight and what happened, one row per guidance period: `len(log)` rows, also of a flight that ended early.

    `flight` is what was flown, `outcome` how it ended and `reason` why, if early; `table` is the log, of shape
    (rows, columns). `log["range_error"]` is a column, of shape (rows,). SI, rad, north-east-down from the flight's
    origin, headings clockwise from north; NaN where the plant has no such thing. The columns:

    - `time`: s since the start.
    - `north`, `east`, `velocity_north`, `velocity_east`, `velocity_down`: the aircraft, over the ground; `altitude`
      above it.
    - `airspeed`; `heading`: psi_a, the direction of the air velocity, not the nose; `heading_rate`.
    - `bank`, `pitch`, `yaw`, where `yaw` is the nose; `roll_rate`, `pitch_rate`, `yaw_rate` about the body's axes;
      `bank_command` of the inner loop.
    - `angle_of_attack`; `sideslip`, positive with the wind from the right; `lateral_acceleration`: specific force along
      the body's y axis, m/s^2, zero in a coordinated turn; `load_factor`.
    - `aileron` (positive rolls right), `elevator` (positive pitches down), `rudder` (positive yaws left), `throttle`
      (0 to 1).
    - `wind_north`, `wind_east`, `wind_down`: velocity of the air at the aircraft, gusts included.
    - `target_north`, `target_east`, `target_velocity_north`, `target_velocity_east`, `target_acceleration` (rate of its
      speed), `target_turn_rate`: the target in truth.
    - `heading_rate_command`: what the law commands, limited; `unlimited_command`: the same without the limit;
      `feed_forward`: its part that no error makes.
    - `range_error`: distance to the target minus the standoff distance; `range_error_seen`: the same as the law knows
      it; `sliding_variable`, `heading_error`: the law's own, rad.
    - `feasibility_margin`: the limit of the command minus the rate that the circle takes in this air and round this
      target, rad/s, each as if it stayed so; -inf where no rate holds it.
    - `target_north_seen`, `target_east_seen`, `target_velocity_north_seen`, `target_velocity_east_seen`: the target as
      the law knows it; `target_north_variance`, `target_east_variance`, `target_velocity_north_variance`,
      `target_velocity_east_variance`: of the estimate; `innovation_range`, `innovation_azimuth`: of the latest
      measurement since the row before, NaN without one.

    - The channels of a user-defined law, named `law_NAME`; see the guide to a user-defined law.

    >>> log = harness.simulate(flight)
    >>> log["range_error"][-1], log.metrics["convergence_time_s"]
    """

    flight: Flight
    outcome: Outcome
    reason: str  # why it ended early, or empty
    table: NDArray[np.float64]  # (rows, len(COLUMNS))
    channels: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)  # the law's own, (rows,): `law_NAME`

    def __repr__(self) -> str:
        flown = f"{self['time'][-1]:g} s of " if len(self) else ""
        law, plant = type(self.flight.law).__name__, self.flight.plant
        return f"<FlightLog: {flown}{law} on {plant}, {self.flight.aircraft}, {self.outcome}, {len(self)} rows>"

    def __getitem__(self, column: str) -> NDArray[np.float64]:
        """The column, (rows,). KeyError for a name that is none of `COLUMNS` and no channel of the law."""
        if column in self.channels:
            return self.channels[column]
        if column not in COLUMNS:
            known = [*COLUMNS, *self.channels]
            raise KeyError(f"no column {column!r}{did_you_mean(column, known)}; the columns are {', '.join(known)}")
        return self.table[:, COLUMNS.index(column)]

    def __len__(self) -> int:
        return len(self.table)

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of all columns, those of the law's own channels last."""
        return (*COLUMNS, *self.channels)

    @property
    def whole(self) -> NDArray[np.float64]:
        """The table with the law's own channels; (rows, len(columns))."""
        return np.column_stack([self.table, *self.channels.values()]) if self.channels else self.table

    @property
    def digest(self) -> str:
        """32 hex digits: a hash of the trajectory to the last bit, and of the outcome. Equal digests, equal flights."""
        content = hashlib.sha256(repr((TRAJECTORY, self.outcome.value)).encode())
        for begin in range(0, len(self.table), _ROWS_AT_ONCE):  # few enough to stay in the processor's cache
            rows = self.table[begin : begin + _ROWS_AT_ONCE, _TRAJECTORY]
            content.update(np.ascontiguousarray(rows + 0.0).data)  # + 0.0: minus zero is zero
        return content.hexdigest()[:32]

    # For notebooks. Each imports its module when it is used: a flight alone needs neither.

    @property
    def metrics(self) -> dict[str, float | bool | None]:
        """All metrics by name, units by suffix; None where the plant has no such thing, or the flight shows none."""
        from harness.log.metric import measure

        return measure(self)

    def frame(self) -> "pd.DataFrame":
        """A copy of the log as a pandas DataFrame, with the same rows, columns and units.

        >>> log.frame().plot(x="time", y="range_error")
        """
        import pandas as pd

        return pd.DataFrame(self.whole, columns=self.columns, copy=True)

    def show(self, *others: "FlightLog") -> Any:
        """In a notebook the viewer inside the page, with `others` over this flight, in the layout of a recording.

        That takes Rerun's notebook support, `pip install 'standoff-harness[notebook]'`; without it the picture of
        `plot`. The last expression of a cell shows itself. `ArgumentError` for what cannot be drawn.

        >>> harness.simulate(flight).show()
        """
        return import_module("harness.interface").show(self, *others)  # the viewer stands above the log

    def plot(self, *others: "FlightLog", panels: Sequence[str] = ()) -> "Figure":
        """A matplotlib figure of this flight, and of `others` over it, up to six in all, in the size of print.

        `panels` chooses among those of `harness plot --what`: "track" with north up, the target and the standoff
        circle; "error", the size of the range error in m on a log scale; "rate", heading rate, and "bank", each with
        its command, in deg; "sideslip"; "spectrum" of the command while circling is judged. Without a choice all that
        the plants have, of more than two flights the clearest. A notebook shows the figure by itself.

        `ArgumentError` for what cannot be drawn: more flights than colours, a flight without a row, an unknown panel.

        >>> log.plot().savefig("flight.pdf")
        >>> log.plot(other, panels=["track", "error"])
        """
        from harness.log.figure import named, picture

        return picture(named((self, *others)), panels)
