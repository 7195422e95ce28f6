"""What a law knows before it flies, and the time that it is told in flight."""

import shutil
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

import aircraft
from autopilot.guidance import Context, Guidance, LawStep, Observation
from harness.flight import context_of
from harness.key import version_of
from harness.loop import simulate
from harness.plants.identified import identified
from harness.plants.ladder import PLANTS
from tests.builders import FLIGHT, OwnLaw, turning


@dataclass(frozen=True)
class Knowing(OwnLaw):
    """A law that computes with the identified response."""

    uses_response: bool = True
    told: list[Context] = field(default_factory=list, hash=False)

    def start(self, context: Context) -> LawStep:
        self.told.append(context)
        return super().start(context)


def straight() -> LawStep:
    return lambda observation: turning(0.0)


@pytest.mark.parametrize("plant", PLANTS)
def test_a_law_is_told_period_airspeed_seed_and_response(plant: str) -> None:
    knowing = Knowing(straight)
    simulate(replace(FLIGHT, plant=plant, law=knowing, duration=0.4, guidance_period=0.1, seed=7))
    response = identified(aircraft.folder("ultra_stick_25e"), 13.0).heading_rate
    assert knowing.told == [Context(0.1, 13.0, 7, response, plant == "kinematic")]


def test_a_law_that_does_not_ask_for_the_response_is_not_told_it() -> None:
    assert context_of(FLIGHT).response is None
    assert "aircraft/identified.toml" not in version_of(FLIGHT).decides["content"]


def test_the_response_of_an_airframe_that_is_not_identified_there_is_unknown() -> None:
    knowing = replace(FLIGHT, law=Knowing(straight))
    assert context_of(replace(knowing, start=replace(knowing.start, airspeed=20.0))).response is None
    assert context_of(replace(knowing, aircraft="no such")).response is None


def test_what_was_identified_decides_the_flights_of_a_law_that_asks_for_it(tmp_path: Path) -> None:
    own = tmp_path / "stick"
    shutil.copytree(aircraft.folder("ultra_stick_25e"), own)
    (own / "ultra_stick_25e.xml").rename(own / "stick.xml")
    flight = replace(FLIGHT, aircraft=str(own), law=Knowing(straight))
    before = version_of(flight)
    known = aircraft.identified(own)
    known.write_text(known.read_text().replace("lead = ", "lead = 1"))
    assert version_of(flight).number != before.number
    known.unlink()
    assert "aircraft/identified.toml" not in version_of(flight).decides["content"]


def test_a_law_is_told_the_time() -> None:
    times = []

    def step(observation: Observation) -> Guidance:
        times.append(observation.time)
        return turning(0.0)

    log = simulate(replace(FLIGHT, law=OwnLaw(lambda: step), duration=1.0))
    assert times == log["time"].tolist()
    assert times[-1] == 1.0
