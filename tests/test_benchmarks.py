"""The benchmarks run: each on the least that it measures, with its numbers printed."""

import math
import re
from functools import partial
from pathlib import Path

import pytest

from benchmarks import (
    compiled,
    flight_speed,
    guided_falsify,
    help_speed,
    long_logs,
    maps,
    peer_flights,
    peers,
    performance,
    planted_failures,
    planted_peers,
    recipes,
    recording_speed,
    runs,
)
from tests.builders import drawing


def lines(capsys: pytest.CaptureFixture[str]) -> list[str]:
    return capsys.readouterr().out.splitlines()


def medians(line: str) -> list[float]:
    """The medians of a line, each printed before its range."""
    return [float(found) for found in re.findall(r"([\d.]+)(?: ms)? \([\d.]+ to ", line)]


def test_a_flight_costs_at_least_its_bare_loop(capsys: pytest.CaptureFixture[str]) -> None:
    flight_speed.main(pairs=1, duration=20)
    _, *airframes, kinematic = lines(capsys)
    assert len(airframes) == 2 * len(flight_speed.AIRFRAMES)
    for flight in airframes[::2]:
        ratio, seconds = medians(flight)
        assert ratio > 0.8  # that of a loop which does nothing else, but for the clock
        assert seconds > 0.0
    assert all(medians(line) for line in airframes[1::2])
    assert medians(kinematic)


def test_the_help_imports_nothing_heavy(capsys: pytest.CaptureFixture[str]) -> None:
    help_speed.main(starts=1)
    help_, bare, imports = lines(capsys)
    assert medians(help_) > medians(bare)
    assert imports.endswith("it imports none")


def test_many_flights_are_timed_with_one_worker_and_two(capsys: pytest.CaptureFixture[str]) -> None:
    runs.main(pairs=1, rows=50, duration=10)
    kinematic, sixdof, cost, resumed = lines(capsys)
    assert medians(kinematic)[0] > 0.0
    assert medians(sixdof)[0] > 0.0
    assert medians(cost)
    assert resumed.startswith("50 rows: ")


def test_maps_are_held_against_full_grids_and_a_quadtree(capsys: pytest.CaptureFixture[str]) -> None:
    maps.main(trials=1)
    rows = [line.split(" | ") for line in lines(capsys) if line.startswith("| ")]
    planted = rows[1 : 1 + len(maps.PLANTED)]
    for _, flights, share, quadtree, _, off in planted:
        assert int(flights) < int(quadtree)
        assert share.startswith("1/")
        assert off == "0.00 % |"
    assert rows[len(planted) + 2][0] == "| 0.06"
    assert rows[len(planted) + 2][1] == "100 %"


@drawing
def test_recordings_are_timed_until_they_are_drawn(capsys: pytest.CaptureFixture[str]) -> None:
    recording_speed.main(times=1, duration=5)
    written, drawn = lines(capsys)
    assert medians(written)[0] > 0.0
    assert medians(drawn)[0] > 0.0


def test_compiled_flights_are_timed_beside_those_of_python(capsys: pytest.CaptureFixture[str]) -> None:
    compiled.main(pairs=1, seeds=2)
    *table, matrix, first = lines(capsys)
    for what in ("| a flight |", "| a flight with its metrics |"):
        (line,) = (line for line in table if line.startswith(what))
        assert len(medians(line)) == len(compiled.PLANTS)
    assert " times as fast" in matrix
    assert "The first compiled flight of a process" in first


def test_the_page_of_other_searches_tells_the_median_and_how_many_found_it() -> None:
    results = [
        (search, planted_failures.Cell("bowl", dimensions, share, [20.0, 30.0, 40.0]))
        for search in planted_peers.SEARCHES
        for dimensions in planted_peers.DIMENSIONS
        for share in planted_failures.SHARES
    ]
    text = "\n".join(planted_peers.page(results))
    assert text.count("| bowl | 4 | 30 (3) | 30 (3) | 30 (3) | 30 (3) |") == len(planted_failures.SHARES)
    assert "- CMA-ES: 18 of 18 searches found it; the median took 30." in text


