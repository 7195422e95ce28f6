"""A matrix of flights as a file describes it."""

import re
from collections import Counter
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pytest

from harness.runs.matrix import Matrix, read_matrix
from harness.runs.run import run
from harness.runs.survey import survey
from harness.settings import SettingsError, document, read_settings
from tests.builders import DOCS, HERE, write

FLIGHT = """\
[flight]
plant = "kinematic"
duration_s = 1.0
[flight.law]
name = "nftsm"
gains = "paper_1"
"""


class Read(Protocol):
    def __call__(self, text: str, *overrides: str) -> Matrix: ...


@pytest.fixture
def matrix(tmp_path: Path) -> Read:
    """Reads the matrix of `m.toml`, which holds `FLIGHT` and the text."""

    def read(text: str, *overrides: str) -> Matrix:
        return read_matrix(read_settings(write(tmp_path / "m.toml", FLIGHT + text), overrides))

    return read


def values(matrix: Matrix, key: str) -> list[Any]:
    return [combination.values[key] for combination in matrix.combinations()]


def test_a_matrix_is_the_product_of_its_axes_with_the_plant_fastest(matrix: Read) -> None:
    m = matrix('[matrix]\nplant = ["kinematic", "sixdof"]\n"law.gains" = ["paper", "paper_1"]\nseed = [3, 4]\n')
    assert len(m) == 8
    assert [tuple(c.values[k] for k in ("law.gains", "seed", "plant")) for c in m.combinations()][:3] == [
        ("paper", 3, "kinematic"),
        ("paper", 3, "sixdof"),
        ("paper", 4, "kinematic"),
    ]


def test_set_takes_an_axis_which_replaces_the_files_and_needs_none(matrix: Read) -> None:
    m = matrix('[matrix]\n"law.k2" = [1.0, 2.0]\nseed = [3, 4]\n', "law.k2=[5.0, 6.0, 7.0]", "plant=sixdof")
    assert m.varies == {"law.k2": 3, "seed": 2}
    assert values(m, "law.k2") == [5.0, 5.0, 6.0, 6.0, 7.0, 7.0]
    assert {m.flight(combination).plant for combination in m.combinations()} == {"sixdof"}
    swept = matrix("", "seed={start=20, count=3}", "start.heading_deg={uniform=[0, 90]}")
    assert values(swept, "seed") == [20, 21, 22]
    assert len({round(heading, 6) for heading in values(swept, "start.heading_deg")}) == 3
    assert swept.identifier != matrix("", "seed={start=20, count=4}", "start.heading_deg={uniform=[0, 90]}").identifier


def test_a_setting_that_is_a_list_takes_a_list_of_lists(matrix: Read) -> None:
    assert len(matrix("", "wind.steady_mps=[1.0, 2.0]")) == 1
    assert values(matrix("", "wind.steady_mps=[[0, 0], [1, 2]]"), "wind.steady_mps") == [[0, 0], [1, 2]]


@pytest.mark.parametrize(
    ("override", "told"),
    [
        ("law.k2=[]", "--set law.k2=[]: the list is empty"),
        ("seed={start=1}", "--set seed={start=1}: has the keys start, must be a list, { start, count }"),
    ],
)
def test_a_mistake_in_an_axis_of_the_command_line_is_told_there(matrix: Read, override: str, told: str) -> None:
    with pytest.raises(SettingsError, match=f"^{re.escape(told)}"):
        matrix("", override)


def test_a_wrong_value_in_an_axis_of_the_command_line_is_told_there(matrix: Read) -> None:
    m = matrix("", 'law.k2=[1, "a"]')
    with pytest.raises(SettingsError, match=r'^--set law\.k2=.*: flight\.law\.k2: is "a", must be a number > 0'):
        [m.flight(combination) for combination in m.combinations()]


