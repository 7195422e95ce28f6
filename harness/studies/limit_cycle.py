"""Limit cycles predicted and flown: `python -m harness.studies.limit_cycle` writes the page limit_cycle.md."""

import csv
import io
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import click
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import aircraft
from autopilot.laws import law
from autopilot.nftsm import Nftsm
from autopilot.response import critical_gain
from harness.chatter import VISIBLE
from harness.drawing import draw
from harness.identification.fit import fit
from harness.identification.identify import of_heading_rate
from harness.identification.manoeuvres import STEP, flown, held
from harness.limit_cycle.cycle import balance, limit_cycle
from harness.limit_cycle.prediction import LimitCycle, Loop, boundary
from harness.plants.identified import Identified, identified
from harness.plants.lagged import Lagged
from harness.plants.sixdof import SixDof
from harness.studies.command import counted, out_option, run, write
from harness.studies.observed_cycle import fly
from harness.template import template

AIRFRAMES = tuple(aircraft.names())
PERIOD = 0.05  # s, of the guidance
PAPER_K2, PAPER_K3 = 12.0, 6.0
LIMITS_DEG_S = (5.0, 10.0, 20.0)
LINEAR_UP_TO_DEG_S = 10.0  # beyond it the actuators' rate limits slow the bank, which no linear response predicts

_QUICKER = (0.5, 1.0, 2.0, 4.0, 8.0)
_COLOURS = ("#1f5fa8", "#e08020", "#3a9a4b")


def airframe_of(name: str) -> tuple[Path, Identified]:
    """An airframe at its own airspeed."""
    airframe = aircraft.folder(name)
    return airframe, identified(airframe, aircraft.limits(airframe).design_airspeed)


def loop_of(known: Identified, k2: float = PAPER_K2, k3: float = PAPER_K3, limit_deg_s: float = 5.0) -> Loop:
    """NFTSM with these reaching gains on the paper's circle, at 25 m/s as much wider, behind the response."""
    standoff = 200.0 * known.airspeed / 13.0
    limit = math.radians(limit_deg_s)
    nftsm = law("nftsm", "fitted", airspeed="nominal", k2=k2, k3=k3, standoff=standoff, max_heading_rate=limit)
    return Loop(nftsm, known.heading_rate, known.airspeed, PERIOD)


def with_gains(loop: Loop, k2: float, k3: float) -> Loop:
    """The loop with other reaching gains."""
    nftsm = loop.law
    assert isinstance(nftsm, Nftsm)
    return replace(loop, law=replace(nftsm, k2=k2, k3=k3))


class FlownCycle(NamedTuple):
    """One limit cycle flown on 6-DOF and on `lagged`, and predicted."""

    airframe: str
    limit_deg_s: float
    sixdof: LimitCycle
    lagged: LimitCycle
    predicted: LimitCycle | None
    one_harmonic: LimitCycle | None
    slow: LimitCycle | None  # predicted from the response to reversals between the limits


def cycles() -> Iterator[FlownCycle]:
    """The paper's gains on each airframe at each heading-rate limit."""
    for name in AIRFRAMES:
        airframe, known = airframe_of(name)
        for limit in LIMITS_DEG_S:
            loop = loop_of(known, limit_deg_s=limit)
            reversals = [flown(airframe, known.airspeed, held([limit, -limit] * 12, each)) for each in (0.5, 0.7, 1.0)]
            slow = fit([of_heading_rate(record) for record in reversals])
            yield FlownCycle(
                airframe=name,
                limit_deg_s=limit,
                sixdof=fly(loop, SixDof(airframe, STEP, rate_trim=True)),
                lagged=fly(loop, known.lagged),
                predicted=limit_cycle(loop),
                one_harmonic=balance(loop, harmonics=1),
                slow=limit_cycle(replace(loop, response=slow)),
            )


