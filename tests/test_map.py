"""A map: borders where they are, with few flights, the same on any number of workers; what is unknown is shown."""

import csv
import math
import os
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import harness
from harness.log.metric import measure
from harness.requirement import OUTCOME
from harness.search.border import Answer, BorderSearch, lines
from harness.search.dimension import dimension
from harness.search.map import Map, map_of, question
from harness.search.picture import drawn
from harness.search.space import Space
from harness.settings import load_flight, read_settings
from tests.builders import EXPERIMENTS, HERE, command, invoke, words_of, write
from tests.processes import ended, runs_of, until

BASIN = """\
question = "From where?"
[flight]
plant = "kinematic"
duration_s = {duration}
[flight.law]
name = "nftsm"
gains = "paper_1"
max_heading_rate_deg_s = 20.0
standoff_m = 60.0
[flight.start]
position_m = [-100.0, 0.0]
"""
X, Y = "start.position_m.east=-200:200", "start.heading_deg=0:360"
OVER = ("--x", X, "--y", Y)
Planted = Callable[[float, float], Answer]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return write(tmp_path / "basin.toml", BASIN.format(duration=40))


def disc(x: float, y: float, radius: float) -> Callable[[float, float], bool]:
    return lambda u, v: math.hypot(u - x, v - y) < radius


def ring(u: float, v: float) -> bool:
    return 0.2 < math.hypot(u - 0.5, v - 0.5) < 0.26


def three(u: float, v: float) -> str:
    return "ground" if u < 0.3 + 0.2 * v else "departed" if v < 0.6 else "completed"


def tongue(u: float, v: float) -> bool:
    return v < 0.2 or abs(u - 0.43 - 0.2 * (v - 0.2)) < 0.06 * (0.8 - v)


PLANTED: dict[str, Planted] = {
    "line": lambda u, v: v > 0.31 + 0.2 * u,
    "curve": lambda u, v: v > 0.5 + 0.3 * math.sin(5.0 * u),
    "closed": disc(0.52, 0.47, 0.31),
    "two islands and an edge": lambda u, v: (
        disc(0.3, 0.3, 0.15)(u, v) or disc(0.75, 0.6, 0.1)(u, v) or v > 0.93 - 0.3 * u * u
    ),
    "ring": ring,
    "three answers": three,
    "tongue": tongue,
}


def located(planted: Planted, resolution: int = 200) -> BorderSearch:
    border = BorderSearch.of(resolution)
    while asked := border.asked():
        for x, y in asked:
            border.answers[x, y] = planted(x / border.side, y / border.side)
    return border


def grid(planted: Planted, border: BorderSearch) -> np.ndarray[tuple[int, ...], np.dtype[np.object_]]:
    steps = [i / border.side for i in range(border.side + 1)]
    return np.array([[planted(u, v) for u in steps] for v in steps], dtype=object)


@pytest.mark.parametrize("name", PLANTED)
def test_a_border_is_that_of_the_full_grid_to_a_step_with_a_twentieth_of_its_flights(name: str) -> None:
    border = located(PLANTED[name])
    full, found = grid(PLANTED[name], border), border.filled()
    assert border.side >= 200
    assert len(border.answers) <= full.size / 20
    for y, x in np.argwhere(found != full):
        assert found[y, x] in full[max(0, y - 1) : y + 2, max(0, x - 1) : x + 2]


def test_every_island_as_wide_as_the_diagonal_of_a_coarse_square_is_found_and_smaller_ones_may_be_missed() -> None:
    random = np.random.default_rng(0)
    diagonal = math.sqrt(2.0) / 25
    found = {
        width: [any(located(disc(u, v, width / 2)).answers.values()) for u, v in random.uniform(0.1, 0.9, (20, 2))]
        for width in (1.01 * diagonal, 0.4 * diagonal)
    }
    wide, narrow = found.values()
    assert all(wide)
    assert not all(narrow)


def test_what_enters_a_square_through_an_edge_that_was_divided_is_followed() -> None:
    """A finger narrower than a coarse square, beside a border: no coarse point lies in it above the third row."""
    border = located(lambda u, v: v < 0.09 or (0.445 < u < 0.475 and v < 0.115) or (v < 0.1 and u > 0.4))
    assert border.filled()[round(0.105 * border.side), round(0.46 * border.side)] is True


