"""The Python interface: the names that a notebook uses, what they return, and what they say of a mistake."""

import inspect
import json
import math
import pkgutil
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

import aircraft
import harness
from harness.key import flight_key
from harness.log import COLUMNS
from harness.log.metric import measure
from harness.loop import simulate
from tests.builders import DOCS, EXPERIMENTS, FLIGHT, ROOT, SIXDOF, command, python, result_matrix, shifted, write

MATRIX = """\
[flight]
plant = "kinematic"
duration_s = 20.0
law = { name = "nftsm", gains = "paper_1" }
[matrix]
plant = ["kinematic", "lagged"]
"start.heading_deg" = [20.0, 30.0, 40.0]
"""


@pytest.fixture(scope="module")
def log() -> harness.FlightLog:
    return harness.simulate(SIXDOF)


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    harness.run(write(folder / "matrix.toml", MATRIX), folder / "out", workers=0)
    return folder / "out"


# Names


def test_the_contract_names_are_public() -> None:
    assert {
        "Flight", "law", "Target", "Wind", "load_flight", "simulate", "metrics", "run", "load_results", "compare",
        "read_flight", "record", "FlightLog", "Comparison",
        "HarnessError", "SettingsError", "StoreError", "CompareError", "PlantError",
    } <= set(harness.__all__)  # fmt: skip


@pytest.mark.parametrize("name", harness.__all__)
def test_every_public_name_is_found_listed_and_documented(name: str) -> None:
    value = getattr(harness, name)
    assert name in dir(harness)
    assert value.__name__ == name
    assert inspect.getdoc(value)


def test_the_reference_page_documents_every_public_name() -> None:
    page = (DOCS / "reference" / "python.md").read_text(encoding="utf-8")
    documented = re.findall(r"\.\. auto(?:class|function|exception):: (\w+)", page)
    assert sorted(documented) == sorted(harness.__all__)


def test_no_module_bears_the_name_of_a_public_name() -> None:
    assert not {module.name for module in pkgutil.iter_modules(harness.__path__)} & set(harness.__all__)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = harness.simulat  # type: ignore[attr-defined]


def test_importing_the_harness_loads_no_library() -> None:
    done = python(
        "import sys, harness; known = dir(harness)\n"
        "print(*sorted({name.partition('.')[0] for name in sys.modules} - set(sys.stdlib_module_names)))"
    )
    loaded = set(done.stdout.split()) - {"__main__", "__mp_main__", "sitecustomize", "usercustomize"}
    assert not {name for name in loaded if not name.startswith(("_", "harness"))}, done.stdout


def test_a_kinematic_flight_loads_neither_pandas_nor_jsbsim_nor_matplotlib() -> None:
    done = python(
        "import sys, harness\n"
        "harness.simulate(harness.Flight(plant='kinematic', law=harness.law('nftsm', 'paper_1'), duration=5.0))\n"
        "print({'pandas', 'jsbsim', 'matplotlib', 'rerun', 'scipy'} & set(sys.modules))"
    )
    assert done.stdout == "set()\n", done.stderr


def test_errors_share_a_base_and_those_of_values_are_value_errors() -> None:
    errors = [getattr(harness, name) for name in harness.__all__ if name.endswith("Error")]
    assert all(issubclass(error, harness.HarnessError) for error in errors)
    for error in (harness.SettingsError, harness.CompareError, harness.PlantError, harness.TrackError):
        assert issubclass(error, ValueError)


