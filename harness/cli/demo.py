"""`harness demo`: a shipped experiment, flown and compared as any other."""

from pathlib import Path

import click

from harness.cli._paths import PATH

EXPERIMENT = Path(__file__).with_name("demo.toml")


@click.command()
@click.option("--out", type=PATH, default=Path("out/demo"), show_default=True)
def demo(out: Path) -> None:
    """Fly the paper's first case, two laws on three aircraft, and compare.

    The aircraft are the paper's kinematic one and two JSBSim airframes. Prints the table of results of `harness run`,
    the answer of `harness compare`, and how to view a flight on both. All flights are recorded in OUT/flights.
    Takes about 20 s.

    \b
    Example:
      harness demo --out out/demo
    """
    import os

    from harness.cli._comparison import read_comparison
    from harness.cli._input import BadInput
    from harness.cli._matrix import fly_matrix, print_survey, surveyed
    from harness.cli._paths import writable_folder
    from harness.runs.journal import StoreError
    from harness.runs.matrix import read_matrix
    from harness.runs.run import Options, positions_done
    from harness.runs.workers import WorkersError
    from harness.settings import read_settings

    writable_folder(out)
    try:
        matrix = read_matrix(read_settings(EXPERIMENT))
        done = positions_done(matrix, out, retry_failed=False)
        size = surveyed(matrix, done=done)
        print_survey(matrix, size, len(done))
        options = Options(workers=os.cpu_count() or 1, log="all", typical=size.typical)
        progress = fly_matrix(matrix, out, options)
    except (StoreError, WorkersError) as error:
        raise BadInput(str(error)) from None
    click.echo()
    comparison, _ = read_comparison((out,))
    click.echo(comparison.answer)
    key = comparison.pairs.other["key"].iloc[0][:8]
    click.echo(
        f"\nthe full comparison: harness compare {out}\n"
        f"the first pair in the viewer: harness view {out} --pair {key}\n"
        f"all flights and their keys: harness show {out}\n"
        f"the experiment, to copy and change: {EXPERIMENT}"
    )
    raise SystemExit(1 if progress.failed or progress.unrecorded else 0)
