"""Does the rule of `harness adopt` beat gains by hand? `python -m harness.studies.design_rule` writes design_rule.md.

Each airframe of the harness is taken as a model of somebody else: its inner loop is taken out, its surfaces are moved
by normalised commands, and the stages of `harness adopt` give it an inner loop by the rule.
"""

import math
import re
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import click

import aircraft
from autopilot.laws import law
from autopilot.rules import RuleError
from harness import tables
from harness.adoption.adoption import STEP, Adoption, Wish, write
from harness.adoption.manoeuvres import Turned, turned
from harness.adoption.model import named, source, writers
from harness.adoption.stages import STAGES
from harness.child import MEMORY, limited
from harness.files import write_text
from harness.flight import Flight
from harness.identification.identify import identify
from harness.plants.identified import Identified, document, identified
from harness.plants.plant import Start
from harness.settings.gains import by_rule
from harness.studies.command import out_option, run
from harness.studies.command import write as write_pages

_PAGE = "design_rule.md"
_SECONDS = 600.0  # of a stage: the page does not depend on what else the machine does
_COMMANDS = ("elevator", "aileron", "rudder")
_DESIGNED = ("load", "trim", "linearise", "design")  # the engines of these airframes are no engines of JSBSim's


class FlownLoop(NamedTuple):
    """An inner loop on an airframe: what it was identified as, its change of course, and k2 where the cycle begins."""

    airframe: str
    made: str  # by hand, or by the rule
    identified: Identified
    turned: Turned
    border: float

    def cells(self) -> list[str]:
        """Its line of the table."""
        m, t = self.identified.measured, self.turned
        return [
            self.airframe, self.made, f"{m['lag_s']:.2f}", f"{100 * m['overshoot']:.1f}", f"{m['gain']:.3f}",
            f"{m['bandwidth_rad_s']:.2f}", f"{math.degrees(t.overshoot):.2f}", f"{t.altitude:.2f}",
            f"{math.degrees(t.sideslip):.2f}", _border_told(self.border),
        ]  # fmt: skip


def open_loop(airframe: Path) -> str:
    """The text of the airframe's model without its inner loop, its surfaces moved by normalised commands."""
    limits = aircraft.inner_loop(airframe)["limit"]
    text = aircraft.model(airframe).read_text(encoding="utf-8")
    text = re.sub(r'<system file="inner_loop">.*?</system>', "", text, flags=re.DOTALL)
    text = text.replace("<input> inner-loop/trim/elevator-rad </input>", "")
    text = text.replace("actuators/", "servos/").replace("gust/", "turning-air/")
    asked = '\n<property value="0"> servos/throttle-asked-norm </property>'
    scaled = ""
    for name in _COMMANDS:
        if f"{name}-rad" in limits:
            scaled += (
                f'<pure_gain name="servos/{name}-asked-rad"> <input> fcs/{name}-cmd-norm </input> '
                f"<gain> {limits[f'{name}-rad']['v']} </gain> </pure_gain>"
            )
    text = re.sub(r'(<channel name="Actuators"[^>]*>)', rf"{asked}\1{scaled}", text)
    text = re.sub(r"inner-loop/(elevator|aileron|rudder)-rad", r"servos/\1-asked-rad", text)
    return text.replace("inner-loop/throttle-norm", "servos/throttle-asked-norm")


def by_hand(airframe: Path) -> FlownLoop:
    """The airframe as it is."""
    limits, gain = aircraft.limits(airframe), aircraft.inner_loop(airframe)["gain"]
    start = Start(airspeed=limits.design_airspeed, heading=0.0)
    return FlownLoop(
        airframe.name,
        "by hand",
        identified(airframe, start.airspeed),
        turned(airframe, start, STEP, limits.bank, 1.0 / gain["rate-trim-model-per-s"]["v"]),
        _border(airframe, start),
    )