def test_the_interface_is_typed(tmp_path: Path) -> None:
    text = (
        "from pathlib import Path\n"
        "import harness\n"
        "flight = harness.load_flight('a.toml')\n"
        "log = harness.simulate(harness.Flight(plant='kinematic', law=harness.law('smc'), wind=harness.Wind()))\n"
        "reveal_type(flight)\n"
        "reveal_type(log)\n"
        "reveal_type(log.frame())\n"
        "reveal_type(log.metrics)\n"
        "reveal_type(log.plot())\n"
        "reveal_type(harness.metrics(log))\n"
        "reveal_type(harness.run(Path('a.toml'), 'out'))\n"
        "reveal_type(harness.load_results('out'))\n"
        "reveal_type(harness.compare('out').differences)\n"
        "reveal_type(harness.read_flight('a.rrd'))\n"
        "harness.simulate('no flight')\n"
    )
    file = write(tmp_path / "notebook.py", text)
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(ROOT / ".mypy_cache"), str(file)],
        capture_output=True, text=True, check=False, cwd=ROOT,
    )  # fmt: skip
    lines = [line.partition(": ")[2] for line in done.stdout.splitlines()]
    revealed = [line.rpartition("is ")[2].strip('"') for line in lines if line.startswith("note: Revealed")]
    assert [kind.rpartition(".")[2].rstrip("]") if "[" not in kind else kind for kind in revealed] == [
        "Flight", "FlightLog", "DataFrame", "dict[str, float | bool | None]", "Figure",
        "dict[str, float | bool | None]", "DataFrame", "DataFrame", "DataFrame", "DataFrame",
    ], done.stdout  # fmt: skip
    assert [line for line in lines if line.startswith("error")] == [
        'error: Argument 1 to "simulate" has incompatible type "str"; expected "Flight"  [arg-type]'
    ]


# Flights


def test_a_flight_made_in_python_is_the_one_that_a_file_describes() -> None:
    made = harness.Flight(plant="sixdof", law=harness.law("nftsm", "paper_1"))
    assert harness.load_flight(EXPERIMENTS / "stationary.toml") == made
    assert harness.load_flight(str(EXPERIMENTS / "stationary.toml"), ["plant=lagged"]) == replace(made, plant="lagged")


def test_a_flight_of_the_interface_is_the_one_of_the_command_line() -> None:
    done = command("fly", EXPERIMENTS / "stationary.toml", "--set", "plant=kinematic", "--json")
    row = json.loads(done.stdout)
    log = harness.simulate(harness.load_flight(EXPERIMENTS / "stationary.toml", ["plant=kinematic"]))
    assert (log.digest, log.metrics) == (row["digest"], row["metrics"])


def test_whole_numbers_and_floats_are_the_same_flight() -> None:
    whole = replace(FLIGHT, duration=20, start=harness.Start(heading=0, position=(-200, 200)))
    floats = replace(FLIGHT, duration=20.0, start=harness.Start(heading=0.0, position=(-200.0, 200.0)))
    assert flight_key(whole) == flight_key(floats)
    assert harness.simulate(whole).digest == harness.simulate(floats).digest


@pytest.mark.parametrize(
    ("flight", "message"),
    [
        (replace(FLIGHT, plant="kinematc"), r"flight.plant: is \"kinematc\".*did you mean 'kinematic'"),
        (replace(FLIGHT, duration=-1.0), "flight.duration_s: is -1.0, must be a number > 0"),
        (replace(FLIGHT, start=harness.Start(airspeed=0.0)), "flight.start.airspeed_mps: is 0.0, must be a number >="),
        (replace(FLIGHT, aircraft="aerosond"), "flight.aircraft: is .aerosond..*did you mean 'aerosonde'"),
        (replace(FLIGHT, law=harness.law("nftsm", "paper_1", k2=-1.0)), "flight.law.k2: is -1.0, must be a number > 0"),
        (replace(FLIGHT, law="nftsm"), "flight.law: is 'nftsm', must be a law"),  # type: ignore[arg-type]
        (replace(FLIGHT, wind=(3.0, 0.0)), r"flight.wind: is \(3.0, 0.0\), must be a harness.Wind"),  # type: ignore[arg-type]
        (replace(FLIGHT, guidance_period=1e-320), "flight.guidance_period_s: .* is not a whole multiple"),
        (replace(FLIGHT, guidance_period=0.0512), "flight.guidance_period_s: 0.0512 s is not a whole multiple"),
        ("stationary.toml", "must be a harness.Flight"),
    ],
)
def test_a_flight_that_cannot_be_flown_says_what_is_allowed(flight: harness.Flight, message: str) -> None:
    with pytest.raises(harness.SettingsError, match=message):
        harness.simulate(flight)


