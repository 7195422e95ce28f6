"""The border between a settings file and a flight."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopilot.laws import LAWS, law
from autopilot.smc import Smc
from harness.feasibility import feasibility_margin, warnings
from harness.flight import Flight
from harness.plants.plant import Start
from harness.runs.matrix import read_matrix
from harness.settings import (
    SettingsError,
    document,
    file_key,
    flight_from_document,
    load_flight,
    put,
    read_settings,
)
from harness.world.target import Segment
from tests.builders import EXPERIMENTS, copied_airframe, python

STATIONARY = EXPERIMENTS / "stationary.toml"
SHORTEST = '[flight]\nplant = "kinematic"\n[flight.law]\nname = "nftsm"\n'


Write = Callable[[str | bytes], Path]


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Write:
    """Writes `a.toml` in the working folder."""
    monkeypatch.chdir(tmp_path)

    def written(text: str | bytes) -> Path:
        Path("a.toml").write_bytes(text if isinstance(text, bytes) else text.encode())
        return Path("a.toml")

    return written


def mistakes(path: Path, *overrides: str) -> list[str]:
    with pytest.raises(SettingsError) as caught:
        load_flight(path, overrides)
    assert str(caught.value) == "\n".join(caught.value.lines)
    return caught.value.lines


def test_the_stationary_experiment_is_table_1_with_the_gains_of_nftsm_1() -> None:
    assert load_flight(STATIONARY) == Flight(plant="sixdof", law=law("nftsm", "paper_1"))
    assert read_settings(STATIONARY).experiment().title == "Stationary target"


def test_the_stationary_experiment_shows_every_key_that_a_file_may_set() -> None:
    text = STATIONARY.read_text()
    settings = document(load_flight(STATIONARY))
    gains = LAWS["nftsm"].gain_sets["paper"]
    tables = [settings, *(table for table in settings.values() if isinstance(table, dict))]
    assert [key for table in tables for key in table if key not in gains and key not in text] == []


def test_what_a_file_leaves_out_has_the_dataclass_default(write: Write) -> None:
    assert load_flight(write(SHORTEST)) == Flight(plant="kinematic", law=law("nftsm"))


def test_degrees_become_radians_and_only_there(write: Write) -> None:
    text = SHORTEST + "max_heading_rate_deg_s = 10\n[flight.start]\nheading_deg = -90\nposition_m = [1, 2.5]\n"
    flight = load_flight(
        write(text + "[flight.target]\nsegments = [{ from_s = 1, to_s = 2, turn_rate_deg_s = 180 }]\n")
    )
    assert flight.law.max_heading_rate == math.radians(10.0)
    assert flight.start == Start(heading=-math.pi / 2, position=(1.0, 2.5))
    assert flight.target.segments == (Segment(from_=1.0, to=2.0, turn_rate=math.pi),)


def test_single_gains_override_the_named_set(write: Write) -> None:
    flight = load_flight(write(SHORTEST + 'gains = "paper_1"\nbeta2 = 1\n'))
    assert flight.law == law("nftsm", "paper_1", beta2=1.0)


@pytest.mark.parametrize(
    "override", ["start.heading_deg=130", "flight.start.heading_deg=130.0", " start.heading_deg = 130 "]
)
def test_an_override_replaces_what_the_file_says(override: str) -> None:
    assert load_flight(STATIONARY, [override]).start.heading == math.radians(130.0)


def test_an_override_that_is_no_toml_is_a_string() -> None:
    assert load_flight(STATIONARY, ["plant=kinematic", "law.gains=paper"]).law == law("nftsm", "paper")


@given(st.floats(min_value=-1e9, max_value=1e9), st.floats(min_value=1e-6, max_value=999.0))
def test_a_flight_is_written_and_read_back_to_the_last_bit(heading: float, limit: float) -> None:
    flight = flight_from_document(
        {
            "plant": "kinematic",
            "start": {"heading_deg": heading},
            "law": {"name": "smc", "max_heading_rate_deg_s": limit, "c1": 0.3},
            "target": {"segments": [{"from_s": 0, "to_s": limit, "turn_rate_deg_s": -limit}]},
        }
    )
    assert flight_from_document(json.loads(json.dumps(document(flight), allow_nan=False))) == flight


@given(st.integers(-36000, 36000))
def test_a_heading_is_written_as_it_was_typed(hundredths: int) -> None:
    heading = hundredths / 100
    start = {"heading_deg": heading}
    flight = flight_from_document({"plant": "kinematic", "law": {"name": "smc"}, "start": start})
    assert document(flight)["start"]["heading_deg"] == heading


def test_a_flight_made_in_python_needs_no_named_set() -> None:
    value = Smc(c1=0.1, c2=0.2, c3=0.3, epsilon=0.4)
    flight = Flight(plant="kinematic", law=value)
    assert document(flight)["law"]["gains"] == "custom"
    assert flight_from_document(document(flight)) == flight


@pytest.mark.parametrize("infinite", ["inf", '"inf"'])
def test_the_heading_rate_limit_may_be_infinite(write: Write, infinite: str) -> None:
    flight = load_flight(write(f"{SHORTEST}max_heading_rate_deg_s = {infinite}\n"))
    assert flight.law.max_heading_rate == math.inf
    assert document(flight)["law"]["max_heading_rate_deg_s"] == "inf"
    assert flight_from_document(document(flight)) == flight


def test_an_unknown_key_names_its_line_and_the_nearest_key(write: Write) -> None:
    (line,) = mistakes(write(f"{SHORTEST}standoff = 200.0\n"))
    assert line.startswith("a.toml:5: flight.law.standoff: unknown key, known here: airspeed, alpha2, ")
    assert line.endswith(" - did you mean 'standoff_m'?")


@pytest.mark.parametrize(
    ("law_line", "wrong"),
    [
        ('alpha2 = "0.5"', 'alpha2: is "0.5", must be a number >= 0'),
        ("alpha2 = true", "alpha2: is true, must be a number >= 0"),
        ("beta3 = 1.5", "beta3: is 1.5, must be a number > 0 and < 1"),
        ("max_heading_rate_deg_s = nan", "max_heading_rate_deg_s: is nan, must be a number > 0 or inf"),
        ("standoff_m = inf", "standoff_m: is inf, must be a finite number >= 0.1"),
        ('direction = "papr"', 'direction: is "papr", must be "paper" or "mirrored" - did you mean \'paper\'?'),
        ("gains = 3", 'gains: is 3, must be one of "paper", "paper_1"'),
        ('"a.b" = 3', '"a.b": unknown key'),
        ("k1 = 1e10", "k1: is 10000000000.0, must be a number > 0, of 1e+09 at most in size"),
        ("beta2 = 101", "beta2: is 101, must be a number > 0 and <= 100"),
    ],
)
def test_a_wrong_value_is_told_with_what_is_allowed(write: Write, law_line: str, wrong: str) -> None:
    (line,) = mistakes(write(f"{SHORTEST}\n{law_line}\n"))
    assert line.startswith(f"a.toml:6: flight.law.{wrong}")


def test_all_mistakes_are_told_at_once_in_the_order_of_the_file(write: Write) -> None:
    text = """titel = "x"
