"""Tables on a terminal and in Markdown."""

import math
from collections.abc import Callable, Iterator

import pytest

from harness.tables import WIDTH, markdown, number, table


def test_names_stand_left_numbers_right_and_each_heading_stands_on_its_rule() -> None:
    rows = [["nftsm", "49.7", "ground"], ["smc", "-"]]
    assert list(table(["law", "settles\ns", "ended"], rows, "lrl")) == [
        "       settles",
        "law          s  ended",
        "-----  -------  ------",
        "nftsm     49.7  ground",
        "smc          -",
    ]


def test_the_last_letter_counts_for_all_further_columns_and_a_table_may_lack_headings() -> None:
    assert list(table([], [["a", "1", "20"], ["b", "10", "2"]], "lr")) == ["a   1  20", "b  10   2"]


def test_a_table_is_never_cut() -> None:
    (line,) = table([], [["x" * 300, "y"]])
    assert line == "x" * 300 + "  y"


@pytest.fixture
def terminal() -> Iterator[Callable[[int], object]]:
    """Sets the width of the terminal."""
    token = WIDTH.set(None)
    yield WIDTH.set
    WIDTH.reset(token)


NUMBERS = list(map(str, range(12)))
WIDE = (["law", "plant", *(f"metric {i}\nm" for i in NUMBERS)], [[law, "sixdof", *NUMBERS] for law in "ab"])


@pytest.mark.parametrize("width", [40, 80, 120, 200])
def test_on_a_terminal_a_wide_table_is_in_parts_that_fit_each_with_the_names_of_its_rows(
    terminal: Callable[[int], object], width: int
) -> None:
    terminal(width)
    lines = list(table(*WIDE, "llr"))
    assert max(map(len, lines)) <= width
    parts = "\n".join(lines).split("\n\n")
    assert (len(parts) == 1) == (width >= 132)
    assert [[row.split()[:2] for row in part.splitlines()[-2:]] for part in parts] == [
        [["a", "sixdof"], ["b", "sixdof"]]
    ] * len(parts)
    assert " ".join(" ".join(part.splitlines()[-1].split()[2:]) for part in parts) == " ".join(NUMBERS)


def test_on_a_terminal_a_last_column_of_text_is_wrapped_and_no_word_is_cut(terminal: Callable[[int], object]) -> None:
    terminal(40)
    assert list(table(["key", "meaning"], [["k2", "the gain of the reaching law " + "/path" * 9], ["k3", "-"]])) == [
        "key  meaning",
        "---  -----------------------------------",
        "k2   the gain of the reaching law",
        "     " + "/path" * 9,
        "k3   -",
    ]


def test_a_table_without_rows_is_its_headings() -> None:
    assert list(table(["a", "b"], [])) == ["a  b", "-  -"]
    assert list(table([], [])) == []


def test_markdown_has_the_same_cells() -> None:
    assert list(markdown(["law", "settles\ns"], [["a|b", "49.7"]], "lr")) == [
        "| law | settles s |", "|---|--:|", "| a\\|b | 49.7 |",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "-"),
        (math.nan, "-"),
        (True, "yes"),
        (False, "no"),
        (0.00049, "0"),
        (-12.345, "-12.3"),
        (1234.5, "1.23e+03"),
        (0, "0"),
    ],
)
def test_a_number_has_three_digits(value: float | bool | None, text: str) -> None:
    assert number(value) == text


def test_a_share_is_written_in_percent() -> None:
    assert number(0.256, 100.0) == "25.6"
