"""Which law, in which air? `python -m harness.studies.which_law RUN` writes which_law.md from experiments/laws.toml."""

import csv
import io
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click
import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure

from harness.drawing import COLOURS, FAINT, draw
from harness.margins import Assess
from harness.runs.comparable import comparable
from harness.studies.command import out_option, run, write
from harness.studies.floor import FloorAt, read_floor
from harness.studies.floor_model import between
from harness.tables import markdown
from harness.template import template
from harness.verdict.pairs import entered, spread
from harness.verdict.ranking import Ranking, Relation, Reordered, Standing, Tie, rankings
from harness.verdict.statistics import evidence, holm, sample

if TYPE_CHECKING:
    import pandas as pd

REFERENCE, AIRCRAFT = "kinematic", "sixdof"
ERROR, ACTIVITY = "range_error_rms_m", "command_activity_deg_s2"
TIES = {ERROR: Tie(0.2, 0.001), ACTIVITY: Tie(0.2, 0.05)}  # m, deg/s^2
PAPERS = "nftsm scaled"
STILL, TURBULENCE = "still air", "moderate turbulence"
_MARKERS = ("o", "s", "^", "D", "v", "P")
_SMALLEST = {ERROR: 1e-4, ACTIVITY: 1e-2}  # drawn; less is drawn there


def condition(flight: "pd.Series") -> str:
    """The condition of a flight in a few words; speeds are shares of its airspeed."""
    wind, target = (flight[key] / flight["start.airspeed_mps"] for key in ("wind_speed_mps", "target.speed_mps"))
    words = [
        f"wind of {100.0 * wind:.0f} %" if wind else "",
        f"{flight['wind.turbulence']} turbulence" if flight["wind.turbulence"] != "none" else "",
        f"target at {100.0 * target:.0f} %" if target else "",
        "filter" if flight["estimator.kind"] == "ekf" else "",
    ]
    return ", ".join(filter(None, words)) or STILL


def judged(flights: "pd.DataFrame") -> "pd.DataFrame":
    """The flights as they are ranked: with the columns law and condition, lost ones without numbers."""
    table = spread(entered(flights, Assess().circling_error))
    return table.assign(condition=[condition(row) for _, row in table.iterrows()])


class Compared(NamedTuple):
    """An airframe in a condition: the orders by range error and by activity."""

    condition: str
    aircraft: str
    error: Ranking
    activity: Ranking

    @property
    def changes(self) -> list[Reordered]:
        """Pairs of laws in another order by error on the aircraft than on the reference, or tied on one only."""
        return self.error.changes(AIRCRAFT)

    @property
    def reversed(self) -> int:
        """How many of them are reversals."""
        return sum(change.is_reversal for change in self.changes)

    @property
    def efficient(self) -> list[str]:
        """Those of which no other is better by error or activity and not worse by the other one, on the aircraft."""
        error, activity = self.error.orders[AIRCRAFT], self.activity.orders[AIRCRAFT]
        laws = [law for law in error.places if law in activity.places]

        def beaten(a: str, b: str) -> bool:
            relations = error.relation(b, a), activity.relation(b, a)
            return Relation.BETTER in relations and set(relations) <= {Relation.BETTER, Relation.TIE}

        return [a for a in laws if not any(beaten(a, b) for b in laws if b != a)]

    @property
    def efficient_in_words(self) -> str:
        """The efficient laws, or the others where these are fewer."""
        efficient = self.efficient
        others = [law for law in self.error.orders[AIRCRAFT].places if law not in efficient]
        if len(others) >= len(efficient):
            return ", ".join(efficient)
        return f"all but {', '.join(others)}" if others else "all"


def compared(table: "pd.DataFrame") -> list[Compared]:
    """Every condition on every airframe; by condition, still air first."""
    by = [list(rankings(table, metric, tie, ["condition", "aircraft"])) for metric, tie in TIES.items()]
    each = [Compared(str(e.at["condition"]), str(e.at["aircraft"]), e, a) for e, a in zip(*by, strict=True)]
    order = list(dict.fromkeys(c.condition for c in each))
    return sorted(each, key=lambda c: (order.index(c.condition), c.aircraft))