class Border(NamedTuple):
    """Where an airframe's limit cycle begins: gains k2 with k3 = k2/2, and times that its inner loop is as quick."""

    airframe: str
    known: Identified
    critical: float  # 1/s
    k2: float  # predicted
    k2_linear: float  # the same with k3 = 0
    k2_flown: float  # on 6-DOF
    quicker: float  # predicted, for the paper's gains
    quicker_flown: float  # on `lagged` with a response that much quicker
    faded: float  # rad/s: by how much the command still swings on `lagged` with k2 0.7 times that of the border


def border(name: str) -> Border:
    """Predicted, and found by bisection in flight."""
    airframe, known = airframe_of(name)
    loop, sixdof = loop_of(known), SixDof(airframe, STEP, rate_trim=True)
    k2 = boundary(lambda q: with_gains(loop, q, 0.5 * q), 3.0)
    quicker = boundary(lambda q: replace(loop, response=loop.response.quicker(q)), 4.0)
    return Border(
        airframe=name,
        known=known,
        critical=critical_gain(loop.response, PERIOD)[0],
        k2=k2,
        k2_linear=boundary(lambda q: with_gains(loop, q, 0.0), 3.0),
        k2_flown=_bisected(lambda q: fly(with_gains(loop, q, 0.5 * q), sixdof), k2),
        quicker=quicker,
        quicker_flown=_bisected(lambda q: fly(loop, Lagged(loop.response.quicker(q))), quicker),
        faded=fly(with_gains(loop, 0.7 * k2, 0.35 * k2), known.lagged).command,
    )


def _bisected(at: Callable[[float], LimitCycle], guess: float) -> float:
    """The q within a factor of two of the guess, to 1 %, where flights begin or cease to chatter; else NaN."""
    low, high = 0.5 * guess, 2.0 * guess
    below = at(low).command >= VISIBLE
    if below == (at(high).command >= VISIBLE):
        return math.nan
    while high / low > 1.02:
        middle = math.sqrt(low * high)
        if (at(middle).command >= VISIBLE) == below:
            low = middle
        else:
            high = middle
    return math.sqrt(low * high)


class MapPoint(NamedTuple):
    """A flight in the map."""

    x: float
    y: float
    chatters: bool


def map_figure(borders: Sequence[Border]) -> str:
    """The map as SVG: gains against the inner loop's bandwidth, and the two gains against each other."""
    lines, points, own = [], [], []  # of each airframe
    for b in borders:
        loop = loop_of(b.known)
        bandwidth = loop.response.bandwidth
        line = [(q * bandwidth, _largest_k2(loop, q)) for q in np.geomspace(_QUICKER[0], _QUICKER[-1], 13)]
        lines.append(line)
        points.append(
            [
                MapPoint(
                    q * bandwidth,
                    k2,
                    _chatters(fly(with_gains(_quicker(loop, q), k2, 0.5 * k2), _lagged(loop, q), 60.0)),
                )
                for q in _QUICKER
                for k2 in np.array([0.6, 0.85, 1.15, 1.6]) * _largest_k2(loop, q)
            ]
        )
        sixdof = SixDof(aircraft.folder(b.airframe), STEP, rate_trim=True)
        own.append(
            [
                MapPoint(bandwidth, k2, _chatters(fly(with_gains(loop, k2, 0.5 * k2), sixdof, 60.0)))
                for k2 in (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 12.0)
            ]
        )
    first = loop_of(borders[0].known)
    plane = {q: _plane(first, q) for q in (1.0, 2.0, 4.0)}
    grid = {
        q: [
            MapPoint(k2, k3, _chatters(fly(with_gains(_quicker(first, q), k2, k3), plant, 60.0)))
            for scale in (0.7, 1.4)
            for k2, k3 in scale * np.array(plane[q][1:-1:2])
        ]
        for q, plant in (
            (1.0, SixDof(aircraft.folder(borders[0].airframe), STEP, rate_trim=True)),
            (2.0, _lagged(first, 2.0)),
            (4.0, _lagged(first, 4.0)),
        )
    }

    def paint(figure: Figure) -> None:
        left, right = figure.subplots(1, 2)
        for b, line, lagged, sixdof, colour in zip(borders, lines, points, own, _COLOURS, strict=False):
            left.loglog(*np.array(line).T, color=colour, lw=1.4, label=b.airframe)
            _dots(left, lagged, "o", 12.0, colour)
            _dots(left, sixdof, "s", 26.0, colour)
        left.axhline(PAPER_K2, color="0.5", lw=0.8, ls="--")
        left.annotate("the paper's k2", (left.get_xlim()[0] * 1.1, PAPER_K2 * 1.04), fontsize=8, color="0.4")
        left.set_xticks([1, 2, 5, 10, 20, 50], ["1", "2", "5", "10", "20", "50"])
        left.set_xticks([], minor=True)
        left.set_yticks([0.5, 1, 2, 5, 10, 20], ["0.5", "1", "2", "5", "10", "20"])
        left.set(xlabel="bandwidth of the inner loop, rad/s", ylabel="k2, 1/s, with k3 = k2/2")
        left.set(title="Above its line an airframe chatters. Flown: squares sixdof, dots lagged;\nfilled: it did")
        for (q, line), colour in zip(plane.items(), _COLOURS, strict=True):
            bandwidth = q * first.response.bandwidth
            right.plot(*np.array(line).T, color=colour, lw=1.4, label=f"{bandwidth:.3g} rad/s ({q:g} times as quick)")
            _dots(right, grid[q], "s" if q == 1.0 else "o", 18.0, colour)
        right.plot([PAPER_K2], [PAPER_K3], "*", color="#c03030", ms=9, label="the paper's gains")
        right.set(
            xlabel="k2, 1/s",
            ylabel="k3, 1/s",
            title=f"{borders[0].airframe}: k2 and k3,\nat three bandwidths of the inner loop",
        )
        for axes in (left, right):
            axes.legend(fontsize=7)

    return draw(paint, width=10.0, height=4.4)


