"""`harness compare` and `harness report` on directories that `harness run` made."""

import csv
import io
import json
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import harness
from harness.runs.comparable import comparable
from harness.runs.results import _is_drawn
from harness.settings.columns import DIRECTORY, DRAWN
from harness.verdict import grid
from harness.verdict.answer import change_summary, changes
from tests.builders import chromium, command, copied_airframe, invoke, result, results, write
from tests.printed import sheets

EXPERIMENT = """\
title = "Two limits"
question = "Does it hold at 5 and at 20 deg/s?"
[flight]
plant = "sixdof"
duration_s = 40.0
law = { name = "nftsm", gains = "paper_1" }
[matrix]
plant = ["kinematic", "sixdof"]
"law.max_heading_rate_deg_s" = [5.0, 20.0]
"start.heading_deg" = { uniform = [20.0, 60.0] }
seed = { start = 0, count = 5 }
[assess]
sideslip_deg = 1.0
"""


def run(folder: Path, text: str, *words: object) -> Path:
    """Flies the experiment into a directory beside it, by the command itself: its line is kept with the results."""
    file, out = write(folder / "experiment.toml", text), folder / "out"
    done = command("run", file, "--out", out, "--workers", 0, "--log", "none", *words)
    assert done.returncode == 0, done.stderr
    return out


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run(tmp_path_factory.mktemp("run"), EXPERIMENT, "--set", "assess.range_error_margin_m=3.0")


@pytest.fixture(scope="module")
def page(flown: Path) -> Path:
    done = invoke("report", flown)
    assert done.exit_code == 0, done.stderr
    assert done.stdout == f"{flown / 'report.html'}\n"
    return flown / "report.html"


def compared(flown: Path, *words: object) -> dict[str, Any]:
    done = invoke("compare", flown, "--json", *words)
    assert done.exit_code == 0, done.stderr
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


def parts(answer: dict[str, Any]) -> list[dict[str, Any]]:
    return [row for card in answer["scorecards"] for row in card["parts"]]


def part(answer: dict[str, Any], column: str) -> dict[str, Any]:
    (card,) = answer["scorecards"]
    return next(part for part in card["parts"] if part["column"] == column)


def cells_of(answer: dict[str, Any], metric: str) -> list[dict[str, Any]]:
    return [row for row in answer["differences"] if row["metric"] == metric]


def test_real_flights_are_paired_and_answered_with_their_intervals(flown: Path) -> None:
    done = invoke("compare", flown)
    assert done.exit_code == 0, done.stderr
    first, second, *_ = done.stdout.splitlines()
    assert first == "Does it hold at 5 and at 20 deg/s?"
    assert second.startswith(
        "Compared: plant = sixdof beside kinematic, 10 pairs, 5 seeds, from 20 flights; varies: law"
    )
    line = next(line for line in done.stdout.splitlines() if line.strip().startswith("no sideslip "))
    assert re.search(r"\+\d+(\.\d+)? \[\+\d+(\.\d+)?, \+\d+(\.\d+)?\] deg rms +at most 1 ", line), line


def test_json_holds_pairs_differences_scorecards_and_the_margins_of_the_run(flown: Path) -> None:
    answer = compared(flown)
    assert len(answer["pairs"]) == 10
    assert answer["unpaired"] == []
    assert answer["assess"]["sideslip_deg"] == 1.0  # from the file
    assert answer["assess"]["range_error_margin_m"] == 3.0  # from the run's command line
    assert answer["axes"] == {"law.max_heading_rate_deg_s": [5.0, 20.0]}
    activity = cells_of(answer, "command_activity_deg_s2")
    assert [cell["law.max_heading_rate_deg_s"] for cell in activity] == [5.0, 20.0]
    for cell in activity:
        assert cell["other"] - cell["reference"] == pytest.approx(cell["difference"])
        assert cell["low"] < cell["difference"] < cell["high"]
        assert (cell["pairs"], cell["seeds"]) == (5, 5)
    assert part(answer, "command_activity_deg_s2")["fails"] == sum(cell["verdict"] == "fails" for cell in activity)
    assert part(answer, "altitude_deviation_peak_m")["verdict"] == "holds"


