"""`harness reproduce`: the paper's own simulations, flown anew, and its claims one by one."""

from pathlib import Path
from textwrap import fill

import click


@click.command()
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out/paper"), show_default=True)
@click.option("--sixdof", is_flag=True, help="Check the claims on the three 6-DOF airframes too: ten minutes more.")
@click.option(
    "--workers", type=click.IntRange(1, 64), default=None, help="Number of processes; the results do not depend on it."
)
def reproduce(out: Path, sixdof: bool, workers: int | None) -> None:
    """Fly the paper's simulations and check its claims.

    Prints the numbers of the paper beside ours, then each claim with its verdict. OUT/paper.html holds both with the
    figures, OUT/claims.md the claims alone; with --sixdof OUT/claims_sixdof.md holds the claims on the airframes.
    Takes two to five minutes.

    \b
    Examples:
      harness reproduce --out out/paper
      harness reproduce --out out/paper --sixdof
    """
    from harness.cli._paths import writable, writable_folder
    from harness.cli._progress import progress
    from harness.files import replacing
    from harness.studies.paper import documents, job, ledger
    from harness.studies.paper import reproduce as numbers
    from harness.studies.paper.claims import CLAIMS
    from harness.studies.paper.page import page

    folder = writable_folder(out)
    html, document = writable(folder / "paper.html"), writable(folder / "claims.md")
    on_airframes = writable(folder / "claims_sixdof.md") if sixdof else None
    todo = job.jobs(airframes=sixdof)
    with progress("flying the paper", len(todo)) as advance:
        everything = job.everything(todo, workers or job.workers(), advance)
    written = {html: page(everything), document: documents.markdown(CLAIMS, everything.findings)}
    if on_airframes:
        written[on_airframes] = documents.airframes_markdown(CLAIMS, everything.findings)
    for path, text in written.items():
        with replacing(path) as partial:
            partial.write_text(text, encoding="utf-8")
    for line in numbers.table(everything.numbers):
        click.echo(line)
    click.echo(f"\n{fill(f'Ours, with one thing read differently: {numbers.VARIANTS_TOLD}.', 120)}")
    for line in numbers.moved(everything.numbers):
        click.echo(line)
    click.echo("\nThe claims:")
    for line in ledger.told(CLAIMS, everything.findings):
        click.echo(line)
    click.echo(f"\nfigures and claims: {html}\nclaims: {document}")
    if on_airframes:
        click.echo(f"claims on the airframes: {on_airframes}")
