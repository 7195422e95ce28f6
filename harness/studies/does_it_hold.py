"""Does coordinated flight hold? `python -m harness.studies.does_it_hold RUN GAINS` writes does_it_hold.md.

RUN is the directory of `experiments/assumption.toml`, GAINS that of `experiments/quiet_gains.toml` (`make verdict`).
Every statement names its condition, its numbers and its n, and the command that repeats it.
"""

import csv
import io
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

from harness.files import replacing, write_text
from harness.margins import Assess
from harness.runs.comparable import comparable
from harness.studies.command import out_option, run, write
from harness.studies.which_law import KEEPS, keepers_table
from harness.template import template
from harness.verdict.answer import interval, plain, signed, unit_of
from harness.verdict.answer import share as share_text
from harness.verdict.comparison import Comparison, Scorecard, compare_flights
from harness.verdict.conditions import conclude
from harness.verdict.effects import Disturbed, disturbances
from harness.verdict.following import with_predicted
from harness.verdict.judgement import Judgement
from harness.verdict.pairs import entered, is_drawn
from harness.verdict.parts import PARTS, Group, with_shares
from harness.verdict.statistics import Share, share
from harness.vocabulary import SIGNS, Verdict

if TYPE_CHECKING:
    import pandas as pd

PLANTS = ("kinematic", "sixdof")
PAPERS_LIMIT = 5.0  # deg/s
MAIN_LAW = "nftsm fitted"  # the paper's law with the gains that give its Table 3
OTHER_TOLERANCES = ("convergence_time_half_tolerance_s", "convergence_time_double_tolerance_s")
QUIET = (
    "--where wind.turbulence=none --where 'wind.steady_mps=[0.0, 0.0]' --where estimator.kind=truth "
    "--where guidance_period_s=0.05 --where law.airspeed=nominal"
)


class Statement(NamedTuple):
    """A sentence, and the options of `harness compare RUN` that repeat it."""

    text: str
    options: str


class PartCell(NamedTuple):
    """A part on an airframe at a limit and on a circle: the word over all laws, and the worst of them."""

    word: Verdict
    worst: Judgement

    @property
    def text(self) -> str:
        return f"{SIGNS[self.word]} {plain(abs(self.worst.difference))}"


def core(flights: "pd.DataFrame") -> "pd.DataFrame":
    """The undisturbed flights: still air, the target known, the shortest guidance period, the nominal airspeed."""
    still = flights["wind.steady_mps"].map(lambda wind: not any(wind)).astype(bool)
    quiet: pd.DataFrame = flights[
        still
        & (flights["wind.turbulence"] == "none")
        & (flights["estimator.kind"] == "truth")
        & (flights["guidance_period_s"] == flights["guidance_period_s"].min())
        & (flights["law.airspeed"] == "nominal")
    ].reset_index(drop=True)
    return quiet


def compared(flights: "pd.DataFrame", assess: Assess) -> Comparison:
    """The 6-DOF flights beside the kinematic ones."""
    return compare_flights(flights[flights["plant"].isin(PLANTS)].reset_index(drop=True), assess)


def still_air(comparison: Comparison) -> Iterator[Statement]:
    """At the paper's limit, on the paper's circle: whether each law converges, when, and whether it cycles."""
    table = comparison.table
    for card in comparison.scorecards:
        for law in _laws(card):
            cell = _at(card, law, PAPERS_LIMIT)
            if cell is None:
                continue
            flown = table[_mask(table, card.aircraft, law, PAPERS_LIMIT)]
            shares = [
                f"{int(rows['converged'].sum())} of {len(rows)} on {plant}"
                for plant in PLANTS
                if len(rows := flown[flown["plant"] == plant])
            ]
            clauses = [f"converges in {' and '.join(shares)}"]
            clauses += _clauses(card, cell, _at_other_tolerances(flown))
            clauses.append(_cycle(flown[flown["plant"] == PLANTS[1]]))
            options = f"{QUIET} --where aircraft={card.aircraft} --where law.max_heading_rate_deg_s={PAPERS_LIMIT:g}"
            yield Statement(f"{card.aircraft}, {law}: {'; '.join(clauses)}.", options)


