"""A recorded flight is seen: its page and its recording show what was said of it, and what was refused and why."""

import re
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from harness.recorded.assessment import assess
from harness.recorded.beside import ModelFlight
from harness.recorded.page import page
from harness.recorded.panels import scatter, track
from harness.recorded.recorded_flight import Basis, LoggedEvent, RecordedFlight, sampled
from harness.recorded.recording import write_recording_of
from harness.review.seal import is_sealed
from tests.builders import EXPERIMENTS, invoke


@pytest.fixture(scope="module")
def circling() -> RecordedFlight:
    """Coordinated turns both ways in a wind of 3 m/s to the north, and a failure at 170 s."""
    time = np.arange(0.0, 180.0, 0.1)
    bank = np.radians(30.0) * np.sign(np.sin(time / 9.0)) * np.minimum(1.0, 6.0 * np.abs(np.sin(time / 9.0)))
    heading = np.append(0.0, np.cumsum(9.80665 * np.tan(bank[1:]) / 18.0 * 0.1))
    north, east = 18.0 * np.cos(heading) + 3.0, 18.0 * np.sin(heading)
    noise = np.random.default_rng(0).normal(size=(3, len(time)))
    values = {
        "bank": (bank, Basis.ESTIMATED), "bank_command": (np.roll(bank, -5), Basis.COMMANDED),
        "velocity_north": (north + 0.1 * noise[0], Basis.ESTIMATED),
        "velocity_east": (east + 0.1 * noise[1], Basis.ESTIMATED),
        "airspeed": (18.0 + 0.2 * noise[2], Basis.MEASURED),
    }  # fmt: skip
    channels = {name: sampled(time, value, basis, name) for name, (value, basis) in values.items()}
    return RecordedFlight("circling", ("x",), "s", channels, failure=LoggedEvent(170.0, "<engine>"))


def test_the_page_says_what_holds_what_is_refused_and_why(circling: RecordedFlight) -> None:
    found = assess(circling)
    text = page(circling, found, "harness assess x")
    assert "no vane: the log has no sideslip" in text
    assert "failure: &lt;engine&gt;" in text
    assert "Beside the model" not in text
    assert "Beside the model aerosonde" in page(circling, found, "x", ModelFlight("aerosonde", 18.0, found, ""))
    assert not re.search(r"(?:src|href)=\"https?:", text)
    shown = scatter(found)
    assert shown is not None
    assert len(shown.asked) == len(found.points) > 4
    assert shown.low < 1.0 < shown.high


def test_a_track_without_a_position_is_the_velocity_summed_up(circling: RecordedFlight) -> None:
    places = track(circling)
    assert places is not None
    assert places[1][-1] > 3.0 * 170.0 - 100.0  # the wind carries it north


def test_a_recording_holds_the_lines_the_map_and_the_words(circling: RecordedFlight, tmp_path: Path) -> None:
    path = tmp_path / "flight.rrd"
    write_recording_of(path, circling, assess(circling), "harness assess x")
    assert is_sealed(path)
    entities = {chunk.entity_path for chunk in RrdReader(path).stream().filter(content="/**").to_chunks()}
    assert {"/notes/result", "/plots/00/00", "/charts/map/lines/01", "/charts/relation/lines/03"} <= entities


def test_a_flight_of_which_nothing_is_judged_has_a_page_and_a_recording_too(tmp_path: Path) -> None:
    files = tmp_path / "a.rrd", tmp_path / "a.html"
    log = EXPERIMENTS / "flights" / "lateral_121_4.csv"
    result = invoke("assess", log, "--rrd", files[0], "--out", files[1])
    assert result.exit_code == 0, result.output
    assert "Nothing of it is judged" in files[1].read_text(encoding="utf-8")
    assert is_sealed(files[0])
    assert "opens it as it is" in invoke("view", files[0], "--flight", "sixdof").stderr
