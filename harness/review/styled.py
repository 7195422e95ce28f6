"""Flights with their style: one name, colour and line width per flight, the same in every view."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from harness.log import FlightLog
from harness.plants.ladder import rung

Colour = tuple[int, int, int]

_MOST_OVERLAID = 2  # flights in one plot
MOST = 6  # largest number of flights in one recording: the number of distinguishable colours

GREY: Colour = (125, 125, 125)
LIGHT: Colour = (225, 225, 225)
TARGET: Colour = (235, 75, 85)
WIND: Colour = (220, 220, 220)
ESTIMATE: Colour = (240, 200, 70)

_PALE_BLUE: Colour = (125, 165, 215)
_ORANGE: Colour = (255, 150, 40)
_GREEN: Colour = (100, 215, 110)
_MAGENTA: Colour = (230, 110, 230)
_YELLOW: Colour = (240, 220, 80)
_CYAN: Colour = (90, 225, 235)
_PALETTE = (_PALE_BLUE, _ORANGE, _GREEN, _MAGENTA, _YELLOW, _CYAN)
_RUNGS = (_PALE_BLUE, _GREEN, _MAGENTA, _ORANGE)  # the colours of the plants, from the bottom of the ladder
WORDS: Mapping[Colour, str] = MappingProxyType(
    {
        _PALE_BLUE: "pale blue",
        _ORANGE: "orange",
        _GREEN: "green",
        _MAGENTA: "magenta",
        _YELLOW: "yellow",
        _CYAN: "cyan",
    }
)
_WIDE, _THIN = 3.5, 1.5  # points on the screen


class StyledFlight(NamedTuple):
    """A flight with its style. The first of two is the reference, drawn wide and pale under the other."""

    name: str
    log: FlightLog
    colour: Colour
    width: float  # points on the screen


def styled(logs: Mapping[str, FlightLog]) -> list[StyledFlight]:
    """The flights with their styles; a plant that appears once keeps its colour. ValueError for 0 or beyond `MOST`."""
    if not 1 <= len(logs) <= MOST:
        raise ValueError(f"{len(logs)} flights: a recording shows 1 to {MOST}")
    plants = [log.flight.plant for log in logs.values()]
    colours = [_RUNGS[rung(plant)] if 0 <= rung(plant) < len(_RUNGS) else _YELLOW for plant in plants]
    if len(set(colours)) < len(colours):
        colours = list(_PALETTE[: len(colours)])
    widths = [_WIDE if len(logs) == 2 else _THIN, *[_THIN] * (len(logs) - 1)]
    return [StyledFlight(*parts) for parts in zip(logs, logs.values(), colours, widths, strict=True)]


def is_crowd(flights: Sequence[StyledFlight]) -> bool:
    """Whether so many flights would hide each other, so that each has plots of its own."""
    return len(flights) > _MOST_OVERLAID


def mixed(colour: Colour, other: Colour, share: float) -> Colour:
    """`colour` mixed with a `share`, 0 to 1, of `other`."""
    r, g, b = (round((1.0 - share) * x + share * y) for x, y in zip(colour, other, strict=True))
    return r, g, b
