"""The margins of the verdict as a file sets them."""

import math
import re
from dataclasses import fields
from pathlib import Path
from typing import Annotated, get_args, get_origin, get_type_hints

import pytest

from autopilot.quantities import About
from harness.margins import Assess
from harness.settings import SettingsError, load_flight, read_settings, settings_from_text
from harness.settings.written import written
from harness.verdict.parts import PARTS
from tests.builders import DOCS, write

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
    part = next(part for part in PARTS if part.threshold == "sideslip_deg")
    assert part.column == "sideslip_rms_deg"
    low, high = part.bounds(Assess(sideslip=math.radians(3.0)))
    assert low is None
    assert high == pytest.approx(3.0)
    assert {part.threshold for part in PARTS} <= set(written(Assess()))


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


def test_the_document_has_every_margin_with_its_default() -> None:
    text = (DOCS / "reference" / "verdict.md").read_text(encoding="utf-8")
    rows = {row.split("|")[3].strip(" `"): row.split("|")[4] for row in text.splitlines() if row.count("|") == 6}
    for key, default in written(Assess()).items():
        assert key in rows, key
        number = re.search(r"1/e|[\d.]+", rows[key])
        assert number, key
        told = 1.0 / math.e if number[0] == "1/e" else float(number[0])
        assert told / (100.0 if "%" in rows[key] else 1.0) == pytest.approx(default), key