def test_all_mistakes_of_a_flight_are_told_at_once() -> None:
    with pytest.raises(harness.SettingsError) as raised:
        harness.simulate(replace(FLIGHT, duration=-1.0, seed=-1, start=harness.Start(airspeed=0.0)))
    assert len(raised.value.lines) == 3


NO_LOG: Any = "log"  # a type checker would refuse it: this is for those who have none


class Straight:
    """A law of one's own, without a name in `LAWS`."""

    standoff, max_heading_rate, command = 200.0, 0.1, "heading_rate"

    def start(self) -> Callable[[harness.Observation], harness.Guidance]:
        return lambda observation: harness.Guidance(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    def broken_conditions(self, speed_ratio: float) -> list[str]:
        return []


def test_a_law_of_ones_own_is_flown_but_not_recorded_without_a_name(tmp_path: Path) -> None:
    log = harness.simulate(replace(FLIGHT, law=Straight()))  # type: ignore[arg-type]
    assert np.ptp(log["heading"]) == 0.0
    with pytest.raises(harness.SettingsError, match=r"flight\.law: Straight has no name in autopilot/laws\.py"):
        harness.record(log, tmp_path / "a.rrd")


def test_an_airframe_and_a_track_may_be_paths(tmp_path: Path) -> None:
    track = write(tmp_path / "track.csv", "time_s,north_m,east_m\n0,0,0\n10,5,0\n20,10,0\n30,15,0\n")
    folder = aircraft.folder("aerosonde")
    by_text = replace(FLIGHT, aircraft=str(folder), target=harness.Target(track=str(track)))
    by_path = replace(FLIGHT, aircraft=folder, target=harness.Target(track=track))  # type: ignore[arg-type]
    log = harness.simulate(by_path)
    assert log.flight == by_text
    assert log.digest == harness.simulate(by_text).digest


@pytest.mark.parametrize(
    "call",
    [
        lambda log, out: harness.law("nfstm"),
        lambda log, out: harness.load_flight(out / "none.toml"),
        lambda log, out: harness.simulate(replace(FLIGHT, plant="plane")),
        lambda log, out: harness.simulate(replace(SIXDOF, start=harness.Start(airspeed=5.0))),
        lambda log, out: log.plot(panels=["range"]),
        lambda log, out: harness.record(log, out / "none" / "flight.rrd"),
        lambda log, out: harness.record({}, out / "flight.rrd"),
        lambda log, out: harness.record(NO_LOG, out / "flight.rrd"),
        lambda log, out: harness.read_flight(out / "none.rrd"),
        lambda log, out: harness.read_flight(out / "journal.sqlite"),
        lambda log, out: harness.run(out / "none.toml", out),
        lambda log, out: harness.run(EXPERIMENTS / "stationary.toml", out, workers=-1),
        lambda log, out: harness.run(EXPERIMENTS / "stationary.toml", out / "journal.sqlite", workers=0),
        lambda log, out: harness.load_results(out / "none"),
        lambda log, out: harness.compare(out / "none"),
        lambda log, out: harness.compare(out, by="wind"),
    ],
)
def test_whatever_is_wrong_with_a_value_is_a_harness_error_of_one_sentence(
    call: Callable[[harness.FlightLog, Path], object], log: harness.FlightLog, out: Path
) -> None:
    with pytest.raises(harness.HarnessError) as raised:
        call(log, out)
    assert len(str(raised.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: harness.law("nfstm"), "no law is called 'nfstm': there is nftsm, .*did you mean 'nftsm'"),
        (lambda: harness.law("nftsm", "papr"), "no gain set of nftsm is called 'papr': .*did you mean 'paper'"),
        (lambda: harness.law("nftsm", alpha_2=1.0), "no parameter of nftsm is called 'alpha_2': .*mean 'alpha2'"),
    ],
)
def test_a_law_that_there_is_not_is_answered_with_those_there_are(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()


# Logs


def test_a_log_shows_itself_in_one_line(log: harness.FlightLog) -> None:
    assert repr(log) == "<FlightLog: 20 s of Nftsm on sixdof, ultra_stick_25e, completed, 401 rows>"
    assert repr(replace(log, table=log.table[:0])) == "<FlightLog: Nftsm on sixdof, ultra_stick_25e, completed, 0 rows>"


def test_the_frame_has_every_column_and_is_a_copy(log: harness.FlightLog) -> None:
    frame = log.frame()
    assert tuple(frame.columns) == COLUMNS
    assert frame.shape == log.table.shape
    assert frame.to_numpy().tobytes() == log.table.tobytes()
    frame["north"] = 0.0
    assert log["north"].any()


def test_a_column_that_there_is_not_is_answered_with_the_nearest(log: harness.FlightLog) -> None:
    with pytest.raises(KeyError, match=r"no column 'heading_rat' - did you mean 'heading_rate'\?; the columns"):
        log["heading_rat"]


def test_the_metrics_of_a_log_are_those_of_the_function(log: harness.FlightLog) -> None:
    assert log.metrics == measure(log) == harness.metrics(log)


def test_the_picture_shows_the_track_with_equal_scales_the_circle_and_units(log: harness.FlightLog) -> None:
    figure = log.plot()
    assert isinstance(figure, Figure)
    ground, spectrum, *over_time = figure.axes
    assert spectrum.get_xlabel() == "Hz"
    assert ground.get_aspect() == 1.0
    assert (ground.get_xlabel(), ground.get_ylabel()) == ("east, m", "north, m")
    labels = ground.get_legend_handles_labels()[1]
    assert labels == ["sixdof", "start", "target", "standoff circle, 200 m"]
    track, circle = ground.lines[0], ground.lines[-1]
    np.testing.assert_array_equal(track.get_xydata(), np.column_stack([log["east"], log["north"]]))
    distance = np.hypot(*(np.asarray(circle.get_xydata()) - (10.0, 10.0)).T)
    np.testing.assert_allclose(distance, 200.0)
    assert [axes.get_title("left").partition(" (")[0] for axes in over_time] == [
        "|range error|, m", "heading rate, deg/s", "bank, deg", "sideslip, deg",
    ]  # fmt: skip
    assert over_time[-1].get_xlabel() == "time, s"


def test_a_picture_of_two_flights_names_both_and_shows_itself_in_a_notebook(log: harness.FlightLog) -> None:
    figure = harness.simulate(FLIGHT).plot(log)
    assert figure.axes[0].get_legend_handles_labels()[1][:2] == ["kinematic", "sixdof"]
    assert figure._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]