def _at_other_tolerances(flown: "pd.DataFrame") -> list[float]:
    """The mean differences of the convergence times at half of the tolerance and at twice of it, s."""
    by_plant = flown.set_index("seed").groupby("plant")
    first, second = (by_plant.get_group(plant) for plant in PLANTS)
    return [float((second[name] - first[name]).mean()) for name in OTHER_TOLERANCES]


def _clauses(card: Scorecard, at: Mapping[str, object], others: list[float]) -> Iterator[str]:
    """How much later the law converges than on the kinematic aircraft, and by how much more it errs on the circle."""
    cell = {j.column: j for j in card.judgements if dict(j.at) == at and j.pairs}
    if (time := cell.get("convergence_time_s")) is not None:
        low, high = time.low, time.high
        if low < 0.0 < high:
            text = f"not shown to converge later or sooner ({number(time)}, n = {time.pairs})"
        else:
            when = "later" if time.difference > 0 else "sooner"
            least, most = sorted((abs(low), abs(high)))
            between = f" [{plain(least)}, {plain(most)}]" if low < high else ""
            text = f"{plain(abs(time.difference))}{between} s {when} (n = {time.pairs})"
        if any(other * time.difference < 0 for other in others):
            told = ", ".join(f"{signed(other)} s" for other in others)
            text += f", a sign that changes with the tolerance ({told} at half and at twice of it)"
        yield text
    if (error := cell.get("range_error_rms_m")) is not None:
        yield f"settled error {number(error)} (n = {error.pairs})"


def _cycle(flown: "pd.DataFrame") -> str:
    of = _cycling(flown)
    if not of.of:
        return "whether it is in a limit cycle is not known"
    text = f"in a limit cycle in {of.number} of {of.of} flights"
    if not of.number:
        return f"{text} (at most {plain(100.0 * of.high)} %)"
    cycling = flown[flown["chatters"] == 1.0]
    hertz, swing = cycling["limit_cycle_hz"].median(), cycling["limit_cycle_amplitude_deg_s"].median()
    return f"{text} ({hertz:.2g} Hz, ±{swing:.2g} deg/s)"


def _cycling(flown: "pd.DataFrame") -> Share:
    """In how many flights a limit cycle shows, of those in which it can be told."""
    known = flown.dropna(subset="chatters")
    return share(known["chatters"].to_numpy() == 1.0, known["seed"].to_numpy(), drawn=is_drawn(flown))


class Followed(NamedTuple):
    """How a law's commands are followed at the paper's limit: predicted from the inner loop, and observed in flight."""

    aircraft: str
    law: str
    gain: float  # at low frequency
    delay: float  # s, at the law's crossover
    margin: float  # to the limit cycle
    predicted_hz: float
    predicted_swing: float  # deg/s
    cycling: int
    of: int
    observed_hz: float
    observed_swing: float  # deg/s


def followed(comparison: Comparison) -> Iterator[Followed]:
    """Of every airframe and law."""
    table = comparison.table
    for card in comparison.scorecards:
        for law in _laws(card):
            rows = table[_mask(table, card.aircraft, law, PAPERS_LIMIT) & (table["plant"] == PLANTS[1])]
            if not len(rows):
                continue
            cycling = rows[rows["chatters"] == 1.0]
            first = rows.iloc[0]
            yield Followed(
                card.aircraft, law, float(first["heading_rate_gain_slow"]), float(first["heading_rate_delay_s"]),
                float(first["limit_cycle_margin"]), float(first["predicted_cycle_hz"]),
                float(first["predicted_cycle_amplitude_deg_s"]), len(cycling), int(rows["chatters"].notna().sum()),
                float(cycling["limit_cycle_hz"].median()) if len(cycling) else math.nan,
                float(cycling["limit_cycle_amplitude_deg_s"].median()) if len(cycling) else math.nan,
            )  # fmt: skip


