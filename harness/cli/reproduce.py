"""`harness reproduce`: the paper's own simulations, flown anew, and its claims one by one."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from textwrap import fill

import click

_EVERY = 30.0  # s, between two lines of progress where there is no terminal


@click.command()
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out/paper"), show_default=True)
@click.option("--sixdof", is_flag=True, help="Put the claims to the three 6-DOF airframes too: ten minutes more.")
@click.option("--workers", type=click.IntRange(1, 64), default=None, help="Processes; the numbers do not depend on it.")
def reproduce(out: Path, sixdof: bool, workers: int | None) -> None:
    """The paper's numbers beside ours and its claims one by one: printed, and with the figures in OUT/paper.html.

    OUT/claims.md is the ledger of the claims as a document; with --sixdof OUT/claims_sixdof.md says what is left of
    them on the airframes. Takes two to five minutes without.

    \b
    Example:
      harness reproduce --out out/paper
      harness reproduce --out out/paper --sixdof
    """
    from harness.cli._paths import writable, writable_folder
    from harness.files import replacing
    from harness.studies.paper import documents, job, ledger
    from harness.studies.paper import reproduce as numbers
    from harness.studies.paper.claims import CLAIMS
    from harness.studies.paper.page import page

    folder = writable_folder(out)
    html, document = writable(folder / "paper.html"), writable(folder / "claims.md")
    on_airframes = writable(folder / "claims_sixdof.md") if sixdof else None
    todo = job.jobs(airframes=sixdof)
    with _progress(len(todo)) as advance:
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


@contextmanager
def _progress(parts: int) -> Iterator[Callable[[], None]]:
    """What to call after each part: on a terminal a bar moves, else a line says now and then how far it is."""
    import time

    from rich.console import Console
    from rich.progress import MofNCompleteColumn, Progress

    terminal = Console(stderr=True)
    columns = (*Progress.get_default_columns(), MofNCompleteColumn())
    with Progress(*columns, console=terminal, transient=True, disable=not terminal.is_terminal) as bar:
        flying = bar.add_task("flying the paper", total=parts)
        done, told = 0, time.monotonic()

        def advance() -> None:
            nonlocal done, told
            bar.advance(flying)
            done += 1
            if not terminal.is_terminal and time.monotonic() - told >= _EVERY:
                told = time.monotonic()
                click.echo(f"flying the paper: {done} of {parts} parts", err=True)

        yield advance