def test_expansion_is_the_same_when_built_twice_and_is_lazy(matrix: Read) -> None:
    text = (
        '[matrix]\nplant = ["kinematic", "sixdof"]\n"start.heading_deg" = { uniform = [0.0, 360.0] }\n'
        "seed = { start = 0, count = 1000000 }\n"
    )
    one, two = matrix(text).combinations(), matrix(text).combinations()
    for _ in range(50):
        assert next(one) == next(two)
    m = matrix(text)
    last = m.at(1_999_998)
    assert last is not None
    assert last.values["seed"] == 999_999


def test_forms_give_their_values(matrix: Read) -> None:
    m = matrix("[matrix]\nseed = { start = 5, count = 3 }\n")
    assert values(m, "seed") == [5, 6, 7]
    m = matrix('[matrix]\n"law.max_heading_rate_deg_s" = { from = 5, to = 30, step = 5 }\n')
    assert values(m, "law.max_heading_rate_deg_s") == [5, 10, 15, 20, 25, 30]
    m = matrix("[matrix]\nduration_s = { from = 0.1, to = 0.5, step = 0.1 }\n")
    assert values(m, "duration_s") == [0.1, 0.2, 0.3, 0.4, 0.5]
    m = matrix("[matrix]\nduration_s = { from = 3, to = 1, step = -1 }\n")
    assert values(m, "duration_s") == [3, 2, 1]
    m = matrix('[matrix]\n"wind.steady_mps" = { speed_mps = [0, 2], towards_deg = [0, 90, 180] }\n')
    assert values(m, "wind.steady_mps") == [[0, 0], [2, 0], [0, 2], [-2, 0]]


def test_a_drawn_value_is_the_seeds_own_whatever_the_plant_law_or_place(matrix: Read) -> None:
    drawn = '"start.heading_deg" = { uniform = [10.0, 20.0] }\n"start.position_m" = { normal = [[0, 0], [5, 50]] }\n'
    m = matrix(f'[matrix]\nplant = ["kinematic", "sixdof"]\n"law.gains" = ["paper", "paper_1"]\n{drawn}seed = [0, 7]\n')
    by_seed: dict[object, set[object]] = {}
    for c in m.combinations():
        by_seed.setdefault(c.values["seed"], set()).add(repr([c.values[k] for k in m.draws]))
    assert {seed: len(found) for seed, found in by_seed.items()} == {0: 1, 7: 1}
    assert by_seed[0] != by_seed[7]
    alone = matrix(f"[matrix]\nseed = [7]\n{drawn}")
    assert {repr([c.values[k] for k in m.draws]) for c in alone.combinations()} == by_seed[7]
    headings = values(matrix(f"[matrix]\n{drawn}seed = {{ start = 0, count = 400 }}\n"), "start.heading_deg")
    assert all(10.0 <= heading < 20.0 for heading in headings)
    assert sum(headings) / 400 == pytest.approx(15.0, abs=3 * 10 / 12**0.5 / 20)


def test_a_value_of_a_list_may_be_drawn_too(matrix: Read) -> None:
    towards = "{ speed_mps = 2.0, towards_deg = { uniform = [0.0, 360.0] } }"
    m = matrix(
        f'[matrix]\nseed = {{ start = 0, count = 300 }}\n"wind.steady_mps, wind.turbulence" = '
        f'[[[0.0, 0.0], "none"], [{towards}, "none"], [{towards}, "light"]]\n'
    )
    winds = np.array(values(m, "wind.steady_mps")).reshape(300, 3, 2)  # seed, element, component
    assert m.draws == ["wind.steady_mps"]
    assert not winds[:, 0].any()
    assert (winds[:, 1] == winds[:, 2]).all()  # the seed's own, whatever the place
    assert np.hypot(*winds[:, 1].T) == pytest.approx(2.0)
    assert np.abs(winds[:, 1].mean(axis=0)).max() < 3 * 2.0 / 2**0.5 / 300**0.5
    alone = matrix(f'[matrix]\nseed = [7]\n"wind.steady_mps" = {towards}\n')
    assert values(alone, "wind.steady_mps") == [winds[7, 1].tolist()]
    speeds = matrix(f'[matrix]\nseed = [7]\n"wind.steady_mps" = {towards.replace("2.0", "[0, 2, 4]")}\n')
    assert values(speeds, "wind.steady_mps") == [[0, 0], winds[7, 1].tolist(), (2 * winds[7, 1]).tolist()]


