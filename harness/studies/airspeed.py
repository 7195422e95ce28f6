"""Which airspeed should a law compute with? `python -m harness.studies.airspeed RUN` writes airspeed.md.

`make airspeed` flies the run first.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

from harness.runs.results import load_results
from harness.studies.command import out_option, run, write
from harness.template import template

if TYPE_CHECKING:
    import pandas as pd

ALIKE = 1e-3  # m: errors that are no further apart are alike
AIRSPEEDS = ("nominal", "measured", "ground")
_CONDITION = ["aircraft", "wind_speed_mps", "errors.wind_mps", "wind.turbulence"]


class ByAirspeed(NamedTuple):
    """An airframe in one air: the means over the seeds by the airspeed that the law computes with."""

    airframe: str
    air: str
    flights: int  # with each airspeed
    error: tuple[float, ...]  # range_error_rms_m, in the order of `AIRSPEEDS`
    activity: tuple[float, ...]  # command_activity_deg_s2
    nearest: int  # seeds in which `ground` has the smallest error of the three

    @property
    def apart(self) -> float:
        """The largest difference between the errors, m."""
        return max(self.error) - min(self.error)


def lines(flights: "pd.DataFrame") -> Iterator[ByAirspeed]:
    """One for each airframe in each air, in the order in which they were set."""
    speeds = [(north**2 + east**2) ** 0.5 for north, east in flights["wind.steady_mps"]]
    table = flights.assign(wind_speed_mps=speeds)
    for (airframe, speed, wrong, severity), group in table.groupby(_CONDITION, sort=False):
        by_seed = group.pivot_table(index="seed", columns="law.airspeed", values="range_error_rms_m")
        activity = group.groupby("law.airspeed")["command_activity_deg_s2"].mean()
        wind = f"wind of {speed:g} m/s" if speed else "no wind"
        if wrong:
            wind += f", estimated wrong by {wrong:g} m/s"
        yield ByAirspeed(
            airframe=str(airframe),
            air=f"{wind}, {severity} turbulence" if severity != "none" else wind,
            flights=len(by_seed),
            error=tuple(float(by_seed[one].mean()) for one in AIRSPEEDS),
            activity=tuple(float(activity[one]) for one in AIRSPEEDS),
            nearest=int((by_seed["ground"] <= by_seed[["nominal", "measured"]].min(axis=1)).sum()),
        )


def page(flights: "pd.DataFrame") -> str:
    """The page."""
    found = list(lines(flights))
    return template("harness.studies", "airspeed.md.jinja").render(lines=found, airspeeds=AIRSPEEDS, alike=ALIKE) + "\n"


@click.command()
@click.argument("directory", metavar="RUN", type=click.Path(exists=True, path_type=Path))
@out_option
def main(directory: Path, out: Path) -> None:
    """Write OUT/airspeed.md, which airspeed a law should compute with, from a run of experiments/airspeed.toml.

    \b
    Example:
        python -m harness.studies.airspeed out/airspeed
    """
    write(out, {"airspeed.md": page(load_results(directory))})


if __name__ == "__main__":
    run(main, "harness.studies.airspeed")