def test_one_seed_of_a_matrix_with_draws_decides_nothing(flown: Path, tmp_path: Path) -> None:
    predicted = {"heading_rate_gain_slow", "limit_cycle_margin", "bank_reserve_deg"}  # which no seed decides
    one = parts(compared(flown, "--where", "seed=2"))
    words = {row["verdict"] for row in one if row["column"] not in predicted}
    assert not words & {"holds", "fails"}, words
    fixed = EXPERIMENT.replace(
        '"start.heading_deg" = { uniform = [20.0, 60.0] }\nseed = { start = 0, count = 5 }\n', ""
    )
    without = run(tmp_path, fixed)
    words = {row["verdict"] for row in parts(compared(without))}
    assert words & {"holds", "fails"}
    for folders in ((flown, without), (without, flown)):
        assert comparable(folders, DIRECTORY).flights.attrs[DRAWN]


@pytest.mark.parametrize(
    ("text", "drawn"),
    [
        ('[matrix]\n"start.heading_deg" = { "uniform" = [20.0, 60.0] }', True),
        ('[matrix]\n# "start.heading_deg" = { uniform = [20.0, 60.0] }\nseed = 1', False),
        ('[[block]]\n"wind.steady_mps" = { speed_mps = 3.0, towards_deg = { uniform = [0.0, 360.0] } }', True),
    ],
)
def test_a_draw_is_found_by_its_form_in_settings_and_commands(text: str, drawn: bool) -> None:
    assert _is_drawn(text, "harness run a.toml --set law.k2=3 --set=law.name=smc") is drawn
    assert _is_drawn("", "harness run a.toml --set 'law.k2={uniform=[1, 3]}'")


def test_without_the_kinematic_plant_the_lowest_is_the_baseline(tmp_path: Path) -> None:
    path, out = tmp_path / "two.toml", tmp_path / "out"
    path.write_text(
        '[flight]\nduration_s = 20.0\n[flight.law]\nname = "nftsm"\n[matrix]\nplant = ["sixdof", "lagged"]\n'
    )
    assert invoke("run", path, "--out", out).exit_code == 0
    assert compared(out)["baseline"] == "lagged"
    assert invoke("report", out, "--out", tmp_path / "page.html").exit_code == 0


def test_a_margin_on_the_command_line_changes_the_verdict(flown: Path) -> None:
    assert part(compared(flown), "bank_reserve_deg")["verdict"] == "holds"
    assert part(compared(flown, "--set", "assess.bank_reserve_deg=60"), "bank_reserve_deg")["verdict"] == "fails"


def test_csv_and_latex_hold_every_difference(flown: Path) -> None:
    rows = list(csv.DictReader(io.StringIO(invoke("compare", flown, "--csv").stdout)))
    differences = compared(flown)["differences"]
    assert [row["metric"] for row in rows] == [cell["metric"] for cell in differences]
    for row, cell in zip(rows, differences, strict=True):
        assert float(row["difference"]) == pytest.approx(cell["difference"])
    latex = invoke("compare", flown, "--latex").stdout
    judged = sum(cell["verdict"] in ("holds", "fails", "undecided") for cell in differences)
    assert 0 < latex.count(r"\\") <= judged + 2
    assert latex.count("{") == latex.count("}")
    assert not re.search(r"(?<!\\)_", latex)


def test_the_same_flights_give_the_same_words_and_the_same_page(flown: Path, page: Path, tmp_path: Path) -> None:
    assert invoke("compare", flown, "--json").stdout == invoke("compare", flown, "--json").stdout
    again = tmp_path / "again.html"
    assert invoke("report", flown, "--out", again).exit_code == 0
    assert again.read_bytes() == page.read_bytes()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--baseline", "lagged"], "no flight has the baseline, plant = lagged: there is kinematic, sixdof"),
        (["--set", "law.name=smc"], "--set law.name=smc: only margins can be set here, as in assess.sideslip_deg=3"),
        (["--set", "assess.sideslip=1"], "did you mean 'sideslip_deg'?"),
        (["--set", "assess.sideslip_deg=-1"], "assess.sideslip_deg: is -1, must be a number > 0"),
    ],
)
def test_what_cannot_be_compared_is_one_line_and_exit_code_2(flown: Path, words: list[str], told: str) -> None:
    for name in ("compare", "report"):
        done = invoke(name, flown, *words)
        assert done.exit_code == 2
        (line,) = done.stderr.splitlines()
        assert told in line


def test_no_run_is_one_line_and_exit_code_2(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "nothing"):
        for name in ("compare", "report"):
            done = invoke(name, folder)
            assert done.exit_code == 2
            (line,) = done.stderr.splitlines()
            assert line.startswith(f"{folder}: ")
    assert list(tmp_path.iterdir()) == []


def test_one_flight_has_nothing_to_be_compared_with(tmp_path: Path) -> None:
    done = invoke("compare", run(tmp_path, EXPERIMENT, "--limit", 1))
    assert done.exit_code == 2
    assert done.stderr.endswith("a comparison takes at least two that differ in plant\n")


