"""A validation as lines, as JSON, and as a figure of curves."""

import math
from collections.abc import Iterator
from typing import Any

from matplotlib.figure import Figure

from harness.drawing import COLOURS, INK
from harness.plants.replay import REPLAYED
from harness.recorded.contents import SHOWN
from harness.recorded.recorded_flight import QUANTITIES
from harness.recorded.validation import APART, HORIZONS, JUDGED, ReplayFit, Validation
from harness.tables import table


def lines(found: Validation) -> Iterator[str]:
    """What `harness validate` prints."""
    flights = ", ".join(flight.name for flight in found.flights)
    yield f"{found.airframe.name} with the recorded surfaces of {flights}:"
    yield "how much of the variance of the recording the model explains, %; below 0 a constant would do better"
    yield ""
    several = "\n"
    headings = ["", *(f"{how}{several}{h:g} s" for how in ("as recorded", "adjusted") for h in HORIZONS)]
    yield from table(headings, (_row(name, found.as_recorded, found.adjusted) for name in JUDGED), "lr")
    yield ""
    counts = ", ".join(f"{count} over {h:g} s" for count, h in zip(found.as_recorded.starts, HORIZONS, strict=True))
    yield f"starts {APART:g} s apart, which overlap: {counts}"
    aileron, elevator, delay = found.adjusted.adjusted
    yield (
        f"adjusted: aileron {math.degrees(aileron):+.1f} deg, elevator {math.degrees(elevator):+.1f} deg, "
        f"command delay {delay:.3f} s: the best fit to the rates over {HORIZONS[0]:g} s"
    )
    for note in found.notes:
        yield f"note: {note}"


def _row(name: str, *fits: ReplayFit) -> list[str]:
    return [name.replace("_", " "), *(_percent(value) for fit in fits for value in fit.explained[name])]


def _percent(value: float) -> str:
    return "-" if math.isnan(value) else "< -999" if value < -999 else f"{value:.0f}"


def as_json(found: Validation) -> dict[str, Any]:
    """The validation for JSON; SI, rad; non-finite values are null."""

    def told(fit: ReplayFit) -> dict[str, Any]:
        finite = {name: [v if math.isfinite(v) else None for v in values] for name, values in fit.explained.items()}
        return {"explained_percent": finite, "starts": list(fit.starts), **fit.adjusted._asdict()}

    return {
        "airframe": found.airframe.name,
        "flights": [flight.name for flight in found.flights],
        "horizons_s": list(HORIZONS),
        "as_recorded": told(found.as_recorded),
        "adjusted": told(found.adjusted),
        "notes": list(found.notes),
    }


def paint(figure: Figure, found: Validation) -> None:
    """A column of panels for each flight: the recording, and the model begun anew on it."""
    names = [flight.name for flight in found.flights]
    panels = figure.subplots(len(JUDGED), len(names), squeeze=False, sharex="col", sharey="row")
    for column, flight in enumerate(found.flights):
        for row, name in enumerate(JUDGED):
            axes, k = panels[row][column], REPLAYED.index(name)
            unit, scale = SHOWN[QUANTITIES[name].unit]
            channel = flight[name]
            axes.plot(channel.time, scale * channel.values, color=INK, linewidth=0.9, label="recorded")
            low, high = scale * channel.values.min(), scale * channel.values.max()
            for i, replay in enumerate(replay for replay in found.curves if replay.flight == flight.name):
                model = {"label": found.airframe.name} if i == 0 else {}
                axes.plot(replay.time, scale * replay.simulated[:, k], color=COLOURS[1], linewidth=1.2, **model)
                axes.axvline(replay.time[0], color=COLOURS[4], linewidth=0.5, linestyle=":")
            margin = 0.6 * max(high - low, 1e-3)
            axes.set_ylim(low - margin, high + margin)
            if column == 0:
                axes.set_ylabel(f"{name.replace('_', ' ')}\n{unit}")
        panels[0][column].set_title(flight.name)
        panels[-1][column].set_xlabel("time, s")
    panels[0][0].legend(loc="upper right")