[flight]
duration_s = "long"
seed = 1.0
[flight.law]
name = "smcc"
[flight.start]
position_m = [1, "a"]
[flight.target]
segments = [
  { from_s = 0, to_s = 1 },
  { from_s = 0, turn_rate = 1 },
]
[flight.inner_loop]
rate_trim = 1
"""
    starts = [line.partition(",")[0] for line in mistakes(write(text))]
    assert starts == [
        "a.toml:1: titel: unknown key",
        "a.toml:2: flight.plant: is missing",
        'a.toml:3: flight.duration_s: is "long"',
        "a.toml:4: flight.seed: is 1.0",
        'a.toml:6: flight.law.name: is "smcc"',
        "a.toml:8: flight.start.position_m: is [1",
        "a.toml:12: flight.target.segments.1.to_s: is missing",
        "a.toml:12: flight.target.segments.1.turn_rate: unknown key",
        "a.toml:15: flight.inner_loop.rate_trim: is 1",
    ]


def test_what_is_impossible_together_is_told_at_the_key_of_the_file(write: Write) -> None:
    text = (
        f"{SHORTEST}[flight.wind]\nsteady_mps = [13, 1]\n[flight.target]\nsegments = [\n{{ from_s = 5, to_s = 3 }}]\n"
    )
    wind, segment = mistakes(write(text))
    assert wind.startswith("a.toml:6: flight.wind.steady_mps: wind of 13.0384 m/s")
    assert segment.startswith("a.toml:9: flight.target.segments.0.to_s: 3 s")


def test_a_mistake_in_an_override_is_told_as_it_was_typed(write: Write) -> None:
    path = write(f"{SHORTEST}alpha2 = -1\n")
    assert mistakes(path, "start.heading_deg=north", "law.alpha2=-2") == [
        "--set law.alpha2=-2: flight.law.alpha2: is -2, must be a number >= 0",
        '--set start.heading_deg=north: flight.start.heading_deg: is "north", must be a number',
    ]
    assert mistakes(path, "plant", "law.name.x=1") == [
        "--set plant: must be KEY=VALUE, as in law.gains=paper_1",
        "--set law.name.x=1: flight.law.name is not a table",
    ]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[flight]\nplant = kinematic\n", "a.toml:2: not valid TOML: Invalid value"),
        ("\n[flight", "a.toml:2: not valid TOML: Expected ']' at the end of a table declaration"),
        (b"# \xc3\xa4\n# \xff\n", "a.toml:2: not text in UTF-8"),
        ("", "a.toml:1: flight: is missing, must be a table"),
        (
            f"{SHORTEST}[matrix]\nseed = [1]\n",
            "a.toml:5: matrix: describes many flights, must be one: fix each axis by --set, or use `harness run`",
        ),
    ],
)
def test_a_file_that_is_no_flight_is_told_in_one_line(write: Write, text: str | bytes, told: str) -> None:
    assert mistakes(write(text)) == [told]


def test_a_file_that_cannot_be_read_is_told_in_one_line(tmp_path: Path) -> None:
    assert mistakes(tmp_path / "none.toml") == [f"{tmp_path}/none.toml: No such file or directory"]
    assert mistakes(tmp_path) == [f"{tmp_path}: Is a directory"]


def test_a_field_is_located_by_its_dotted_name(write: Write) -> None:
    file = read_settings(write(f"{SHORTEST}[flight.start]\nairspeed_mps = 3\n"), ["start.altitude_m=1"])
    assert file.locate("start.airspeed") == "a.toml:6: flight.start.airspeed_mps"
    assert file.locate("start.heading") == "a.toml:5: flight.start.heading_deg"
    assert file.locate("start.altitude") == "--set start.altitude_m=1: flight.start.altitude_m"
    assert file_key("target.segments.2.from_") == ("flight", "target", "segments", 2, "from_s")
    assert file_key("law.max_heading_rate") == ("flight", "law", "max_heading_rate_deg_s")


def test_a_dotted_key_is_put_into_tables_that_were_not_there() -> None:
    settings: dict[str, object] = {}
    assert put(settings, "law.gains", "paper") == ("flight", "law", "gains")
    assert settings == {"flight": {"law": {"gains": "paper"}}}


def test_a_document_without_a_file_is_told_by_its_keys() -> None:
    with pytest.raises(SettingsError) as caught:
        flight_from_document({"plant": "sixdof", "law": {"name": "smc"}, "seed": -1})
    assert caught.value.lines == ["flight.seed: is -1, must be a whole number >= 0 and <= 1e+15"]


def test_reading_settings_loads_no_simulator() -> None:
    code = "import harness.settings, sys; assert not {'jsbsim', 'pandas', 'rerun', 'scipy'} & set(sys.modules)"
    assert python(code).returncode == 0


ODD = (
    "-1",
    "0",
    "1e9",
    "1e300",
    "nan",
    "inf",
    "true",
    "'x'",
    "''",
    "[1, 2]",
    "[{}]",
    "1979-05-27",
    "'''a\nb'''",
    '"\\u0000"',
)


def test_whatever_a_key_is_set_to_there_is_a_flight_that_can_be_told_or_lines_that_begin_with_the_setting() -> None:
    settings = document(load_flight(STATIONARY))
    names = [*settings, *(f"{name}.{key}" for name, part in settings.items() if isinstance(part, dict) for key in part)]
    flights, told = [], {}
    for typed in (f"{name}={value}" for name in names for value in ODD):
        try:
            flights.append(load_flight(STATIONARY, [typed]))
        except SettingsError as error:
            told[typed] = error.lines
    for typed, lines in told.items():
        begins = f"--set {' '.join(typed.split())}: flight."
        assert [line for line in lines if not line.startswith((begins, str(STATIONARY)))] == []
    for flight in flights:
        json.dumps([document(flight), warnings(flight), feasibility_margin(flight)])
    assert len(flights) > 20
    assert len(told) > 500


def test_a_path_of_the_file_starts_at_its_folder_and_one_of_an_override_at_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    there, here = tmp_path / "there", tmp_path / "here"
    for folder in (there, here):
        copied_airframe("ultra_stick_25e", folder / "plane")
        (folder / "track.csv").write_text("time_s,north_m,east_m\n0,0,0\n30,3,0\n60,6,0\n100,10,0\n")
    monkeypatch.chdir(here)
    file = there / "a.toml"
    file.write_text(SHORTEST.replace("[flight]", '[flight]\naircraft = "plane"\ntarget.track = "track.csv"'))
    flight = load_flight(file)
    assert (flight.aircraft, flight.target.track) == (str(there / "plane"), str(there / "track.csv"))
    flight = load_flight(file, ["aircraft=plane", "target.track=track.csv"])
    assert (flight.aircraft, flight.target.track) == (str(here / "plane"), str(here / "track.csv"))
    axes = ['aircraft=["plane", "skywalker_x8"]', "target.track=track.csv"]
    matrix = read_matrix(read_settings(file, axes))
    flights = [matrix.flight(combination) for combination in matrix.combinations()]
    assert [flight.aircraft for flight in flights] == [str(here / "plane"), "skywalker_x8"]


# What a file leaves to the airframe's speed


def test_without_an_airspeed_a_flight_has_that_of_its_airframe() -> None:
    for name, airspeed in (("ultra_stick_25e", 13.0), ("skywalker_x8", 13.0), ("aerosonde", 25.0)):
        flight = flight_from_document({"plant": "sixdof", "aircraft": name, "law": {"name": "smc"}})
        assert flight.start.airspeed == airspeed
    given = {"plant": "sixdof", "aircraft": "aerosonde", "law": {"name": "smc"}, "start": {"airspeed_mps": 20.0}}
    assert flight_from_document(given).start.airspeed == 20.0


def test_a_length_may_be_the_way_flown_in_some_seconds() -> None:
    """The paper's 200 m at 13 m/s are 15.38 s; at 25 m/s they are 384.6 m."""
    settings: dict[str, object] = {
        "plant": "kinematic", "aircraft": "aerosonde", "law": {"name": "smc", "standoff_m": "15.384615 s"},
        "start": {"position_m": ["-15 s", 200.0], "altitude_m": 150.0},
    }  # fmt: skip
    flight = flight_from_document(settings)
    assert flight.law.standoff == pytest.approx(384.615, abs=1e-3)
    assert flight.start.position == (-375.0, 200.0)
    with pytest.raises(SettingsError, match=r'law.standoff_m: is "15 m", must be a number'):
        flight_from_document({**settings, "law": {"name": "smc", "standoff_m": "15 m"}})


