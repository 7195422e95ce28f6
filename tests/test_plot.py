"""Figures of flights and maps of runs: what they show, and `harness plot`, which writes them."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from rerun import notebook

from harness.drawing import COLOURS
from harness.error import ArgumentError
from harness.log import FlightLog
from harness.log.figure import PANELS, command_spectrum, picture
from harness.log.signals import Signals
from harness.loop import simulate
from harness.plants.plant import Outcome
from harness.runs.results import load_results
from tests.builders import FLIGHT, SIXDOF, fly_matrix, invoke, log_of, write

MATRIX = """\
[flight]
plant = "{plant}"
duration_s = 40.0
law.name = "nftsm"
[matrix]
"law.k2" = [0.5, 12.0]
"law.k3" = [0.0, 1.0, 6.0]
"""


@pytest.fixture(scope="module")
def pair() -> dict[str, FlightLog]:
    return {"on paper": simulate(FLIGHT), "in the air": simulate(SIXDOF)}


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    fly_matrix(write(folder / "matrix.toml", MATRIX.format(plant="lagged")), folder / "out")
    return folder / "out"


def test_a_figure_has_every_panel_that_a_plant_has(pair: dict[str, FlightLog]) -> None:
    assert len(picture(pair).axes) == len(PANELS)
    alone = {"on paper": pair["on paper"]}
    assert len(picture(alone).axes) == len(PANELS) - 2  # neither bank nor sideslip
    with pytest.raises(ValueError, match=r"no flight here has bank \(plant kinematic\)"):
        picture(alone, ["bank"])
    with pytest.raises(ValueError, match=r"no panel 'spectrm' - did you mean 'spectrum'\?"):
        picture(pair, ["spectrm"])


def test_the_settled_error_is_seen_beside_the_first(pair: dict[str, FlightLog]) -> None:
    (axes,) = picture(pair, ["error"]).axes
    assert axes.get_yscale() == "log"
    drawn = axes.lines[1].get_xydata()
    log = pair["in the air"]
    np.testing.assert_allclose(np.asarray(drawn)[:, 1], np.maximum(np.abs(log["range_error"]), 1e-6))
    settled = np.median(np.abs(log["range_error"][-100:]))
    low, high = axes.get_ylim()
    assert low < settled < high


def test_the_spectrum_has_a_sinusoid_at_its_own_amplitude() -> None:
    """0.8 Hz and 2 deg/s, over a whole number of periods."""
    time = np.arange(0.0, 100.0, 0.05)
    command = np.radians(-3.0 + 2.0 * np.sin(2.0 * np.pi * 0.8 * time))
    log = log_of({"time": time, "heading_rate_command": command, "range_error": np.zeros(len(time))})
    frequency, amplitude = command_spectrum(Signals(log))
    highest = int(np.argmax(amplitude))
    assert amplitude[highest] == pytest.approx(2.0, rel=0.01)
    assert frequency[highest] <= 0.8 < frequency[highest + 1]


def test_flights_are_named_and_an_early_end_is_told(pair: dict[str, FlightLog]) -> None:
    whole = pair["in the air"]
    early = replace(whole, outcome=Outcome.DEPARTED, reason="stalled", table=whole.table[:101])
    (legend,) = picture({**pair, "gusty": early}, ["track", "error"]).legends
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts[:3] == ["on paper", "in the air", "gusty (departed at 5 s)"]


@pytest.mark.parametrize(
    "seen",
    [
        ((0.1524, 1.0523, -0.2047), (0.1146, 0.7862, 0.0992), (-0.0039, -0.0481, 1.0520)),
        ((0.3673, 0.8606, -0.2279), (0.2801, 0.6726, 0.0472), (-0.0118, 0.0430, 0.9689)),
    ],
    ids=["protanopia", "deuteranopia"],
)
def test_colour_blind_eyes_tell_all_flights_apart(seen: tuple[tuple[float, ...], ...]) -> None:
    """Machado and others 2009, full severity, on linear RGB."""
    linear = np.array(
        [[c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(x)] for x in COLOURS]
    )
    eyes = linear @ np.array(seen).T
    apart = [math.dist(eyes[i], eyes[j]) for i in range(len(eyes)) for j in range(i)]
    assert min(apart) > 0.1


@pytest.mark.parametrize(("suffix", "begins"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")])
def test_flights_of_a_run_are_drawn_the_same_each_time(suffix: str, begins: bytes, out: Path, tmp_path: Path) -> None:
    keys = load_results(out)["key"][:2]
    for name in ("a", "b"):
        done = invoke("plot", *(f"{out}:{key[:8]}" for key in keys), "--save", tmp_path / f"{name}.{suffix}")
        assert done.exit_code == 0, done.output
        assert done.stdout == f"{tmp_path / name}.{suffix}: k3=0, k3=1\n"
    first, second = ((tmp_path / f"{name}.{suffix}").read_bytes() for name in ("a", "b"))
    assert first == second
    assert first.startswith(begins)


def test_a_map_has_a_number_in_each_cell_and_the_border_of_the_limit_cycle(out: Path, tmp_path: Path) -> None:
    path = tmp_path / "map.svg"
    done = invoke("plot", out, "--what", "map", "--metric", "range_error_rms_m", "--save", path)
    assert done.exit_code == 0, done.output
    assert done.stdout == f"{path}: range_error_rms_m by law.k2 and law.k3, 1 map\n"
    text = path.read_text(encoding="utf-8")
    assert text.count("#d55e00") >= 3  # between k2 = 0.5 and 12 at each k3
    assert all(f"<!-- {value} -->" in text for value in ("0.5", "12", "law.k2", "law.k3"))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["{out}", "--save", "a.png"], "holds 6 flights; choose with {out}:KEY; `harness show {out}` lists them"),
        (["{out}:zz", "--save", "a.png"], "no flight has a key that begins with 'zz'"),
        (["nothing.rrd", "--save", "a.png"], "nothing.rrd: no such file or folder"),
        (["{out}", "--save", "a.jpg"], "--save a.jpg: must end with .png, .svg or .pdf"),
        (["{out}", "--what", "map", "--what", "track", "--save", "a.png"], "--what map: is a figure of its own"),
        (["{out}", "--what", "map", "--metric", "range_eror_rms_m", "--save", "a.png"], "did you mean"),
        (["{out}", "--what", "map", "--where", "law.k2=12", "--save", "a.png"], "these vary: law.k3"),
        (["{out}", "--what", "map", "--metric", "sideslip_rms_deg", "--save", "a.png"], "no flight here has sideslip"),
        (["{out}", "--where", "law.k2=12", "--save", "a.png"], "--metric and --where require --what map"),
    ],
)
def test_bad_input_is_one_line(words: list[str], said: str, out: Path, tmp_path: Path) -> None:
    done = invoke("plot", *(str(tmp_path / word) if word.startswith("a.") else word.format(out=out) for word in words))
    assert done.exit_code == 2
    assert said.format(out=out).removeprefix("--save a.jpg: ") in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_without_the_notebook_support_of_rerun_a_notebook_shows_the_picture(pair: dict[str, FlightLog]) -> None:
    if notebook.HAS_NOTEBOOK:
        pytest.skip("it is installed here")
    one, other = pair.values()
    shown, drawn = one.show(other), one.plot(other)
    assert [axes.get_title() for axes in shown.axes] == [axes.get_title() for axes in drawn.axes]
    with pytest.raises(ArgumentError):
        one.show(*[other] * 7)


def test_with_it_a_notebook_shows_the_viewer(pair: dict[str, FlightLog]) -> None:
    pytest.importorskip("rerun_notebook")
    one, other = pair.values()
    assert isinstance(one.show(other), notebook.Viewer)