class PartMatrix(NamedTuple):
    """Parts by airframe and condition."""

    columns: list[tuple[str, float, float]]  # airframe, limit deg/s, radius m
    rows: list[tuple[str, str, list[PartCell | None]]]  # part, unit, cells


def matrix(comparison: Comparison) -> PartMatrix:
    """The parts of coordinated flight, over all laws, at each limit and on each circle."""
    columns = [
        (card.aircraft, limit, radius)
        for card in comparison.scorecards
        for limit, radius in sorted({_circle(judgement) for judgement in card.judgements}, key=lambda c: (c[0], -c[1]))
    ]
    rows = []
    for part in PARTS.values():
        if part.group is Group.COORDINATED:
            cells = [_cell(comparison, part.column, *column) for column in columns]
            if any(cells):
                rows.append((part.title, part.unit, cells))
    return PartMatrix(columns, rows)


def _cell(comparison: Comparison, column: str, aircraft: str, limit: float, radius: float) -> PartCell | None:
    card = next(card for card in comparison.scorecards if card.aircraft == aircraft)
    judgements = [judgement for judgement in card.of(column) if _circle(judgement) == (limit, radius)]
    if not judgements:
        return None
    worst = max(judgements, key=lambda judgement: (judgement.word == Verdict.FAILS, judgement.use))
    return PartCell(conclude(judgements, {}).word, worst)


def _circle(judgement: Judgement) -> tuple[float, float]:
    at = judgement.at
    return _number(at, "law.max_heading_rate_deg_s"), _number(at, "law.standoff_m")


def _number(at: object, key: str) -> float:
    value = at.get(key) if isinstance(at, dict) else None
    return float(value) if isinstance(value, int | float) else math.nan


def disturbed(flights: "pd.DataFrame", assess: Assess) -> list[Disturbed]:
    """What each disturbance alone adds at the paper's limit, with the paper's law."""
    table = with_shares(entered(flights[flights["plant"].isin(PLANTS)].reset_index(drop=True), assess.circling_error))
    law = (table["law.name"] + " " + table["law.gains"]) == MAIN_LAW
    limited = table["law.max_heading_rate_deg_s"] == PAPERS_LIMIT
    return list(disturbances(table[law & limited].reset_index(drop=True), PLANTS))


class Gains(NamedTuple):
    """What a pair of reaching gains of NFTSM does on an airframe, beside the kinematic aircraft."""

    aircraft: str
    k2: float  # 1/s
    k3: float
    margin: float  # to the limit cycle
    cycle: Share  # of the flights in a limit cycle
    converged: list[int]  # flights on each plant
    seeds: int
    costs: Mapping[str, Judgement]  # metric -> its difference, where it is known


def quieter(comparison: Comparison) -> Iterator[Gains]:
    """Of every airframe and pair of gains of `experiments/quiet_gains.toml`."""
    table = comparison.table
    for card in comparison.scorecards:
        here = table[table["aircraft"] == card.aircraft]
        for k2 in sorted(here["law.k2"].unique(), reverse=True):
            flown = here[here["law.k2"] == k2]
            aircraft = flown[flown["plant"] == PLANTS[1]]
            costs = {j.column: j for j in card.judgements if j.at["law.k2"] == k2 and j.pairs}
            converged = [int(flown.loc[flown["plant"] == plant, "converged"].sum()) for plant in PLANTS]
            yield Gains(
                card.aircraft, float(k2), float(flown["law.k3"].iloc[0]), float(aircraft["limit_cycle_margin"].iloc[0]),
                _cycling(aircraft), converged, int(aircraft["seed"].nunique()), costs,
            )  # fmt: skip


