"""`harness reproduce`: the paper's own simulations, flown anew."""

from pathlib import Path

import click


@click.command()
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out/paper"), show_default=True)
def reproduce(out: Path) -> None:
    """The paper's tables and figures beside ours: printed lines, and a page with the figures in OUT/paper.html.

    \b
    Example:
      harness reproduce --out out/paper
    """
    from rich.console import Console
    from rich.progress import Progress

    from harness.commands.telling import writable, writable_folder
    from harness.paper import reproduce as job
    from harness.paper.page import page

    path = writable(writable_folder(out) / "paper.html")
    terminal = Console(stderr=True)
    results = []
    with Progress(console=terminal, transient=True, disable=not terminal.is_terminal) as progress:
        flying = progress.add_task("flying the paper", total=len(job.NUMBERS))
        for result in job.reproduce():
            results.append(result)
            progress.advance(flying)
        partial = path.with_suffix(".partial")
        partial.write_text(page(results), encoding="utf-8")
        partial.replace(path)
    for line in job.table(results):
        click.echo(line)
    click.echo(f"figures: {path}")
