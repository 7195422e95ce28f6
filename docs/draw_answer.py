"""The picture of the README: one law on the paper's aircraft and on a 6-DOF one: `python -m docs.draw_answer`."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from harness.drawing import draw
from harness.log import FlightLog
from harness.loop import simulate
from harness.settings import load_flight

PICTURE = Path(__file__).parent / "images" / "answer.svg"
FILE = Path(__file__).parent.parent / "experiments" / "stationary.toml"
STYLES = {"kinematic": ("tab:blue", 2.4), "sixdof": ("tab:orange", 1.0)}  # colour, width
NAMES = {"kinematic": "kinematic aircraft (the paper's)", "sixdof": "Ultra Stick 25e (JSBSim, 6-DOF)"}


def picture(logs: dict[str, FlightLog]) -> str:
    """The SVG of these flights, by their plant."""

    def paint(figure: Figure) -> None:
        panels = figure.subplot_mosaic([["track", "error"], ["track", "command"]], width_ratios=[1.0, 1.9])
        for plant, log in logs.items():
            colour, width = STYLES[plant]
            lines = {
                "track": (log["east"], log["north"]),
                "error": (log["time"], log["range_error"]),
                "command": (log["time"], np.degrees(log["heading_rate_command"])),
            }
            for panel, (x, y) in lines.items():
                panels[panel].plot(x, y, color=colour, lw=width, label=NAMES[plant])
        panels["track"].plot(log["target_east"][:1], log["target_north"][:1], "k+", ms=9)
        panels["track"].set(aspect="equal", xlabel="east, m", ylabel="north, m", title="Track")
        panels["error"].set(title="Range error, m", xlim=(0, log["time"][-1]), ylim=(-20, 90))
        panels["error"].legend(loc="upper right", frameon=False)
        panels["command"].set(title="Heading rate commanded by the law, °/s", xlabel="s", xlim=(0, log["time"][-1]))

    return draw(paint, 9.0, 4.2)


if __name__ == "__main__":
    flight = load_flight(FILE, ["law.gains=fitted"])
    PICTURE.write_text(picture({plant: simulate(replace(flight, plant=plant)) for plant in NAMES}), encoding="utf-8")
    print(f"wrote {PICTURE.relative_to(Path.cwd())}")
