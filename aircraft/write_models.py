"""Writes an airframe's JSBSim model from its data: `python -m aircraft.write_models [FOLDER...]`, without one all."""

import sys
import tomllib
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

import aircraft


def jsbsim_model(airframe: Path) -> str:
    """The text of the JSBSim model made from the data in the folder `airframe`."""
    data = aircraft.data(airframe)
    inner_loop = tomllib.loads((airframe / "inner_loop.toml").read_text(encoding="utf-8"))
    template = Environment(
        loader=FileSystemLoader(aircraft.FOLDER), undefined=StrictUndefined, keep_trailing_newline=True
    ).get_template("model.xml.jinja")
    rudder = data["meta"]["has_rudder"]
    elevator = data["actuators"]["elevator"]
    elevons = elevator["order"]["v"] == 2.0
    surfaces = [
        ("elevator", "actuators/elevator-command-rad", "fcs/elevator-pos-rad"),
        ("aileron", "inner-loop/aileron-rad", "fcs/left-aileron-pos-rad"),
    ] + ([("rudder", "inner-loop/rudder-rad", "fcs/rudder-pos-rad")] if rudder else [])
    return template.render(
        data,
        name=airframe.name,
        inner_loop=inner_loop,
        elevons=elevons,
        wn_squared=elevator["wn"]["v"] ** 2 if elevons else None,
        two_zeta_wn=2.0 * elevator["zeta"]["v"] * elevator["wn"]["v"] if elevons else None,
        surfaces=surfaces,
        aero_offset=data["ref"].get("aero_offset", {"v": [0.0, 0.0, 0.0]})["v"],
        thrust_offset=data["propulsion"].get("thrust_offset", {"v": [0.0, 0.0, 0.0]})["v"],
    )


if __name__ == "__main__":
    folders = [Path(name).resolve() for name in sys.argv[1:]] or [aircraft.FOLDER / name for name in aircraft.names()]
    for airframe in folders:
        aircraft.model(airframe).write_text(jsbsim_model(airframe), encoding="utf-8")
        print(f"wrote {aircraft.model(airframe)}")
