"""The pictures of the documents, drawn by the viewer: `python -m harness.review.screenshots [FOLDER]`."""

import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from rerun.experimental import ViewerClient

from harness.log import FlightLog
from harness.loop import simulate
from harness.review.recording import write_recording
from harness.review.viewer import headless
from harness.settings import flight_from_document

FOLDER = Path("docs/images")
TABS = ("overview", "circle", "cursor", "aircraft", "target", "notes")
_SETTLES = 1.0  # s: the viewer first draws, then fetches data that it lacks
_GREETINGS = 6.0  # s: how long its messages at the start cover a corner


class Screenshot(NamedTuple):
    """Pictures of some tabs of one recording, at one time in s."""

    name: str
    title: str
    at: float
    tabs: tuple[str, ...]


def main(folder: Path) -> None:
    """Flies the flights and takes the pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        path = Path(temporary) / "flights.rrd"
        for picture, logs in _pictures():
            write_recording(path, logs, picture.title, command="python -m harness.review.screenshots")
            with headless(path) as viewer:
                time.sleep(_GREETINGS)
                for tab in picture.tabs:
                    shot = folder / (f"{picture.name}.png" if tab == "overview" else f"{picture.name}-{tab}.png")
                    shoot(viewer, tab, picture.at, shot)
                    _shrink(shot)
                    print(shot)


def shoot(viewer: ViewerClient, tab: str, at: float, path: Path) -> None:
    """A picture of one tab at a time, s."""
    layout = viewer.get_blueprint().blueprint
    containers = [entity["ContainerBlueprint"] for entity in layout.values() if "ContainerBlueprint" in entity]
    (tabs,) = [container for container in containers if container.get("container_kind") == "Tabs"]
    names = TABS if len(tabs["contents"]) == len(TABS) else (*TABS[:3], "differences", *TABS[3:])
    tabs["active_tab"] = tabs["contents"][names.index(tab)]
    viewer.set_blueprint(layout, of="recording")
    viewer.set_time("sim_time", duration=at, play_state="paused")
    for _ in range(2):
        viewer.save_screenshot(str(path.resolve()))
        time.sleep(_SETTLES)
    viewer.save_screenshot(str(path.resolve()))


def _shrink(path: Path) -> None:
    """Reduces a picture to 256 colours: a third of the size, without a visible loss."""
    from PIL import Image  # Matplotlib's

    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(256, dither=Image.Dither.NONE)
    small.save(path, optimize=True)


def _pictures() -> Iterator[tuple[Screenshot, Mapping[str, FlightLog]]]:
    moving = {"target": {"speed_mps": 2.0, "heading_deg": 20.0}, "estimator": {"kind": "ekf"}}
    gusty = {"wind": {"steady_mps": [2.0, 0.0], "turbulence": "light"}}
    single = _flown("sixdof", 10.0, moving | gusty)
    yield (
        Screenshot("one-flight", "A moving target, estimated, in light turbulence", 60.0, TABS),
        {"ultra_stick_25e": single},
    )
    windy = {"wind": {"steady_mps": [3.0, 0.0]}}
    plants = ("kinematic", "lagged", "coordinated", "sixdof")
    pair = {plant: _flown(plant, 8.0, windy) for plant in ("kinematic", "sixdof")}
    yield Screenshot("pair", "3 m/s of wind, NFTSM_1", 27.0, ("overview", "cursor")), pair
    four = {plant: _flown(plant, 10.0, gusty) for plant in plants}
    yield Screenshot("plants", "The same flight on each plant, light turbulence", 40.0, ("overview",)), four


def _flown(plant: str, limit_deg_s: float, others: Mapping[str, object]) -> FlightLog:
    law = {"name": "nftsm", "gains": "paper_1", "max_heading_rate_deg_s": limit_deg_s}
    return simulate(flight_from_document({"plant": plant, "duration_s": 120.0, "law": law, **others}))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