def test_the_page_of_other_simulators_times_those_that_are_here_and_names_the_others(tmp_path: Path) -> None:
    page = tmp_path / "other_simulators.md"
    names = [name for name in peer_flights.SIMULATORS if name != peer_flights.ADOPTED]  # which takes a minute
    peers.main(rounds=1, seconds=5, names=names, path=page)
    table, missing = page.read_text(encoding="utf-8").split("## Not measured")
    for name in names:
        of = peer_flights.SIMULATORS[name]
        rows = [line for line in table.splitlines() if line.startswith(f"| {name} |")]
        if not of.requires:
            assert len(rows) == 1, name
        assert bool(rows) != (f"- {of.package}: ModuleNotFoundError: No module named " in missing)
    (_, ratio) = medians(next(line for line in table.splitlines() if line.startswith("| this harness |")))
    assert ratio > 0.8


def test_a_flight_that_fell_from_the_sky_is_not_timed() -> None:
    for end in (peer_flights.End(4.0, 100.0, 0.0), peer_flights.End(5.0, 0.0, 0.0), peer_flights.End(5.0, 100.0, 3.1)):
        with pytest.raises(RuntimeError, match="flew"):
            peer_flights.flown(partial(peer_flights.End, *end), 5.0)


def test_why_a_simulator_is_missing_tells_no_place_of_this_machine() -> None:
    told = peers.plain("OSError: /some/place/libmodel.so: cannot open, see https://some.host/page\nmore")
    assert told == "OSError: libmodel.so: cannot open, see "


def test_the_page_of_what_a_flight_costs_has_every_case_and_part(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    performance.main(pairs=1, duration=20, path=tmp_path / "performance.md", models=["c172p"])
    text = (tmp_path / "performance.md").read_text(encoding="utf-8")
    for case in performance.cases(20.0):
        compiled_, python, _ = medians(next(line for line in text.splitlines() if line.startswith(f"| {case} |")))
        assert min(compiled_, python) > 0.8
    (step,) = re.findall(r"JSBSim, a step of 5 ms \| ([\d.]+) \|", text)
    assert float(step) > 0.0
    assert "with SciPy's inverse, which moves no bit" in text
    assert re.search(r"a command takes [\d.]+ µs, in Python [\d.]+\.", text)
    assert len(lines(capsys)) == len(performance.cases(20.0)) + 1


def test_a_long_log_of_each_format_is_read(capsys: pytest.CaptureFixture[str]) -> None:
    long_logs.main([2.0])
    _, _, *rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines(capsys)]
    assert [row[:2] for row in rows] == [[kind, "2"] for kind in long_logs.WRITERS]
    assert all(float(minutes) > 1.0 and float(memory) > 50.0 for _, _, minutes, memory, _ in rows)


def test_a_search_with_a_guide_is_told_beside_one_without() -> None:
    _, _, first = guided_falsify.searched("gains", 8.0, False, 0, 8)
    assert 1 <= first <= 8
    flights = [guided_falsify.Needed("gains", how, [of]) for how, of in (("", first), ("guide", 2.0))]
    functions = [guided_falsify.Needed("bowl", how, [3.0, math.inf]) for how in ("", "another function")]
    text = "\n".join(guided_falsify.page(flights, functions, {"gains": 8.0}, (0.5, 0.01)))
    row = f"| the gains, by the activity of the command | `command_activity_deg_s2 < 8` | {first} ({first}) | 2 (2) |"
    assert row in text
    assert "the 64 trials cost as much as 32 flights on `sixdof`, compiled as much as 0.64." in text
    assert f"| bowl | 3 (> {guided_falsify.MOST}) | 3 (> {guided_falsify.MOST}) |" in text


@pytest.mark.parametrize("heading", ["On SLURM", "On Kubernetes"])
def test_the_recipes_of_the_guide_to_many_machines_are_python(heading: str) -> None:
    code = recipes.recipe(heading)
    compile(code, heading, "exec")
    assert code.endswith('")\n')