def remedy(gains: Iterable[Gains]) -> str:
    """What the smallest gains do on all airframes, in a sentence."""
    of = list(gains)
    least, most = min(each.k2 for each in of), max(each.k2 for each in of)
    quiet = [each for each in of if each.k2 == least]
    errors = [abs(end) for each in quiet for e in [each.costs["range_error_rms_m"]] for end in (e.low, e.high)]
    times = [each.costs["convergence_time_s"].difference for each in quiet]
    return (
        f"k2 = {plain(least)} /s instead of {plain(most)} leaves "
        f"{sum(each.cycle.number for each in quiet)} of {sum(each.cycle.of for each in quiet)} flights in a limit "
        f"cycle (95 % interval: at most {plain(100.0 * max(each.cycle.high for each in quiet))} % on each airframe), "
        f"a settled error within {plain(max(errors))} m rms of the kinematic one, "
        f"and a convergence {', '.join(map(plain, times))} s later "
        f"({', '.join(each.aircraft for each in quiet)}; n = {quiet[0].seeds} each)."
    )


def _laws(card: Scorecard) -> list[str]:
    return list(dict.fromkeys(str(judgement.at["law"]) for judgement in card.judgements if "law" in judgement.at))


def _at(card: Scorecard, law: str, limit: float) -> dict[str, object] | None:
    """The cell of this law at this limit, on the widest circle."""
    there = [
        dict(judgement.at)
        for judgement in card.judgements
        if judgement.at.get("law") == law and _circle(judgement)[0] == limit
    ]
    return max(there, key=lambda at: _number(at, "law.standoff_m"), default=None)


def _mask(table: "pd.DataFrame", aircraft: str, law: str, limit: float) -> "pd.Series[bool]":
    named = (table["law.name"] + " " + table["law.gains"]) == law
    chosen: pd.Series[bool] = (table["aircraft"] == aircraft) & named & (table["law.max_heading_rate_deg_s"] == limit)
    return chosen


def number(judgement: Judgement) -> str:
    """A difference with its interval and unit."""
    unit = unit_of(judgement.column)
    return f"{signed(judgement.difference)}{interval(judgement.low, judgement.high)} {unit}".strip()


def short_answer(comparison: Comparison) -> Iterator[str]:
    """The head of the page and of the README: a sentence for each thing that is asked."""
    at_limit = matrix(comparison)
    for aircraft in dict.fromkeys(column[0] for column in at_limit.columns):
        i = next(i for i, column in enumerate(at_limit.columns) if column[:2] == (aircraft, PAPERS_LIMIT))
        clauses = []
        for word in (Verdict.HOLDS, Verdict.FAILS, Verdict.UNDECIDED):
            parts = [
                f"{title} ({plain(abs(cell.worst.difference))} {unit})"
                for title, unit, cells in at_limit.rows
                if (cell := cells[i]) is not None and cell.word is word
            ]
            if parts:
                clauses.append(f"{word}: {', '.join(parts)}")
        n = next(card.seeds for card in comparison.scorecards if card.aircraft == aircraft)
        yield f"{aircraft}: {'; '.join(clauses)} (n = {n})."


def page(
    flights: "pd.DataFrame", gains: "pd.DataFrame", assess: Assess, folders: Sequence[str], places: str
) -> tuple[str, str]:
    """The page, and README's block."""
    quiet = core(flights)
    comparison = compared(quiet, assess)
    pairs_of_gains = list(quieter(compared(gains, assess)))
    fields = {
        "folder": folders[0],
        "gains_folder": folders[1],
        "gains": pairs_of_gains,
        "remedy": remedy(pairs_of_gains),
        "number": number,
        "share": share_text,
        "limit": PAPERS_LIMIT,
        "law": MAIN_LAW,
        "quiet": QUIET,
        "short": list(short_answer(comparison)),
        "still": list(still_air(comparison)),
        "matrix": matrix(comparison),
        "followed": list(followed(comparison)),
        "disturbed": disturbed(flights, assess),
        "plain": lambda x: "–" if x is None or math.isnan(x) else plain(x),
        "signed": signed,
        "interval": interval,
        "assess": assess,
        "degrees": math.degrees,
        "signs": SIGNS,
        "last_line": last_line(places),
    }
    texts = [template("harness.studies", name).render(fields) for name in ("does_it_hold.md.jinja", "answer.md.jinja")]
    return texts[0] + "\n", texts[1].strip() + "\n"