def _dots(axes: Axes, points: Sequence[MapPoint], marker: str, size: float, colour: str) -> None:
    """Filled where the flight chattered."""
    x, y, faces = zip(*((point.x, point.y, colour if point.chatters else "white") for point in points), strict=True)
    axes.scatter(x, y, s=size, marker=marker, edgecolors=colour, c=list(faces), linewidths=0.8, zorder=3)


def _chatters(cycle: LimitCycle) -> bool:
    return cycle.command >= VISIBLE


def _quicker(loop: Loop, q: float) -> Loop:
    return replace(loop, response=loop.response.quicker(q))


def _lagged(loop: Loop, q: float) -> Lagged:
    return Lagged(loop.response.quicker(q))


def _largest_k2(loop: Loop, q: float) -> float:
    """The largest k2, with k3 = k2/2, without a limit cycle behind an inner loop q times as quick."""
    return boundary(lambda k2: with_gains(_quicker(loop, q), k2, 0.5 * k2), 3.0 * q)


def _plane(loop: Loop, q: float) -> list[tuple[float, float]]:
    """The border in the plane of k2 and k3, from k3 = 0 on."""
    angles = np.linspace(0.0, 0.5 * math.pi, 9)
    return [_corner(loop, q, math.cos(angle), math.sin(angle)) for angle in angles.tolist()]


def _corner(loop: Loop, q: float, a: float, b: float) -> tuple[float, float]:
    """The largest k2 and k3, as a to b, without a limit cycle behind an inner loop q times as quick."""
    k = boundary(lambda k: with_gains(_quicker(loop, q), k * a, k * b), 3.0 * q)
    return k * a, k * b


def page(cycles: Sequence[FlownCycle], borders: Sequence[Border]) -> str:
    """The page."""
    return (
        template("harness.studies", "limit_cycle.md.jinja").render(
            cycles=cycles,
            linear=[each for each in cycles if each.limit_deg_s <= LINEAR_UP_TO_DEG_S],
            beyond=[each for each in cycles if each.limit_deg_s > LINEAR_UP_TO_DEG_S],
            linear_up_to=LINEAR_UP_TO_DEG_S,
            largest=largest,
            borders=borders,
            off=off,
            degrees=math.degrees,
            period=PERIOD,
            k2=PAPER_K2,
            k3=PAPER_K3,
        )
        + "\n"
    )