def test_a_number_is_refined_where_it_jumps_and_not_where_it_is_smooth() -> None:
    smooth = located(lambda u, v: u + v * v)
    assert len(smooth.answers) == len(smooth.first)
    assert smooth.filled()[100, 60] == pytest.approx(0.3 + 0.25, abs=0.01)
    jump = located(lambda u, v: u + v * v + (3.0 if math.hypot(u - 0.5, v - 0.5) < 0.3 else 0.0))
    apart = [abs(math.dist(point, (100, 100)) - 60) for line in lines(jump.squares()) for point in line]
    assert max(apart) < 1.5
    assert len(jump.answers) < 1500


def test_what_is_unknown_has_a_border_of_its_own() -> None:
    border = located(lambda u, v: None if u > 0.62 else v > 0.5)
    filled = border.filled()
    assert filled[20, 190] is None
    assert filled[20, 20] is False
    assert filled[190, 20] is True


def mapped(file: Path, out: Path, *words: object, workers: int = 0) -> str:
    done = invoke("map", file, "--out", out, *OVER, "--resolution", 20, "--workers", workers, *words)
    assert done.exit_code == 0, done.output
    return done.output


@pytest.mark.parametrize("resolution", [10, 12, 25, 50])
def test_a_coarse_map_is_whole_unless_it_is_told_to_stop_earlier(file: Path, resolution: int) -> None:
    space = Space(read_settings(file), [dimension(X, "--x"), dimension(Y, "--y")])
    most = map_of(space, question("converged"), resolution=resolution).flights
    assert most <= (BorderSearch.of(resolution).side + 1) ** 2
    for name, planted in PLANTED.items():
        assert len(located(planted, resolution).answers) <= most, name