def test_a_flight_without_a_partner_is_listed(tmp_path: Path) -> None:
    text = EXPERIMENT.replace("40.0", "10.0", 1)
    out = run(tmp_path, text, "--limit", 3)
    lines = invoke("compare", out).stdout.splitlines()
    (alone,) = compared(out)["unpaired"]
    (at,) = (i for i, line in enumerate(lines) if line == "1 flight could not be compared:")
    assert lines[at + 1].startswith(f"  {alone['key'][:12]} without a partner (completed): plant = kinematic, ")


def test_still_air_and_a_fixed_start_give_one_difference_without_width(tmp_path: Path) -> None:
    text = EXPERIMENT.replace('"start.heading_deg" = { uniform = [20.0, 60.0] }\n', "").replace("40.0", "10.0", 1)
    out = run(tmp_path, text)
    for cell in cells_of(compared(out), "sideslip_rms_deg"):
        assert (cell["pairs"], cell["seeds"]) == (5, 5)
        assert cell["low"] == cell["high"] == pytest.approx(cell["difference"])
        assert cell["difference"] > 0.0
        assert cell["verdict"] in ("holds", "fails")


def test_any_setting_can_be_compared_in_python(flown: Path) -> None:
    comparison = harness.compare(flown, by="law.max_heading_rate_deg_s", where={"plant": "sixdof"})
    assert comparison.baseline == "5"
    (row,) = comparison.differences.query("metric == 'bank_peak_deg'").itertuples()
    assert (row.value, row.verdict) == ("20", "higher")


def test_flights_of_two_inner_loops_are_not_compared(tmp_path: Path) -> None:
    airframe = copied_airframe("ultra_stick_25e", tmp_path / "stick")
    text = EXPERIMENT.replace('plant = "sixdof"\n', f'plant = "sixdof"\naircraft = "{airframe}"\n', 1)
    text = text.replace("count = 5", "count = 1").replace("[5.0, 20.0]", "[5.0]").replace("40.0", "10.0", 1)
    assert invoke("compare", run(tmp_path, text)).exit_code == 0
    model = airframe / "stick.xml"
    write(model, model.read_text(encoding="utf-8").replace("</fdm_config>", "<!-- edited -->\n</fdm_config>"))
    done = invoke("compare", run(tmp_path, text))
    assert done.exit_code == 2
    assert "of different versions, which a comparison must not mix: aircraft/model of" in done.stderr


# The page