class Above(NamedTuple):
    """A law on an airframe in turbulence, above the floor."""

    law: str
    aircraft: str
    error: float  # m rms, over all seeds
    activity: float  # deg/s^2
    on_reference: float  # deg/s^2, its activity on the kinematic aircraft
    times: float  # its error over the floor's at its activity
    low: float  # 95 % interval over the seeds
    high: float
    floor: FloorAt  # at its mean activity

    @property
    def is_below(self) -> bool:
        """Whether it flies below the floor, beyond the intervals of both: then the floor's model is wrong."""
        return self.high * self.floor.error < self.floor.low


def level(levels: Sequence[FloorAt], activity: float) -> FloorAt:
    """The floor at an activity, between its published points."""
    error, low, high = (
        between(activity, [(point.activity, getattr(point, name)) for point in levels])
        for name in ("error", "low", "high")
    )
    return FloorAt(levels[0].airframe, activity, error, low, high)


def above_floor(table: "pd.DataFrame", floors: Mapping[str, Sequence[FloorAt]]) -> Iterator[Above]:
    """Every law on every airframe in turbulence that has a floor; the nearest to it first.

    Squares are averaged over the seeds, as the floor does: the mean of errors, each of a short time, lies below it.
    """
    there = table[(table["condition"] == TURBULENCE) & ~table["lost"].astype(bool)]
    found = []
    for (of_law, of_aircraft), rows in there.groupby(["law", "aircraft"], sort=False):
        law, aircraft = str(of_law), str(of_aircraft)
        flown, kinematic = rows[rows["plant"] == AIRCRAFT], rows[rows["plant"] == REFERENCE]
        levels = floors.get(aircraft, ())
        if not len(flown) or not levels or flown[ACTIVITY].min() < min(point.activity for point in levels):
            continue  # so calm a law has no floor
        activity = float(flown[ACTIVITY].mean())
        floor = level(levels, activity)
        squares = sample(flown[ERROR].to_numpy() ** 2, flown["seed"].tolist(), drawn=True)
        low, high = squares.interval() or (math.nan, math.nan)
        error, least, most = (math.sqrt(max(square, 0.0)) for square in (squares.mean, low, high))
        on_reference = float(kinematic[ACTIVITY].mean())
        found.append(
            Above(law, aircraft, error, activity, on_reference, error / floor.error, least / floor.error,
                  most / floor.error, floor)
        )  # fmt: skip
    mean = {law: np.mean([each.times for each in found if each.law == law]) for law in {each.law for each in found}}
    yield from sorted(found, key=lambda each: (mean[each.law], each.law, each.aircraft))


def beaten_by(of: Compared, law: str, plant: str) -> tuple[int, int]:
    """How many laws are shown to be better by error on a plant, and of how many."""
    order = of.error.orders[plant]
    others = [other for other in order.places if other != law]
    return sum(order.relation(other, law) is Relation.BETTER for other in others), len(others)


def kept(table: "pd.DataFrame") -> dict[tuple[str, str], list[str]]:
    """By condition and airframe the laws that keep the paper's promise on the aircraft.

    That is the error of the paper's law on the reference: shown, seed by seed, to be no larger than a tie is.
    """
    tie, laws = TIES[ERROR], {}
    for (of_condition, of_aircraft), rows in table.groupby(["condition", "aircraft"], sort=False):
        by_seed = rows.pivot(index="seed", columns=["plant", "law"], values=ERROR).dropna(axis="columns")
        if (REFERENCE, PAPERS) not in by_seed or AIRCRAFT not in by_seed:
            continue
        promised, flown = by_seed[REFERENCE, PAPERS], by_seed[AIRCRAFT]
        p = holm([evidence(tie.ratios(promised, flown[law], drawn=True), None, tie.bound).holds for law in flown])
        shown = np.asarray(p) <= Assess().significance
        laws[str(of_condition), str(of_aircraft)] = [str(law) for law in flown.columns[shown]]
    return laws


def keepers_table(keepers: Mapping[tuple[str, str], Sequence[str]]) -> Iterator[str]:
    """The table, in Markdown, of `kept`: on which airframes each law keeps the promise in each condition."""
    conditions = list(dict.fromkeys(condition for condition, _ in keepers))
    airframes = sorted({airframe for _, airframe in keepers})
    times = Counter(law for laws in keepers.values() for law in laws)
    rows = []
    for law in sorted(times, key=lambda law: (-times[law], law)):
        on = [[each for each in airframes if law in keepers.get((condition, each), ())] for condition in conditions]
        rows.append([law, *("all" if each == airframes else ", ".join(each) or "none" for each in on)])
    return markdown(["law", *conditions], rows)


