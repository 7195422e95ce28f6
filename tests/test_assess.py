"""The margins of the verdict as a file sets them."""

import math
from dataclasses import fields
from pathlib import Path
from typing import Annotated, get_args, get_origin, get_type_hints

import pytest

from autopilot.quantities import About
from harness.margins import Assess
from harness.settings import SettingsError, load_flight, read_settings, settings_from_text
from harness.verdict.parts import PARTS, margins_of
from tests.builders import write

FILE = """\
[flight]
plant = "kinematic"
law = { name = "smc" }
[assess]
sideslip_deg = 3.0
range_error_margin_m = 1.0
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return write(tmp_path / "flight.toml", FILE)


def test_margins_come_from_the_file_in_its_units_and_the_rest_by_default(file: Path) -> None:
    assess = read_settings(file).experiment().assess
    assert assess == Assess(sideslip=math.radians(3.0), range_error_margin=1.0)
    assert read_settings(file).assess() == assess


def test_a_margin_is_overridden_by_its_key(file: Path) -> None:
    assert read_settings(file, ["assess.sideslip_deg=1"]).assess().sideslip == pytest.approx(math.radians(1.0))


def test_a_part_reads_its_margin_in_the_unit_of_the_file_which_is_that_of_its_metric() -> None:
    low, high = PARTS["sideslip_rms_deg"].bounds(margins_of(Assess(sideslip=math.radians(3.0))))
    assert low is None
    assert high == pytest.approx(3.0)
    assert {part.margin for part in PARTS.values()} <= set(margins_of(Assess()))


def test_margins_are_read_though_the_flight_beside_them_is_unknown_today() -> None:
    text = FILE.replace('plant = "kinematic"', 'plant = "of another version"')
    assert settings_from_text(text, Path("kept.toml")).assess().range_error_margin == 1.0


BAD = [
    ("sideslip_deg = 3.0", "sideslip_deg = 0.0", "5: assess.sideslip_deg: is 0.0, must be a number > 0"),
    ("sideslip_deg = 3.0", 'sideslip_deg = "3"', '5: assess.sideslip_deg: is "3", must be a number > 0'),
    ("range_error_margin_m", "range_eror_margin_m", "did you mean 'range_error_margin_m'?"),
]


@pytest.mark.parametrize(("good", "bad", "told"), BAD)
def test_a_bad_margin_is_told_with_its_line_by_whatever_reads_the_file(
    file: Path, good: str, bad: str, told: str
) -> None:
    write(file, FILE.replace(good, bad))
    for read in (load_flight, lambda path: read_settings(path).experiment(), lambda path: read_settings(path).assess()):
        with pytest.raises(SettingsError) as raised:
            read(file)
        assert told in str(raised.value)


def test_every_margin_says_what_it_means_and_where_it_comes_from() -> None:
    hints = get_type_hints(Assess, include_extras=True)
    for field in fields(Assess):
        hint = hints[field.name]
        assert get_origin(hint) is Annotated
        (about,) = [mark.text for mark in get_args(hint) if isinstance(mark, About)]
        assert any(source in about for source in ("Ours:", "Part 60", "ACS", "Delay", "Table 1", "Holm")), field.name
