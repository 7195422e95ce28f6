"""The models that come with JSBSim, adopted one by one: which fly, and why the others do not."""

import math
import tempfile
import tomllib
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click

import aircraft
from harness import tables
from harness.adoption.adopt import adopt
from harness.adoption.adoption import Wish
from harness.adoption.refusal import RefusalError
from harness.files import make_folder, read
from harness.markup import markdown
from harness.plants.model import data_root
from harness.studies.command import out_option, run, write

_PAGE = "adopted_models.md"
_SECONDS = 600.0  # for a model, ten times what it has elsewhere: the page does not depend on what else the machine does
_HEADINGS = (
    "model", "airspeed, m/s", "throttle", "bank loop, rad/s", "damping", "overshoot, deg", "rate in turn",
    "altitude, m", "sideslip, deg", "radius, m", "circle, %", "in wind, %", "lag, s", "lagged, %",
)  # fmt: skip


@dataclass(slots=True)
class Tried:
    """A model, what each stage found, and why it was refused, or nothing."""

    name: str
    found: dict[str, str] = field(default_factory=dict)
    refused: str = ""
    numbers: Mapping[str, Any] = field(default_factory=dict)  # the table [adopted] of its data, once it has flown
    airspeed: float = math.nan  # m/s
    standoff: float = math.nan  # m

    def cells(self) -> list[str]:
        """Its line in the table of those that fly."""
        flown, loop = self.numbers["flown"], self.numbers["loop"]
        turn, circle, windy = flown["turn"], flown["circle"], flown["circle_in_wind"]
        sideslip = max(turn["sideslip"], circle["sideslip"])
        follows = self.numbers.get("follows", {})
        return [
            self.name, f"{self.airspeed:.1f}", f"{self.numbers['trim']['throttle']:.2f}", f"{loop['bandwidth']:.2g}",
            f"{loop['damping']:.2f}", f"{math.degrees(turn['overshoot']):.1f}", f"{turn['rate']:.3f}",
            f"{turn['altitude']:.1f}", f"{math.degrees(sideslip):.1f}", f"{self.standoff:g}",
            f"{100 * circle['error']:.2f}", f"{100 * windy['error']:.2f}", *_identified(follows),
        ]  # fmt: skip


def _identified(follows: Mapping[str, float]) -> list[str]:
    """The lag of the heading rate, and the error of the plant lagged; dashes where the aircraft is not identified."""
    return [f"{follows['lag_s']:.2g}", f"{100 * follows['lagged_error']:.1f}"] if follows else ["–", "–"]


def models() -> list[str]:
    """The names of all models that come with JSBSim."""
    folders = (data_root() / "aircraft").iterdir()
    return sorted((each.name for each in folders if (each / f"{each.name}.xml").is_file()), key=str.lower)


def tried(name: str) -> Tried:
    """Adopts a model into a folder that is thrown away."""
    result = Tried(name)
    with tempfile.TemporaryDirectory(prefix="harness-") as folder:
        try:
            for stage, found in adopt(name, Path(folder), Wish(), _SECONDS):
                result.found[stage] = found
            made = Path(folder) / name
            result.airspeed = aircraft.data(made)["envelope"]["V_design"]["v"]
            result.numbers = aircraft.adopted(made) or {}
            result.standoff = tomllib.loads(read(made / "circle.toml").decode())["flight"]["law"]["standoff_m"]
        except RefusalError as error:
            result.refused = str(error).replace(f"{data_root()}/", "")
    return result


def page(results: list[Tried]) -> str:
    """The page, in Markdown."""
    flown = [each for each in results if not each.refused]
    trimmed = [each for each in results if "trim" in each.found]
    powered = [each for each in results if "engine" in each.found]
    return "\n".join(_lines(results, flown, trimmed, powered)) + "\n"


def _lines(results: list[Tried], flown: list[Tried], trimmed: list[Tried], powered: list[Tried]) -> Iterator[str]:
    yield "# Models that come with JSBSim"
    yield ""
    inside = sum(abs(each.numbers["flown"]["turn"]["rate"] - 1.0) <= 0.05 for each in flown)
    yield f"`harness adopt` flies {len(flown)} of the {len(results)} models that come with JSBSim, without options."
    yield (
        f"Of the {len(powered)} whose engines answer the throttle, {len(trimmed)} have level flight. Why each of the "
        "others was refused stands below."
    )
    yield "Written by `python -m harness.studies.adopted_models` (`make adopt-all`)."
    yield ""
    yield "## Adopted"
    yield ""
    yield "Each flew a change of course by 90° and two and a half laps with the paper's law, its gains scaled, in still"
    yield f"air and in wind of 0.3 of its airspeed. {inside} of the {len(flown)} turn within 5 % of the commanded rate."
    far = [each.name for each in flown if not each.numbers["flown"]["circle_in_wind"]["error"] < 0.02]
    yield f"In still air all keep the circle to 2 % of its radius; in wind {', '.join(far) or 'none'} does not."
    yield ""
    yield "- *Bank loop* and *damping*: its bandwidth and the least damping with it, by design."
    yield "- *Overshoot*, *rate in turn*, *altitude*: of the change of course; rate over the command one lag before."
    yield "- *Sideslip*: the largest of both."
    yield "- *Circle*, *in wind*: the range error over the last lap, rms, in percent of the radius."
    yield "- *Lag*, *lagged*: the time to 63 % of a step, and the largest error of the identified plant `lagged` on"
    yield "  manoeuvres that it was not fitted to, in percent of the command; – where it was not identified."
    yield ""
    yield from tables.markdown(_HEADINGS, [each.cells() for each in flown], "lr")
    yield ""
    yield "## Refused"
    yield ""
    refused = [[each.name, markdown(each.refused)] for each in results if each.refused]
    yield from tables.markdown(["model", "stage and cause"], refused)


@click.command()
@out_option
@click.option("--workers", type=click.IntRange(1, 64), default=2, show_default=True, help="Models at a time.")
def main(out: Path, workers: int) -> None:
    """Adopt every model that comes with JSBSim, and write OUT/adopted_models.md: which fly, and why others do not."""
    make_folder(out)
    with ThreadPoolExecutor(workers) as pool:
        results = []
        for result in pool.map(tried, models()):
            click.echo(f"{result.name}: {result.refused or 'adopted'}")
            results.append(result)
    write(out, {_PAGE: page(results)})


if __name__ == "__main__":
    run(main, "harness.studies.adopted_models")
