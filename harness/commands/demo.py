"""`harness demo`: the main job on the paper's own case."""

from pathlib import Path

import click

SHOWN = {
    "settles to 1 m [s]": "convergence_time_s",
    "range error rms, last half [m]": "range_error_rms_m",
    "range error peak, last half [m]": "range_error_peak_m",
    "overshoot [m]": "overshoot_m",
    "saturated, last half [-]": "saturation_fraction",
    "command activity [deg/s2]": "command_activity_deg_s2",
    "heading rate error rms [deg/s]": "heading_rate_error_rms_deg_s",
    "bank peak [deg]": "bank_peak_deg",
    "sideslip peak [deg]": "sideslip_peak_deg",
}


@click.command()
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out/demo"), show_default=True)
def demo(out: Path) -> None:
    """The paper's stationary target, two laws, three aircraft: tables, sentences, and a Rerun recording per pair.

    \b
    Example:
      harness demo --out out/demo
    """
    from rich.console import Console
    from rich.progress import Progress
    from rich.table import Table

    from harness import demo as job
    from harness.commands.telling import number

    console, progress_to = Console(), Console(stderr=True)
    flown, written = [], []
    count = len(job.CASES) * len(job.LAWS) * (1 + len(job.AIRFRAMES))
    with Progress(console=progress_to, transient=True, disable=not progress_to.is_terminal) as progress:
        flying = progress.add_task("flying", total=count)
        for one in job.fly_all():
            flown.append(one)
            progress.advance(flying)
        recording = progress.add_task("recording", total=len(job.CASES) * len(job.LAWS) * len(job.AIRFRAMES))
        for path in job.record_pairs(flown, out):
            written.append(path)
            progress.advance(recording)

    for case in job.CASES:
        those = [one for one in flown if one.case is case]
        table = Table(title=case.title, title_justify="left", title_style="bold", min_width=110)
        table.add_column("")
        for one in those:
            table.add_column(f"{one.law}\n{one.plant}", justify="right")
        for label, metric in SHOWN.items():
            table.add_row(label, *(number(one.metrics[metric]) for one in those))
        console.print(table)
        for sentence in job.differences(those):
            console.print(f"- {sentence}", highlight=False, soft_wrap=False)
        console.print()
    console.print(f"{len(written)} recordings in {out}; open one: .venv/bin/rerun {written[0]}", highlight=False)