@pytest.mark.parametrize(
    "text",
    [
        f"[{'.'.join('a' * 700)}]\n",
        f"{'.'.join('a' * 3000)} = 1\n",
        f"x = {'[' * 3000}{']' * 3000}\n",
        f"x = {'{a=' * 99}1{'}' * 99}\n",
    ],
)
def test_tables_or_lists_nested_too_deep_are_told(write: Write, text: str) -> None:
    (told,) = mistakes(write(text))
    assert told == "a.toml: cannot be used: it has more than 30 tables or lists within one another"


@pytest.mark.parametrize("value", ["[" * 3000, "[" * 3000 + "]" * 3000, "{a=" * 3000, "9" * 5000, "1\n[assess]"])
def test_a_value_of_the_command_line_that_is_no_toml_is_a_word_told_by_its_beginning(write: Write, value: str) -> None:
    (told,) = mistakes(write(SHORTEST), f"duration_s={value}")
    assert told.startswith(f"--set duration_s={' '.join(value.split())[:46]}")
    assert "must be a number" in told
    assert len(told) < 250


def test_a_key_of_the_command_line_has_a_depth_as_well(write: Write) -> None:
    (told,) = mistakes(write(SHORTEST), f"{'.'.join('a' * 3000)}=1")
    assert told.endswith("...: the key must be a dotted name below [flight], as in law.gains")


