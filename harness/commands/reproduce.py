"""`harness reproduce`: the paper's own simulations, flown anew, and its claims one by one."""

from pathlib import Path
from textwrap import fill

import click


@click.command()
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out/paper"), show_default=True)
@click.option("--workers", type=click.IntRange(1, 64), default=None, help="Processes; the numbers do not depend on it.")
def reproduce(out: Path, workers: int | None) -> None:
    """The paper's numbers beside ours and its claims one by one: printed, and with the figures in OUT/paper.html.

    OUT/claims.md is the ledger of the claims as a document. Takes two to five minutes.

    \b
    Example:
      harness reproduce --out out/paper
    """
    from rich.console import Console
    from rich.progress import MofNCompleteColumn, Progress

    from harness.commands.telling import writable, writable_folder
    from harness.paper import job, ledger
    from harness.paper import reproduce as numbers
    from harness.paper.claims import CLAIMS
    from harness.paper.page import page

    folder = writable_folder(out)
    html, document = writable(folder / "paper.html"), writable(folder / "claims.md")
    terminal = Console(stderr=True)
    columns = (*Progress.get_default_columns(), MofNCompleteColumn())
    with Progress(*columns, console=terminal, transient=True, disable=not terminal.is_terminal) as progress:
        flying = progress.add_task("flying the paper", total=len(job.jobs()))
        everything = job.everything(workers or job.workers(), lambda: progress.advance(flying))
    for path, text in ((html, page(everything)), (document, ledger.markdown(CLAIMS, everything.findings))):
        partial = path.with_suffix(".partial")
        partial.write_text(text, encoding="utf-8")
        partial.replace(path)
    for line in numbers.table(everything.numbers):
        click.echo(line)
    click.echo(f"\n{fill(f'Ours, with one thing read differently: {numbers.VARIANTS_TOLD}.', 120)}")
    for line in numbers.moved(everything.numbers):
        click.echo(line)
    click.echo("\nThe claims:")
    for line in ledger.told(CLAIMS, everything.findings):
        click.echo(line)
    click.echo(f"\nfigures and claims: {html}\nclaims: {document}")
