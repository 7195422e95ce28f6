"""`harness reproduce`: the paper's own simulations, flown anew, and its claims one by one."""

from pathlib import Path
from textwrap import fill

import click

from harness.cli._paths import PATH


@click.command()
@click.option("--out", type=PATH, default=Path("out/paper"), show_default=True)
@click.option("--sixdof", is_flag=True, help="Check the claims on the three 6-DOF airframes too: ten minutes more.")
@click.option(
    "--workers", type=click.IntRange(1, 64), default=None, help="Number of processes; the results do not depend on it."
)
def reproduce(out: Path, sixdof: bool, workers: int | None) -> None:
    """Fly the paper's simulations and check its claims.

    Prints the numbers of the paper beside ours, then each claim with its verdict. OUT/paper.html holds both with the
    figures, OUT/claims.md summarises which claims hold, OUT/claims.csv gives each claim with its numbers; with
    --sixdof OUT/claims_sixdof.md summarises which hold on the airframes. Takes two to five minutes.

    \b
    Examples:
      harness reproduce --out out/paper
      harness reproduce --out out/paper --sixdof
    """
    from harness.cli._paths import writable, writable_folder
    from harness.cli._progress import progress
    from harness.files import write_text
    from harness.studies.paper import documents, job, ledger
    from harness.studies.paper import reproduce as numbers
    from harness.studies.paper.claims import CLAIMS
    from harness.studies.paper.page import page

    folder = writable_folder(out)
    html, document, table = (writable(folder / name) for name in ("paper.html", "claims.md", "claims.csv"))
    on_airframes = writable(folder / "claims_sixdof.md") if sixdof else None
    todo = job.jobs(airframes=sixdof)
    with progress("flying the paper", len(todo)) as advance:
        everything = job.everything(todo, workers or job.workers(), advance)
    written = {
        html: page(everything),
        document: documents.claims_page(CLAIMS, everything.decisions),
        table: documents.claims_csv(CLAIMS, everything.decisions),
    }
    if on_airframes:
        written[on_airframes] = documents.airframes_page(CLAIMS, everything.decisions)
    for path, text in written.items():
        write_text(path, text)
    for line in numbers.table(everything.numbers):
        click.echo(line)
    click.echo(f"\n{fill(f'Ours, with one thing read differently: {numbers.VARIANTS_IN_WORDS}.', 120)}")
    for line in numbers.moved(everything.numbers):
        click.echo(line)
    click.echo("\nThe claims:")
    for line in ledger.ledger_lines(CLAIMS, everything.decisions):
        click.echo(line)
    click.echo(f"\nfigures and claims: {html}\nclaims: {document}, each with its numbers: {table}")
    if on_airframes:
        click.echo(f"claims on the airframes: {on_airframes}")