def test_keys_with_a_comma_vary_together(matrix: Read) -> None:
    m = matrix('[matrix]\n"aircraft, start.airspeed_mps" = [["ultra_stick_25e", 13.0], ["aerosonde", 25.0]]\n')
    flights = [m.flight(c) for c in m.combinations()]
    assert [(f.aircraft, f.start.airspeed) for f in flights] == [("ultra_stick_25e", 13.0), ("aerosonde", 25.0)]


def test_excluded_flights_are_left_out_and_included_ones_added(matrix: Read) -> None:
    m = matrix(
        '[matrix]\nplant = ["kinematic", "sixdof"]\nlaw.gains = ["paper", "paper_1"]\nseed = { start = 0, count = 2 }\n'
        '[[exclude]]\nplant = "sixdof"\nlaw.gains = "paper_1"\n'
        '[[include]]\nlaw.name = "smc"\nlaw.gains = "paper"\nseed = { start = 0, count = 3 }\n'
    )
    flights = [m.flight(c) for c in m.combinations()]
    assert len(m) == len(flights) == 9
    assert Counter((f.plant, *(document(f)["law"][key] for key in ("name", "gains"))) for f in flights) == {
        ("kinematic", "nftsm", "paper"): 2,
        ("sixdof", "nftsm", "paper"): 2,
        ("kinematic", "nftsm", "paper_1"): 2,
        ("kinematic", "smc", "paper"): 3,
    }


def test_a_key_that_is_set_is_no_axis(matrix: Read) -> None:
    m = matrix('[matrix]\nplant = ["kinematic", "sixdof"]\nseed = [1, 2]\n', "plant=sixdof")
    assert [(m.flight(c).plant, m.flight(c).seed) for c in m.combinations()] == [("sixdof", 1), ("sixdof", 2)]


@pytest.mark.parametrize(("plant", "seeds"), [("sixdof", [1]), ("kinematic", [1, 2])])
def test_an_exclusion_holds_for_the_value_that_is_set_and_for_no_other(
    matrix: Read, plant: str, seeds: list[int]
) -> None:
    text = '[matrix]\nplant = ["kinematic", "sixdof"]\nseed = [1, 2]\n[[exclude]]\nplant = "sixdof"\nseed = 2\n'
    m = matrix(text, f"plant={plant}")
    assert [m.flight(c).seed for c in m.combinations()] == seeds


def test_flights_that_differ_in_the_plant_alone_are_one_group(matrix: Read) -> None:
    m = matrix('[matrix]\nplant = ["kinematic", "sixdof"]\n"law.gains" = ["paper", "paper_1"]\nseed = [0, 1]\n')
    groups: dict[int, list[object]] = {}
    for c in m.combinations():
        groups.setdefault(m.group(c.position), []).append((c.values["law.gains"], c.values["seed"]))
    assert sorted(groups) == [0, 1, 2, 3]
    assert all(len(members) == 2 and members[0] == members[1] for members in groups.values())


MISTAKES = [
    ("[matrix]\nseed = { start = 0, conut = 3 }\n", "m.toml:8: matrix.seed: has the keys conut, start, must be a list"),
    ("[matrix]\nseed = 3\n", "m.toml:8: matrix.seed: is 3, must be a list"),
    ("[matrix]\nseed = []\n", "m.toml:8: matrix.seed: the list is empty"),
    ("[matrix]\nduration_s = { from = 1, to = 2, step = -1 }\n", "m.toml:8: matrix.duration_s: step is -1"),
    ('[matrix]\n"start.heading_deg" = { uniform = [1] }\n', "m.toml:8: matrix.start.heading_deg: uniform is [1]"),
    ('[matrix]\n"start.heading_deg" = [{ start = 0, count = 3 }]\n', "has the keys count, start in a list, must be"),
    (
        '[matrix]\n"wind.steady_mps" = { speed_mps = 2, towards_deg = { uniform = [[0], [1]] } }\n',
        "m.toml:8: matrix.wind.steady_mps: towards_deg is { uniform = [[0], [1]] }, must be numbers, { uniform",
    ),
    ('[matrix]\n"seed, plant" = [[1, "sixdof"], [2]]\n', "element 2 is [2], must be a list of 2: seed, plant"),
    (
        '[matrix]\nseed = [1]\n"seed, plant" = [[1, "sixdof"]]\n',
        "m.toml:9: matrix.seed, plant: seed is an axis already",
    ),
    ('[matrix]\nseed = [1]\n[[exclude]]\nplant = "sixdof"\n', "m.toml:10: exclude.plant: is not an axis of [matrix]"),
    (
        "[matrix]\nseed = [1]\n[[exclude]]\nseed = 2\n",
        "m.toml:10: exclude.seed: is 2, which excludes nothing, must be one of 1",
    ),
]