def cycles_csv(cycles: Sequence[FlownCycle]) -> str:
    """Every cycle, a line each: flown on 6-DOF and on `lagged`, and predicted three ways."""
    numbers = ("frequency Hz", "heading rate ± deg/s", "range error mean m", "range error ± m")
    ways = ("sixdof", "lagged", "predicted", "one_harmonic", "slow")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("airframe", "limit deg/s", *(f"{way}: {number}" for way in ways for number in numbers)))
    for cycle in cycles:
        cells = [cell for way in ways for cell in _cells(getattr(cycle, way))]
        writer.writerow((cycle.airframe, f"{cycle.limit_deg_s:g}", *cells))
    return text.getvalue()


def _cells(cycle: LimitCycle | None) -> tuple[str, ...]:
    if cycle is None:
        return ("",) * 4
    rate = math.degrees(cycle.heading_rate)
    return f"{cycle.frequency:.3f}", f"{rate:.2f}", f"{cycle.range_mean:.3f}", f"{cycle.range_error:.3f}"


def borders_csv(borders: Sequence[Border]) -> str:
    """Where each airframe's limit cycle begins, a line each."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    columns: Mapping[str, Callable[[Border], float]] = {
        "bandwidth rad/s": lambda b: b.known.heading_rate.bandwidth,
        "lag s (63 %)": lambda b: b.known.measured["lag_s"],
        "critical gain 1/s": lambda b: b.critical,
        "k2 with k3 = 0, 1/s": lambda b: b.k2_linear,
        "k2 with k3 = k2/2, 1/s": lambda b: b.k2,
        "the same flown on 6-DOF, 1/s": lambda b: b.k2_flown,
        "times as quick for the paper's gains": lambda b: b.quicker,
        "the same flown on lagged": lambda b: b.quicker_flown,
        "command 30 % below the border, on lagged, deg/s": lambda b: math.degrees(b.faded),
    }
    writer.writerow(("airframe", *columns))
    writer.writerows((b.airframe, *(f"{value(b):.4g}" for value in columns.values())) for b in borders)
    return text.getvalue()


def errors(predicted: LimitCycle, flown: LimitCycle) -> tuple[float, float]:
    """The relative errors of the predicted frequency and of the predicted amplitude of the heading rate."""
    return predicted.frequency / flown.frequency - 1.0, predicted.heading_rate / flown.heading_rate - 1.0


def off(predicted: LimitCycle | None, flown: LimitCycle) -> str:
    """The errors of a prediction in frequency and in amplitude, in %."""
    if predicted is None:
        return "none predicted"
    return ", ".join(f"{100.0 * error:+.0f}" for error in errors(predicted, flown))


def largest(cycles: Sequence[FlownCycle]) -> str:
    """The largest errors of the predictions against 6-DOF, of either sign."""
    every = [errors(each.predicted, each.sixdof) for each in cycles if each.predicted is not None]
    frequency, amplitude = np.abs(every).max(axis=0)
    return f"{100.0 * frequency:.0f} % in frequency and {100.0 * amplitude:.0f} % in amplitude"


@click.command()
@out_option
def main(out: Path) -> None:
    """Predict and fly the limit cycles; write OUT/limit_cycle.md with its figure and tables. Takes two minutes."""
    borders = list(counted(map(border, AIRFRAMES), len(AIRFRAMES), "searching the border"))
    flown_cycles = list(counted(cycles(), len(AIRFRAMES) * len(LIMITS_DEG_S), "flying limit cycles"))
    write(
        out,
        {
            "limit_cycle.svg": map_figure(borders),
            "limit_cycle.csv": cycles_csv(flown_cycles),
            "limit_cycle_border.csv": borders_csv(borders),
            "limit_cycle.md": page(flown_cycles, borders),
        },
    )


if __name__ == "__main__":
    run(main, "harness.studies.limit_cycle")