def by_the_rule(airframe: Path) -> FlownLoop:
    """The same model with the inner loop that the rule gives it."""
    limits = aircraft.limits(airframe)
    with tempfile.TemporaryDirectory(prefix="harness-") as temporary:
        given, folder = Path(temporary) / "given" / airframe.name, Path(temporary) / airframe.name
        given.mkdir(parents=True)
        folder.mkdir()
        write_text(aircraft.model(given), open_loop(airframe))
        model = source(str(aircraft.model(given)))
        start = Start(airspeed=limits.design_airspeed, heading=0.0)
        adoption = Adoption(
            name=model.name,
            wish=Wish(
                airspeed=start.airspeed,
                altitude=start.altitude,
                max_bank=limits.bank,
                controls={"throttle": "servos/throttle-asked-norm"},
            ),
            folder=folder,
            names=frozenset(named(model.root)),
            writers=writers(model.root),
            start=start,
        )
        for stage in _DESIGNED:
            write(adoption, model)
            adoption, _ = limited(stage, _SECONDS, MEMORY, STAGES[stage], adoption)
        write(adoption, model)
        aircraft.keep_written(folder)
        found = limited("identify", _SECONDS, MEMORY, identify, folder, start.airspeed).identified
        write_text(aircraft.identified(folder), document(folder, [found]))
        lag = aircraft.adopted_lag(folder)
        assert lag
        return FlownLoop(
            airframe.name,
            "by the rule",
            found,
            limited("90 deg", _SECONDS, MEMORY, turned, folder, start, STEP, limits.bank, lag),
            _border(folder, start),
        )


def _border(folder: Path, start: Start) -> float:
    """The k2 of the paper's law, with k3 = k2 / 2, at which the limit cycle begins on its circle, 1/s.

    NaN where none is found.
    """
    standoff = 200.0 * start.airspeed / 13.0
    paper: Any = law("nftsm", "fitted", standoff=standoff, max_heading_rate=math.radians(5.0))
    flight = Flight(plant="sixdof", aircraft=str(folder), law=replace(paper, gains="behind_inner_loop"), start=start)
    try:
        found: Any = by_rule(flight, ()).law
    except RuleError:
        return math.nan
    return 2.0 * float(found.k2)  # the rule halves it


def page(loops: Sequence[FlownLoop]) -> str:
    """The page, in Markdown."""
    return "\n".join(_lines(loops)) + "\n"


def _lines(loops: Sequence[FlownLoop]) -> Iterator[str]:
    yield "# Gains by hand and by the rule"
    yield ""
    yield "Does the rule of `harness adopt`, which knows no aircraft, do better than the gains that were made by hand?"
    yield ""
    yield from _answer(loops)
    yield ""
    yield "Each airframe is taken as a model of somebody else, without its inner loop, within the limits of bank and"
    yield "surfaces that it has. *Lag*, *overshoot* and *gain* are those of a step of the heading rate of 5 °/s; the"
    yield "overshoot of the turn, *altitude* and *sideslip* those of a change of course by 90°; at *k2* the limit cycle"
    yield "of the paper's law begins on its circle."
    yield ""
    yield "Written by `python -m harness.studies.design_rule` (`make adopted`)."
    yield ""
    yield from tables.markdown(
        ["airframe", "gains", "lag, s", "overshoot, %", "gain", "bandwidth, rad/s", "overshoot of the turn, deg",
         "altitude, m", "sideslip, deg", "k2, 1/s"],
        [loop.cells() for loop in loops],
        "llr",
    )  # fmt: skip


def _answer(loops: Sequence[FlownLoop]) -> Iterator[str]:
    pairs = list(zip(loops[::2], loops[1::2], strict=True))
    sooner = sum(rule.identified.measured["lag_s"] < hand.identified.measured["lag_s"] for hand, rule in pairs)
    calmer = sum(rule.border > hand.border for hand, rule in pairs)
    yield (
        f"**The answer.** {'No' if sooner + calmer < len(pairs) else 'In part'}: with the rule's gains {sooner} of "
        f"{len(pairs)} airframes follow sooner, and on {calmer} the limit cycle begins at a higher gain."
    )
    yield ""
    for hand, rule in pairs:
        ratio = rule.identified.measured["lag_s"] / hand.identified.measured["lag_s"]
        yield (
            f"- {hand.airframe}: the lag is {ratio:.2f} times that by hand; sideslip "
            f"{math.degrees(rule.turned.sideslip):.1f} instead of {math.degrees(hand.turned.sideslip):.1f}°; the limit "
            f"cycle begins at k2 = {_border_told(rule.border)} instead of {_border_told(hand.border)} /s."
        )


def _border_told(border: float) -> str:
    return f"{border:.2f}" if math.isfinite(border) else "not found"


@click.command()
@out_option
def main(out: Path) -> None:
    """Design the inner loops of the airframes by the rule, and write OUT/design_rule.md: the rule beside the hand."""
    loops = []
    for name in aircraft.names():
        airframe = aircraft.folder(name)
        loops += [by_hand(airframe), by_the_rule(airframe)]
    write_pages(out, {_PAGE: page(loops)})


if __name__ == "__main__":
    run(main, "harness.studies.design_rule")
