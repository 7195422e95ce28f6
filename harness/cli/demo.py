"""`harness demo`: the main job on the paper's own case."""

from pathlib import Path

import click


@click.command()
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out/demo"), show_default=True)
def demo(out: Path) -> None:
    """The paper's stationary target, two laws, three aircraft: tables, sentences, and a Rerun recording per pair.

    \b
    Example:
      harness demo --out out/demo
    """
    import textwrap

    from rich.console import Console
    from rich.progress import Progress

    from harness.cli import _demo as job
    from harness.cli._input import writable_folder

    writable_folder(out)
    terminal = Console(stderr=True)
    flown, written = [], []
    pairs = len(job.CASES) * len(job.LAWS) * len(job.AIRFRAMES)
    with Progress(console=terminal, transient=True, disable=not terminal.is_terminal) as progress:
        flying = progress.add_task("flying", total=pairs + len(job.CASES) * len(job.LAWS))
        for one in job.fly_all():
            flown.append(one)
            progress.advance(flying)
        recording = progress.add_task("recording", total=pairs)
        for path in job.record_pairs(flown, out):
            written.append(path)
            progress.advance(recording)

    for case in job.CASES:
        those = [one for one in flown if one.case is case]
        click.secho(case.title, bold=True)
        for line in job.lines(those):
            click.echo(f"  {line}")
        for sentence in job.differences(those):
            click.echo(textwrap.fill(sentence, 110, initial_indent="- ", subsequent_indent="  "))
        click.echo()
    click.echo(f"{len(written)} recordings in {out}. To open one: .venv/bin/harness view {written[0]}")