def test_messages_show_values_as_a_file_has_them(write: Write) -> None:
    text = SHORTEST.replace('"kinematic"', "2020-01-01\nduration_s = [07:32:00, true]\nseed = { a = inf, b = 'x' }")
    assert [line.split(": ", 2)[2].split(", must")[0] for line in mistakes(write(text))] == [
        "is 2020-01-01", "is [07:32:00, true]", 'is { a = inf, b = "x" }',
    ]  # fmt: skip


def test_another_law_leaves_out_the_gains_that_the_file_gives_for_its_own(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    own = 'name = "nftsm"\ngains = "paper_1"\nk2 = 3.0\nstandoff_m = 150.0\n'
    file.write_text(f'[flight]\nplant = "kinematic"\n[flight.law]\n{own}')
    with pytest.warns(UserWarning, match=r"law\.name=smc: leaves out gains, k2 of nftsm in .*a\.toml"):
        flight = load_flight(file, ["law.name=smc", "law.c1=0.3"])
    assert flight.law == law("smc", "paper", c1=0.3, standoff=150.0)
    assert load_flight(file, ["law.name=nftsm"]) == load_flight(file)
    with pytest.warns(UserWarning, match="leaves out"), pytest.raises(SettingsError, match=r"law\.alpha2"):
        load_flight(file, ["law.name=smc", "law.alpha2=1"])