@pytest.mark.parametrize(("text", "told"), MISTAKES)
def test_a_mistake_in_the_matrix_is_told_with_its_line(matrix: Read, text: str, told: str) -> None:
    with pytest.raises(SettingsError) as caught:
        matrix(text)
    assert len(caught.value.lines) == 1
    assert told in caught.value.lines[0]


WRONG_FLIGHTS = [
    ('[matrix]\n"law.gain" = ["paper"]\n', "m.toml:8: flight.law.gain: unknown key"),
    ('[matrix]\n"law.gains" = [\n  "paper",\n  "papr",\n]\n', 'm.toml:10: flight.law.gains: is "papr"'),
    ('[matrix]\nplant = ["sixdof"]\n"start.airspeed_mps" = [13, 7]\n', "m.toml:9: flight.start.airspeed_mps: no"),
    ("[matrix]\nseed = [0, -1]\n", "m.toml:8: flight.seed: is -1"),
    (
        '[matrix]\nseed = [0, 1]\n"wind.steady_mps" = { normal = [[0, 0], [99, 99]] }\n',
        "m.toml:9: flight.wind.steady_mps",
    ),
]


@pytest.mark.parametrize(("text", "told"), WRONG_FLIGHTS)
def test_a_flight_that_is_wrong_is_found_before_flying(matrix: Read, text: str, told: str) -> None:
    with pytest.raises(SettingsError) as caught:
        list(survey(matrix(text)))
    assert told in str(caught.value)


def test_the_survey_counts_and_tells_idle_seeds(matrix: Read) -> None:
    text = '[matrix]\nseed = { start = 0, count = 3 }\n"law.max_heading_rate_deg_s" = [1.0, 5.0]\n'
    *_, found = survey(matrix(text))
    assert (found.flights, found.idle_seeds) == (6, 3)
    (infeasible,) = (warned for warned in found.warnings.values() if "infeasible" in warned.text)
    assert (infeasible.flights, infeasible.alike) == (3, True)
    assert found.varies == {"seed": 3, "law.max_heading_rate_deg_s": 2}
    *_, noisy = survey(matrix(text, "estimator.kind=ekf"))
    *_, drawn = survey(matrix(text + '"start.heading_deg" = { uniform = [0, 9] }\n'))
    assert noisy.idle_seeds == drawn.idle_seeds == 0
    *_, limited = survey(matrix(text), limit=4)
    assert limited.flights == 4


def test_warnings_that_differ_in_their_numbers_alone_are_one(matrix: Read) -> None:
    *_, found = survey(matrix('[matrix]\n"wind.steady_mps" = [[0, 0], [1, 0], [2, 0]]\n'))
    (warned,) = found.warnings.values()
    assert (warned.flights, warned.alike) == (3, False)
    assert "Eq. (28)" in warned.text
    assert "Eq. (30)" in warned.text


def test_a_file_without_a_matrix_is_one_flight(matrix: Read) -> None:
    (combination,) = matrix("").combinations()
    assert matrix("").flight(combination).duration == 1.0