def reversals(each: Sequence[Compared]) -> Iterator[str]:
    """A list, in Markdown, for each law that falls behind others that it is better than on the reference."""
    for of in each:
        here, there = of.error.orders[REFERENCE].places, of.error.orders[AIRCRAFT].places
        behind: dict[str, list[str]] = {}
        for change in filter(lambda change: change.is_reversal, of.changes):
            law, other = (change.law, change.other) if change.there is Relation.WORSE else (change.other, change.law)
            behind.setdefault(law, []).append(other)
        for law, others in behind.items():
            yield (
                f"- {of.condition}, {of.aircraft} (n = {there[law].seeds}): {law}, {_shown(here[law])} → "
                f"{_shown(there[law])} m, falls behind"
            )
            yield from (f"  - {other}, {_shown(here[other])} → {_shown(there[other])} m" for other in others)


def _shown(place: Standing) -> str:
    low_high = f" [{place.low:.3g}, {place.high:.3g}]" if place.low < place.high else ""
    return f"{place.mean:.3g}{low_high}"


def paint(figure: Figure, each: Sequence[Compared], floors: Mapping[str, Sequence[FloorAt]]) -> None:
    """Error against activity, an airframe in each row and a condition in each column."""
    conditions, airframes = (list(dict.fromkeys(names)) for names in zip(*((c[0], c[1]) for c in each), strict=True))
    laws = sorted({law for of in each for law in of.error.orders[AIRCRAFT].places})
    panels = figure.subplots(len(airframes), len(conditions), sharex=True, sharey=True, squeeze=False)
    for of in each:
        axes = panels[airframes.index(of.aircraft), conditions.index(of.condition)]
        for i, law in enumerate(laws):
            points = [_drawn(of, law, plant) for plant in (REFERENCE, AIRCRAFT)]
            if None in points:
                continue
            on_reference, there = np.array(points)
            colour, marker = COLOURS[i % len(COLOURS)], _MARKERS[(i + i // len(COLOURS)) % len(_MARKERS)]
            axes.plot(*np.array(points).T, "-", color=colour, linewidth=0.5, zorder=1)
            axes.plot(*on_reference, marker, color=colour, markerfacecolor="white", markersize=4.0, zorder=2)
            axes.plot(*there, marker, color=colour, markersize=5.0, zorder=3, label=law)
        if of.condition == TURBULENCE and of.aircraft in floors:
            known = np.array([(point.activity, point.error) for point in floors[of.aircraft]])
            axes.plot(*known.T, color="black", linewidth=1.0, label="floor")
        axes.set(xscale="log", yscale="log", xlim=(0.005, 300.0), ylim=(5e-5, 50.0))
        axes.minorticks_off()
        axes.axhline(TIES[ERROR].least, color=FAINT, linewidth=0.6, linestyle=":")
    for axes, of_condition in zip(panels[0], conditions, strict=True):
        axes.set_title(of_condition, fontsize=8)
    for axes, airframe in zip(panels[:, 0], airframes, strict=True):
        axes.set_ylabel(f"{airframe}\nerror, m rms", fontsize=8)
    for axes in panels[-1]:
        axes.set_xlabel("activity, °/s²", fontsize=8)
    named: dict[str, Artist] = {}
    for axes in panels.flat:
        handles, labels = axes.get_legend_handles_labels()
        named |= dict(zip(labels, handles, strict=True))
    figure.legend(list(named.values()), list(named), loc="outside lower center", ncols=5, fontsize=7)


def _drawn(of: Compared, law: str, plant: str) -> tuple[float, float] | None:
    """Where a law on a plant is drawn; None where it has no place."""
    means = []
    for ranking in (of.activity, of.error):
        place = ranking.orders[plant].places.get(law)
        if place is None:
            return None
        means.append(max(place.mean, _SMALLEST[ranking.metric]))
    return means[0], means[1]


KEEPS = "keeps the promise"  # of a column of which_law.csv: yes or no, of laws on the aircraft


def places_csv(each: Sequence[Compared], keepers: Mapping[tuple[str, str], Sequence[str]]) -> str:
    """Every law on every plant in every condition: means and 95 % intervals, and by how many it is shown beaten.

    `keepers` are the laws that keep the paper's promise: see `kept`.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    numbers = [f"{name} {end}".strip() for name in (ERROR, ACTIVITY) for end in ("", "low", "high")]
    writer.writerow(("condition", "airframe", "plant", "law", *numbers, "seeds", "laws better by error", "of", KEEPS))
    for of in each:
        for plant, order in of.error.orders.items():
            for law, place in order.places.items():
                activity = of.activity.orders[plant].places.get(law)
                cells = [f"{x:.4g}" for p in (place, activity) if p for x in (p.mean, p.low, p.high)]
                beaten = beaten_by(of, law, plant)
                keeps = ("yes" if law in keepers[of.condition, of.aircraft] else "no") if plant == AIRCRAFT else ""
                writer.writerow((of.condition, of.aircraft, plant, law, *cells, place.seeds, *beaten, keeps))
    return text.getvalue()


def page(table: "pd.DataFrame", each: Sequence[Compared], above: Sequence[Above], folder: str) -> str:
    """The page."""
    by_law: dict[str, dict[str, Above]] = {}
    for one in above:
        by_law.setdefault(one.law, {})[one.aircraft] = one
    overstated = [one.on_reference / one.activity for one in above]
    keeping = kept(table)
    beaten = [(beaten_by(of, PAPERS, REFERENCE), beaten_by(of, PAPERS, AIRCRAFT)) for of in each] if keeping else []
    fields = {
        "folder": folder,
        "each": each,
        "conditions": list(dict.fromkeys(of.condition for of in each)),
        "airframes": sorted({of.aircraft for of in each}),
        "laws": sorted(table["law"].unique()),
        "seeds": int(table["seed"].nunique()),
        "flights": len(table),
        "limit": [f"{limit:g}" for limit in sorted(table["law.max_heading_rate_deg_s"].unique())],
        "airspeed": sorted(table["law.airspeed"].unique()),
        "aircraft": AIRCRAFT,
        "reference": REFERENCE,
        "ties": TIES,
        "error": ERROR,
        "activity": ACTIVITY,
        "turbulence": TURBULENCE,
        "reversed": list(reversals(each)),
        "above": by_law,
        "below": [one for one in above if one.is_below],
        "overstated": (min(overstated), max(overstated)) if overstated else None,
        "beaten_by": beaten_by,
        "papers": PAPERS,
        "kept": list(keepers_table(keeping)),
        "keepers": Counter(law for laws in keeping.values() for law in laws).most_common(2),
        "most_beaten": [max((count[0] for count in counts), default=0) for counts in zip(*beaten, strict=True)]
        + [max((on_aircraft[1] for _, on_aircraft in beaten), default=0)],
        "turned": {
            "pairs": sum(of.reversed for of in each),
            "of": sum(of.error.undecided(AIRCRAFT)[1] for of in each),
            "where": list(dict.fromkeys(of.condition for of in each if of.reversed)),
        },
        "lost": Counter(
            (law, of.condition) for of in each for order in of.error.orders.values() for law in order.left_out
        ),
        "number": lambda x: "–" if math.isnan(x) else f"{x:.2f}",
    }
    return template("harness.studies", "which_law.md.jinja").render(fields) + "\n"


@click.command()
@click.argument("directory", metavar="RUN", type=click.Path(path_type=Path, exists=True, file_okay=False))
@click.option(
    "--floor",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    default=Path("docs/answers/floor.csv"),
    show_default=True,
    help="The floor, as python -m harness.studies.floor writes it.",
)
@out_option
def main(directory: Path, floor: Path, out: Path) -> None:
    """Write OUT/which_law.md with its figure and table from the flights of experiments/laws.toml in RUN."""
    table, floors = judged(comparable([directory]).flights), read_floor(floor)
    each = compared(table)
    write(
        out,
        {
            "which_law.svg": draw(partial(paint, each=each, floors=floors), 11.0, 7.0),
            "which_law.csv": places_csv(each, kept(table)),
            "which_law.md": page(table, each, list(above_floor(table, floors)), str(directory)),
        },
    )


if __name__ == "__main__":
    run(main, "harness.studies.which_law")