def keepers(places: str) -> dict[tuple[str, str], list[str]]:
    """By condition and airframe the laws that keep the paper's promise, from the text of which_law.csv."""
    found: dict[tuple[str, str], list[str]] = {}
    for row in csv.DictReader(io.StringIO(places)):
        if row[KEEPS]:
            laws = found.setdefault((row["condition"], row["airframe"]), [])
            laws += [row["law"]] if row[KEEPS] == "yes" else []
    return found


def last_line(places: str) -> str:
    """With which law and gains the promise is kept on each airframe, in which air."""
    return template("harness.studies", "keepers.md.jinja").render(kept=list(keepers_table(keepers(places)))).strip()


def in_readme(readme: str, block: str) -> str:
    """README with its answer replaced."""
    return re.sub(
        r"(<!-- answer -->\n).*?(<!-- /answer -->)", lambda m: f"{m[1]}{block}{m[2]}", readme, flags=re.DOTALL
    )


def rows_kept(flights: "pd.DataFrame") -> "pd.DataFrame":
    """The rows of both plants, without what the sentences do not need: the committed files of the tests."""
    kept = flights[flights["plant"].isin(PLANTS)].drop(columns=["run", "version", "seconds"], errors="ignore")
    constant = [c for c in kept.columns if c.startswith(("estimator.", "target.", "wind.", "inner_loop.", "metrics."))]
    needed = ("wind.steady_mps", "wind.turbulence", "estimator.kind")
    return kept.drop(columns=[c for c in constant if c not in needed]).reset_index(drop=True)


def _folder() -> click.Path:
    return click.Path(path_type=Path, exists=True, file_okay=False)


@click.command()
@click.argument("directory", metavar="RUN", type=_folder())
@click.argument("gains", metavar="GAINS", type=_folder())
@click.option("--readme", type=click.Path(path_type=Path, dir_okay=False), help="Write the answer here too.")
@click.option(
    "--laws",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    default=Path("docs/answers/which_law.csv"),
    show_default=True,
    help="Which laws keep the promise, as python -m harness.studies.which_law writes it.",
)
@click.option("--rows", type=_folder(), help="Keep the rows of the undisturbed flights and of GAINS in this folder.")
@out_option
def main(directory: Path, gains: Path, laws: Path, readme: Path | None, rows: Path | None, out: Path) -> None:
    """Write OUT/does_it_hold.md from the flights of experiments/assumption.toml and quiet_gains.toml."""
    flights, assess, *_ = comparable([directory])
    flights, of_gains = with_predicted(flights), with_predicted(comparable([gains]).flights)
    text, block = page(flights, of_gains, assess, (str(directory), str(gains)), laws.read_text(encoding="utf-8"))
    write(out, {"does_it_hold.md": text})
    if readme is not None:
        write_text(readme, in_readme(readme.read_text(encoding="utf-8"), block))
        click.echo(readme)
    if rows is not None:
        for name, table in (("assumption_core", core(flights)), ("quiet_gains", of_gains)):
            with replacing(rows / f"{name}.parquet") as partial, partial.open("wb") as file:
                rows_kept(table).to_parquet(file, index=False)
            click.echo(rows / f"{name}.parquet")


if __name__ == "__main__":
    run(main, "harness.studies.does_it_hold")