def test_the_guides_matrix_has_the_flights_that_its_comments_say(tmp_path: Path) -> None:
    text = (DOCS / "guide" / "many_flights.md").read_text(encoding="utf-8")
    (example,) = (block for block in re.findall(r"```toml\n(.*?)```", text, re.DOTALL) if "[[exclude]]" in block)
    m = read_matrix(read_settings(write(tmp_path / "everything.toml", example)))
    plants, seeds, limits, winds, laws = 2, 3, 3, 1 + 2, 2
    assert len(m) == plants * seeds * limits * winds * laws - limits * winds * laws + 3
    *_, found = survey(m, limit=40)
    assert found.flights == 40


FULL_OF_MISTAKES = """\
titel = "x"
question = 3
[flight]
duration_s = "long"
wnid = 3
[flight.law]
name = "nftms"
standof_m = 3
max_heading_rate_deg_s = -5
[flight.start]
airspeed_mps = 7
[flight.wind]
steady_mps = [13.0, 0.0]
gusts = [
  { from_s = 5, to_s = 3, velocity_mps = [1, 1, 1] },
  { from_s = "a", to_s = 3, velocity_mps = [1, 1, 1] },
]
[flight.estimator]
kind = "ekf"
period_s = 0.0521
[matrix]
plant = ["sixdof", "kinmatic"]
seed = []
"law.gains" = ["paper", "papr"]
"law.gian" = []
[[exclude]]
seed = 3
[[exclude]]
plant = "lagged"
[assess]
range_error_margn_m = 3
sideslip_deg = -1
"""


def test_every_mistake_of_a_file_is_told_at_once_in_its_order_and_nothing_that_follows_from_one(tmp_path: Path) -> None:
    file = write(tmp_path / "full.toml", FULL_OF_MISTAKES)
    with pytest.raises(SettingsError) as caught:
        list(survey(read_matrix(read_settings(file), draft=True)))
    told = [line.removeprefix(f"{file}:") for line in caught.value.lines]
    assert [": ".join(line.split(": ")[:2]) for line in told] == [
        "1: titel",
        "2: question",
        "4: flight.duration_s",
        "5: flight.wnid",
        "7: flight.law.name",
        "8: flight.law.standof_m",
        "9: flight.law.max_heading_rate_deg_s",
        "11: flight.start.airspeed_mps",  # no level trim
        "13: flight.wind.steady_mps",  # not below the airspeed
        "15: flight.wind.gusts.0.to_s",  # before from_s
        "16: flight.wind.gusts.1.from_s",
        "20: flight.estimator.period_s",  # not a multiple of step_s
        "22: flight.plant",
        "23: matrix.seed",  # empty
        "24: flight.law.gains",
        "25: matrix.law.gian",  # empty
        "25: flight.law.gian",  # unknown
        "29: exclude.plant",
        "31: assess.range_error_margn_m",
        "32: assess.sideslip_deg",
    ]
    with pytest.raises(SettingsError, match="titel"):
        list(run(read_matrix(read_settings(file), draft=True), tmp_path / "out", HERE))


def test_a_setting_that_is_wrong_makes_no_other_one_wrong(matrix: Read) -> None:
    text = '[flight.start]\nairspeed_mps = "fast"\n[flight.wind]\nsteady_mps = [14, 0]\n[matrix]\nplant = []\n'
    with pytest.raises(SettingsError) as caught:
        matrix(text)
    assert caught.value.lines[0].endswith("matrix.plant: the list is empty, must have at least one value")
    with pytest.raises(SettingsError) as caught:
        list(survey(matrix(text.replace("plant = []", "seed = [1, 2]"))))
    (airspeed,) = caught.value.lines
    assert 'flight.start.airspeed_mps: is "fast"' in airspeed


def test_a_file_without_flight_is_told_of_that_alone(tmp_path: Path) -> None:
    file = write(tmp_path / "m.toml", '[matrix]\nseed = [-1]\n"law.k2" = [1.0]\n')
    with pytest.raises(SettingsError) as caught:
        list(survey(read_matrix(read_settings(file), draft=True)))
    assert [line.partition(": ")[2] for line in caught.value.lines] == [
        "flight: is missing, must be a table",
        "flight.seed: is -1, must be a whole number >= 0 and <= 1e+15",
    ]
