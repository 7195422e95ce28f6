"""The models that come with JSBSim, adopted one by one: which fly, and why the others do not."""

import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import click

from harness.adoption.adopt import adopt
from harness.adoption.adoption import Wish
from harness.adoption.refusal import RefusalError
from harness.files import write_text
from harness.markup import markdown
from harness.plants.model import data_root
from harness.studies.command import out_option, run

_PAGE = "adopted_models.md"


@dataclass(slots=True)
class Tried:
    """A model, what each stage found, and why it was refused, or nothing."""

    name: str
    found: dict[str, str] = field(default_factory=dict)
    refused: str = ""


def models() -> list[str]:
    """The names of all models that come with JSBSim."""
    folders = (data_root() / "aircraft").iterdir()
    return sorted((each.name for each in folders if (each / f"{each.name}.xml").is_file()), key=str.lower)


def tried(name: str) -> Tried:
    """Adopts a model into a folder that is thrown away."""
    result = Tried(name)
    with tempfile.TemporaryDirectory(prefix="harness-") as folder:
        try:
            for stage, found in adopt(name, Path(folder), Wish()):
                result.found[stage] = found
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
    yield f"`harness adopt` flies {len(flown)} of the {len(results)} models that come with JSBSim, without options."
    yield (
        f"Of the {len(powered)} whose engines answer the throttle, {len(trimmed)} have level flight. Why each of the "
        "others was refused stands below."
    )
    yield "Written by `python -m harness.studies.adopted_models` (`make adopt-all`)."
    yield ""
    yield "## Adopted"
    yield ""
    yield "Each flew a change of course by 90° and two and a half laps with the paper's law, its gains scaled."
    yield ""
    yield from _table(
        ["model", "trim", "bank loop", "90° change of course", "circle"],
        [[each.name, *(each.found[stage] for stage in ("trim", "design", "90 deg", "circle"))] for each in flown],
    )
    yield ""
    yield "## Refused"
    yield ""
    yield from _table(["model", "stage and cause"], [[each.name, each.refused] for each in results if each.refused])


def _table(headings: list[str], rows: list[list[str]]) -> Iterator[str]:
    yield f"| {' | '.join(headings)} |"
    yield f"|{'---|' * len(headings)}"
    for row in rows:
        yield f"| {' | '.join(markdown(cell).replace('|', '/') for cell in row)} |"


@click.command()
@out_option
@click.option("--workers", type=click.IntRange(1, 64), default=2, show_default=True, help="Models at a time.")
def main(out: Path, workers: int) -> None:
    """Adopt every model that comes with JSBSim, and write OUT/adopted_models.md: which fly, and why others do not."""
    with ThreadPoolExecutor(workers) as pool:
        results = []
        for result in pool.map(tried, models()):
            click.echo(f"{result.name}: {result.refused or 'adopted'}")
            results.append(result)
    write_text(out / _PAGE, page(results))
    click.echo(f"wrote {out / _PAGE}")


if __name__ == "__main__":
    run(main, "harness.studies.adopted_models")