def test_more_flights_than_colours_are_refused(log: harness.FlightLog) -> None:
    with pytest.raises(ValueError, match="7 flights: must be at most 6"):
        log.plot(*[log] * 6)


# Recordings


@pytest.mark.parametrize("kind", [str, Path])
def test_a_recording_gives_back_the_frame_to_the_last_bit(
    kind: Callable[[Path], str | Path], log: harness.FlightLog, tmp_path: Path
) -> None:
    path = harness.record(log, kind(tmp_path / "a.rrd"))
    assert path == tmp_path / "a.rrd"
    pd.testing.assert_frame_equal(harness.read_flight(kind(path)), log.frame(), check_exact=True)


def test_a_recording_of_several_flights_is_read_by_name(log: harness.FlightLog, tmp_path: Path) -> None:
    kinematic = harness.simulate(FLIGHT)
    path = harness.record({"simple": kinematic, "whole": log}, tmp_path / "a.rrd", title="A pair")
    pd.testing.assert_frame_equal(harness.read_flight(path, "simple"), kinematic.frame(), check_exact=True)
    with pytest.raises(ValueError, match="no flight 'sixdof' It holds simple, whole"):
        harness.read_flight(path, "sixdof")


# Runs


def test_a_run_returns_its_results_and_goes_on_where_it_was_stopped(tmp_path: Path) -> None:
    file = write(tmp_path / "matrix.toml", MATRIX)
    first = harness.run(str(file), str(tmp_path / "out"), workers=0, limit=2)
    every = harness.run(file, tmp_path / "out", workers=0, log="none")
    assert (len(first), len(every)) == (2, 6)
    assert (first["seconds"].to_numpy() == every["seconds"][:2].to_numpy()).all()  # not flown again
    pd.testing.assert_frame_equal(every, harness.load_results(tmp_path / "out"))
    assert len(list((tmp_path / "out" / "flights").iterdir())) == 2