def test_the_page_is_one_small_file(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert len(text.encode()) < 3_000_000
    fetched = re.findall(r"(?:src|href)\s*=\s*[\"']?(?!#)([^\"'> ]+)|url\((?!#)([^)]+)\)|@import", text)
    assert fetched == []


def opened(page: Path, profile: Path) -> subprocess.CompletedProcess[str]:
    """The page in the browser: what it shows on stdout, what its console says on stderr."""
    return subprocess.run(
        [
            chromium(), "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={profile}", "--no-first-run",
            "--disable-background-networking", "--enable-logging=stderr", "--virtual-time-budget=2000", "--dump-dom",
            page.as_uri(),
        ],
        capture_output=True, text=True, check=True, timeout=120,
    )  # fmt: skip


def test_a_browser_shows_all_of_the_page(page: Path, tmp_path: Path) -> None:
    done = opened(page, tmp_path)
    dom = done.stdout
    shown = re.findall(r'<section[^>]* id="(\w+)"', dom)
    assert shown == ["answer", "flown", "flights", "parts", "scorecards", "ladder", "method"]
    assert dom.count("<svg") == 8  # a curve, two pairs of flights, each group of parts, waterfalls of two cells
    assert dom.count("harness view") == 4  # the worst and the middle one, at the figure and in the table
    assert "Compared: plant = sixdof beside kinematic" in dom
    assert "CONSOLE" not in done.stderr  # where the browser says what the page's policy forbids


def test_a_printed_page_has_no_heading_at_its_foot_and_no_sheet_that_is_almost_empty(
    page: Path, tmp_path: Path
) -> None:
    printed = sheets(page, tmp_path)
    sizes = [text.size for sheet in printed for text in sheet]
    heading = 1.3 * float(np.median(sizes))
    assert max(sizes) > heading
    assert len(printed) > 1
    for sheet in printed:
        assert len(sheet) > 3
        assert sheet[-1].size < heading
    for sheet in printed[:-1]:
        assert sheet[-1].at > 0.6


def test_tables_sort_and_filter_in_the_browser(page: Path, tmp_path: Path) -> None:
    text = page.read_text(encoding="utf-8").replace("const LONG = 20;", "const LONG = 2;")
    text = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", text)  # it would forbid the next script
    asks = """<script>
      const flown = document.querySelector("table.flown"), plants = () =>
        [...flown.tBodies[0].rows].filter(row => !row.hidden).map(row => row.cells[1].textContent).join(" ");
      const told = [];
      flown.tHead.rows[0].cells[1].click(); told.push(plants());
      flown.tHead.rows[0].cells[1].click(); told.push(plants());
      const field = flown.parentElement.previousElementSibling;
      field.value = "SIXDOF 20"; field.dispatchEvent(new Event("input")); told.push(plants());
      document.title = told.join(", ");
    </script></body>"""
    copy = write(tmp_path / "copy.html", text.replace("</body>", asks))
    title = re.search(r"<title>([^<]*)</title>", opened(copy, tmp_path / "profile").stdout)
    assert title
    up, down, kept = title[1].split(", ")
    assert up.split() == ["kinematic", "kinematic", "sixdof", "sixdof"]
    assert down.split() == up.split()[::-1]
    assert kept == "sixdof"


def test_a_browser_fetches_nothing_for_the_page(page: Path, tmp_path: Path) -> None:
    """Without the page's own policy, which would hide an attempt; the same page with a picture shows that we look."""
    asks = (
        "<script>addEventListener('load', () => document.title = "
        "performance.getEntriesByType('resource').map(e => e.name).join(' '))</script>"
    )
    picture = "http://127.0.0.1:9/picture.png"  # nothing answers there
    bare = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', asks, page.read_text(encoding="utf-8"))
    assert asks in bare
    fetched = []
    for i, text in enumerate((bare, bare.replace("</body>", f'<img src="{picture}"></body>'))):
        copy = write(tmp_path / f"copy-{i}.html", text)
        title = re.search(r"<title>([^<]*)</title>", opened(copy, tmp_path / "profile").stdout)
        assert title
        fetched.append(title[1].split())
    assert fetched == [[], [picture]]


def test_markdown_says_the_same_and_how_it_was_made(flown: Path, tmp_path: Path) -> None:
    path = tmp_path / "results.md"
    assert invoke("report", flown, "--markdown", path).exit_code == 0
    text = path.read_text(encoding="utf-8")
    assert text.startswith("# Two limits\n\nDoes it hold at 5 and at 20 deg/s?\n\nFlown by `harness run")
    for line in compared(flown)["answer"]:
        assert line in text
    widths = [[line.count("|") for line in block.splitlines()] for block in text.split("\n\n") if block.startswith("|")]
    assert widths
    assert all(len(set(counts)) == 1 for counts in widths)  # every row of a table has all its cells


def test_two_places_for_one_page_are_refused(flown: Path, tmp_path: Path) -> None:
    done = invoke("report", flown, "--out", tmp_path / "a.html", "--markdown", tmp_path / "b.md")
    assert done.exit_code == 2
    assert list(tmp_path.iterdir()) == []


def test_many_axes_of_which_few_combinations_were_flown_are_mapped_at_once() -> None:
    """Ten errors, one at a time: 3^10 combinations, of which 21 were flown."""
    names = [f"errors.a{i}" for i in range(10)]
    flown = [dict.fromkeys(names, 0.0)]
    flown += [{**flown[0], name: size} for name in names for size in (1.0, 2.0)]
    table = results(result(plant, 0, settings=errors) for plant in ("kinematic", "sixdof") for errors in flown)
    axes = {name: [0.0, 1.0, 2.0] for name in names}
    maps = grid.maps(table, axes, "range_error_rms_m", ["plant"])
    assert sum(len(each.cells) for each in maps) == 2 * len(flown)
    assert len(maps) == 2 * (1 + 2 * 8)


def test_the_summary_of_a_page_says_of_each_metric_what_the_table_says(flown: Path) -> None:
    (card,) = harness.compare(flown, by="law.max_heading_rate_deg_s").answering
    everywhere: dict[str, str] = {}
    differing: dict[str, str] = {}
    for line in change_summary(card):
        word, titles = line.split(": ", 1)
        if word.startswith("not"):
            differing.update(re.findall(r"(?:^|, )([^(,]+) \(([^)]+)\)", titles))
        else:
            everywhere.update(dict.fromkeys(titles.split(", "), word.split()[0]))
    assert everywhere
    for change in changes(card):
        found = differing.get(change.metric) or everywhere.get(change.metric, "undecided")
        assert change.found.startswith(found)