def test_a_map_is_the_same_on_any_number_of_workers_and_resumes(file: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    text = mapped(file, first, "--flights", 130)
    assert "121 flown" in text
    assert "not located; the same command with more --flights goes on" in text
    whole = mapped(file, second, workers=2)
    assert "stopped" not in whole
    total = len(harness.load_results(second))
    assert f"{total - 121} flown, 121 earlier, 0 failed" in mapped(file, first)
    for name in ("points.csv", "border.csv", "map.svg"):
        assert (first / name).read_bytes() == (second / name).read_bytes()
    with (first / "points.csv").open(newline="") as rows:
        points = list(csv.DictReader(rows))
    assert {row["flights"] for row in points} == set(harness.load_results(first)["key"])
    for words in (("show", first), ("compare", first), ("report", first)):
        assert invoke(*words).exit_code == 0
    assert 'src="data:image/svg+xml;base64,' in (first / "report.html").read_text()


def test_a_map_of_flights_agrees_with_their_full_grid(file: Path, tmp_path: Path) -> None:
    space = Space(read_settings(file), [dimension(X, "--x"), dimension(Y, "--y")])
    found = flown(map_of(space, question("converged"), resolution=20), tmp_path / "out")
    (panel,) = found.panels
    filled = panel.border.filled()
    full = {}
    for y in range(21):
        for x in range(21):
            (flight,) = space.candidate(found.values(panel, (x, y))).flights
            full[x, y] = measure(harness.simulate(flight))["convergence_time_s"] is not None
    assert 0.1 < sum(full.values()) / len(full) < 0.9
    wrong = [(x, y) for (x, y), answer in full.items() if answer is not filled[y, x]]
    assert len(wrong) <= 5
    assert all(full[at] is answer for at, answer in panel.border.answers.items())


def flown(found: Map, out: Path) -> Map:
    for _ in found.fly(out, HERE):
        pass
    return found


def test_every_plant_has_its_panel_and_the_predicted_limit_cycle_stands_where_there_is_one(tmp_path: Path) -> None:
    overrides = ['plant=["kinematic","lagged"]', "duration_s=3"]
    dimensions = [dimension("law.k2=0.5:20", "--x"), dimension("law.k3=0:10", "--y")]
    space = Space(read_settings(EXPERIMENTS / "gains.toml", overrides), dimensions)
    found = flown(map_of(space, question(OUTCOME), resolution=10), tmp_path / "out")
    assert [panel.at for panel in found.panels] == [{"plant": "kinematic"}, {"plant": "lagged"}]
    kinematic, lagged = (found.predicted(panel) for panel in found.panels)
    assert kinematic is None
    assert lagged is not None
    assert lagged[0, 0] > 1.0 > lagged[-1, -1]
    first, second = drawn(found).axes
    assert len(second.collections) == len(first.collections) + 1  # the line
    assert first.get_xscale() == "log"
    assert first.get_ylabel() == "law.k3, 1/s"


def test_the_legend_names_a_predicted_border_where_one_is_drawn() -> None:
    """With a slower actuator none is predicted, though the margins without one lie on both sides of the border."""
    legends = []
    for across in ("law.k3=0:10", "errors.actuator_lag_s=0:1"):
        overrides = ["plant=sixdof", *(["law.k3=0.5"] if "lag" in across else [])]
        space = Space(
            read_settings(EXPERIMENTS / "gains.toml", overrides),
            [dimension(across, "--x"), dimension("law.k2=0.5:20", "--y")],
        )
        found = map_of(space, question("chatters"), resolution=10)
        (margins,) = (found.predicted(panel) for panel in found.panels)
        assert margins is not None
        assert np.nanmin(margins) < 1.0 < np.nanmax(margins)
        legends.append([text.get_text() for legend in drawn(found).legends for text in legend.get_texts()])
    flown, late = legends
    assert "limit cycle, predicted" in flown
    assert "limit cycle, predicted" not in late


def test_settings_that_are_refused_are_unknown_and_not_flown(file: Path, tmp_path: Path) -> None:
    wind = ("--x", "wind.steady_mps.north=-10:10", "--y", "wind.steady_mps.east=-10:10")
    words = ("--of", "outcome", "--resolution", 10, "--workers", 0, "--set", "duration_s=1")
    done = invoke("map", file, "--out", tmp_path / "out", *wind, *words)
    assert done.exit_code == 0, done.output
    assert "4 points not flown, the settings refuse them: --y wind.steady_mps.east=-10.0: " in done.output
    assert "<!-- unknown -->" in (tmp_path / "out" / "map.svg").read_text()
    assert len(harness.load_results(tmp_path / "out")) == 121 - 4


def test_one_component_of_a_vector_is_a_key(file: Path) -> None:
    flight = load_flight(file, ["wind.steady_mps.north=1.5", "start.position_m.east=7"])
    assert flight.wind.steady == (1.5, 0.0)
    assert flight.start.position == (-100.0, 7.0)
    with pytest.raises(harness.SettingsError, match=r"wind.steady_mps has no such component"):
        load_flight(file, ["wind.steady_mps.down=1.5"])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--x", "law.k2"], "--x law.k2: must be KEY=LO:HI, as in law.k2=0.5:20"),
        (["--x", "law.k2=1:5", "--of", "chatter"], "--of 'chatter': must be converged, outcome, a metric, or"),
        (["--x", "law.k2=1:5", "--of", "limit_cycle_margin < 1"], "is known without a flight"),
        (["--x", "law.k2=1:5", "--resolution", "3"], "--resolution is 3, must be from 10 to 2000"),
        (
            ["--x", "law.k2=1:5", "--flights", "3"],
            "--flights is 3, must be 676 at least, which is the first, coarse lattice",
        ),
        (["--x", Y], f"--y {Y}: start.heading_deg is given twice"),
        (["--x", "wind.steady_mps.up=1:5"], "flight.wind.steady_mps: is { up = "),
    ],
)
def test_a_mistake_is_one_line_that_says_what_is_allowed(file: Path, words: list[str], said: str) -> None:
    done = invoke("map", file, "--out", file.parent / "out", "--y", Y, *words)
    assert done.exit_code == 2
    (line,) = done.stderr.splitlines()
    assert said in line
    assert not (file.parent / "out").exists()


def test_ctrl_c_keeps_what_was_flown_and_the_same_command_goes_on(tmp_path: Path) -> None:
    file, out = write(tmp_path / "long.toml", BASIN.format(duration=150)), tmp_path / "out"
    words = words_of("map", file, "--out", out, *OVER, "--resolution", 10, "--workers", 2)
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    until(lambda: runs_of(out), process)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to every process
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 130, errors
    assert ended(process.pid, within=1.0)
    assert errors.splitlines()[-1] == "interrupted"
    kept = len(runs_of(out))
    assert 0 < kept < 121
    done = command("map", file, "--out", out, *OVER, "--resolution", 10, "--workers", 2)
    assert f" flown, {kept} earlier, 0 failed" in done.stdout