def test_an_interrupted_run_keeps_its_flights(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    flights: list[harness.Flight] = []

    def interrupted(flight: harness.Flight, watch: object) -> harness.FlightLog:
        if len(flights) == 2:
            raise KeyboardInterrupt
        flights.append(flight)
        return simulate(flight)

    monkeypatch.setattr("harness.runs.row.simulate", interrupted)
    file = write(tmp_path / "matrix.toml", MATRIX)
    with pytest.raises(KeyboardInterrupt):
        harness.run(file, tmp_path / "out", workers=0)
    assert len(harness.load_results(tmp_path / "out")) == 2


def test_a_script_that_starts_workers_unguarded_is_told_how_to_guard_them(tmp_path: Path) -> None:
    file = write(tmp_path / "matrix.toml", MATRIX)
    script = write(
        tmp_path / "script.py", f"import harness\nharness.run({str(file)!r}, {str(tmp_path / 'out')!r}, workers=1)"
    )
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 1
    assert 'a Python script must call harness.run under `if __name__ == "__main__":`' in done.stderr.splitlines()[-1]


def test_progress_is_printed_when_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = write(tmp_path / "matrix.toml", MATRIX)
    harness.run(file, tmp_path / "silent", workers=0)
    assert capsys.readouterr() == ("", "")
    harness.run(file, tmp_path / "out", workers=0, progress=True)
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "6 of 6 flights done, 0 failed" in shown.err


def test_a_run_of_a_wrong_file_flies_nothing(tmp_path: Path) -> None:
    file = write(tmp_path / "matrix.toml", MATRIX.replace("lagged", "laged"))
    with pytest.raises(harness.SettingsError, match=r"matrix.toml:6: .*did you mean 'lagged'"):
        harness.run(file, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_an_option_of_a_run_that_there_is_not_says_what_is_allowed(tmp_path: Path) -> None:
    file = write(tmp_path / "matrix.toml", MATRIX)
    with pytest.raises(ValueError, match="log is 'every', must be None or one of all, sample, failed, none"):
        harness.run(file, tmp_path / "out", log="every")
    with pytest.raises(ValueError, match="workers is -1, must be None or at least 0"):
        harness.run(file, tmp_path / "out", workers=-1)
    with pytest.raises(ValueError, match="limit is 0, must be None or at least 1"):
        harness.run(file, tmp_path / "out", limit=0)
    with pytest.raises(ValueError, match="timeout is 0, must be None or above 0 s"):
        harness.run(file, tmp_path / "out", timeout=0.0)
    assert not (tmp_path / "out").exists()


def test_a_directory_without_results_is_a_store_error(tmp_path: Path) -> None:
    for read in (harness.load_results, harness.compare):
        with pytest.raises(harness.StoreError, match="holds no results"):
            read(str(tmp_path))


# Comparisons


def test_a_directory_and_its_table_give_the_same_comparison(out: Path) -> None:
    from_directory, from_table = harness.compare(str(out)), harness.compare(harness.load_results(out))
    assert from_directory.answer == from_table.answer
    pd.testing.assert_frame_equal(from_directory.differences, from_table.differences)
    pd.testing.assert_frame_equal(from_directory.conditions, from_table.conditions)


def test_a_comparison_has_the_columns_of_the_contract() -> None:
    flights = shifted(result_matrix({"wind.turbulence": ["none", "light"]}), "sideslip_rms_deg", 5.0)
    comparison = harness.compare(flights)
    assert {"metric", "value", "pairs", "seeds", "difference", "low", "high", "verdict"} <= set(comparison.differences)
    assert {"metric", "value", "condition"} <= set(comparison.conditions)
    slipping = comparison.differences.query("metric == 'sideslip_rms_deg'")
    assert set(slipping["verdict"]) == {"fails"}
    assert (slipping["low"] <= slipping["difference"]).all()
    assert "sideslip" in comparison.answer
    assert set(comparison.differences["verdict"]) <= {"holds", "fails", "undecided", "lower", "higher"}


def test_only_the_flights_that_are_asked_for_are_compared() -> None:
    flights = result_matrix({"wind.turbulence": ["none", "light"], "wind.steady_mps": [(0.0, 0.0), (3.0, 0.0)]})
    every = harness.compare(flights).differences["pairs"].sum()
    half = harness.compare(flights, where={"wind.turbulence": "none"}).differences["pairs"].sum()
    quarter = harness.compare(flights, where={"wind.turbulence": "light", "wind.steady_mps": [3.0, 0.0]})
    assert (every, every) == (2 * half, 4 * quarter.differences["pairs"].sum())


def test_flights_of_two_tables_can_be_compared_though_their_rows_have_the_same_numbers() -> None:
    flights = shifted(result_matrix(), "range_error_rms_m", 5.0)
    parts = [flights[flights["plant"] == plant].reset_index(drop=True) for plant in ("sixdof", "kinematic")]
    pd.testing.assert_frame_equal(harness.compare(pd.concat(parts)).differences, harness.compare(flights).differences)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"by": "plnt"}, "by: no setting is called 'plnt' - did you mean 'plant'"),
        ({"by": "range_error_rms_m"}, "by: no setting is called 'range_error_rms_m'"),
        ({"where": {"law.gain": "paper"}}, "where: no setting is called 'law.gain' - did you mean 'law.gains'"),
        ({"where": {"law.gains": "papr"}}, "where: no flight has law.gains = .papr. - did you mean 'paper'.*there is"),
        ({"baseline": "kinematc"}, "there is kinematic, sixdof"),
    ],
)
def test_a_wrong_key_or_value_is_answered_with_what_there_is(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(harness.CompareError, match=message):
        harness.compare(result_matrix(), **arguments)  # type: ignore[arg-type]


def test_a_table_that_is_none_of_results_says_which_columns_are_missing() -> None:
    with pytest.raises(harness.CompareError, match=r"no column key, outcome.* has north, east"):
        harness.compare(pd.DataFrame({"north": [0.0], "east": [0.0]}))


def test_margins_may_be_given() -> None:
    flights = shifted(result_matrix(), "sideslip_rms_deg", 5.0)
    wide = harness.compare(flights, assess=harness.Assess(sideslip=math.radians(20.0))).differences
    assert set(wide.query("metric == 'sideslip_rms_deg'")["verdict"]) == {"holds"}


def test_the_docstring_of_a_log_names_every_column() -> None:
    assert harness.FlightLog.__doc__
    named = set(re.findall(r"`(\w+)`", harness.FlightLog.__doc__))
    assert set(COLUMNS) <= named
    assert named - set(COLUMNS) == {"flight", "law_NAME", "outcome", "reason", "table"}
