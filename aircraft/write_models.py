"""Writes an airframe's JSBSim model from its data, or `--keep`s the model: see `--help`."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined, TemplateError

import aircraft


def jsbsim_model(airframe: Path) -> str:
    """The text of the JSBSim model made from the data in the folder `airframe`. Raises `AirframeError`."""
    data, inner_loop = aircraft.data(airframe), aircraft.inner_loop(airframe)
    if aircraft.adopted(airframe):
        raise aircraft.AirframeError(f"{airframe}: is an adopted model, which `harness adopt` writes; --keep keeps it")
    try:
        return _rendered(airframe.name, data, inner_loop)
    except (TemplateError, LookupError, TypeError, ArithmeticError, AttributeError) as error:
        raise aircraft.AirframeError(f"{airframe}: airframe.toml or inner_loop.toml lacks a number: {error}") from None


def _rendered(name: str, data: dict[str, Any], inner_loop: dict[str, Any]) -> str:
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
        name=name,
        inner_loop=inner_loop,
        elevons=elevons,
        wn_squared=elevator["wn"]["v"] ** 2 if elevons else None,
        two_zeta_wn=2.0 * elevator["zeta"]["v"] * elevator["wn"]["v"] if elevons else None,
        surfaces=surfaces,
        aero_offset=data["ref"].get("aero_offset", {"v": [0.0, 0.0, 0.0]})["v"],
        thrust_offset=data["propulsion"].get("thrust_offset", {"v": [0.0, 0.0, 0.0]})["v"],
    )


def write(airframe: Path) -> None:
    """Writes the model of the airframe in this folder. Raises `AirframeError` and OSError."""
    text = jsbsim_model(airframe)
    partial = aircraft.model(airframe).with_suffix(".partial")
    partial.write_text(text, encoding="utf-8")
    partial.replace(aircraft.model(airframe))
    aircraft.keep_written(airframe)


def _folder(name: str) -> Path:
    """The folder of a shipped airframe, by its name, or this folder, whose model may be missing."""
    folder = (aircraft.FOLDER / name if name in aircraft.names() else Path(name)).resolve()
    if (folder / "airframe.toml").is_file():
        return folder
    known = ", ".join(aircraft.names())
    raise aircraft.AirframeError(f"{name}: must be one of {known}, or a folder with airframe.toml")


def main(words: Sequence[str] | None = None) -> None:
    """The command."""
    parser = argparse.ArgumentParser(
        prog="python -m aircraft.write_models", description="Write the JSBSim models of airframes from their data."
    )
    parser.add_argument("airframe", nargs="*", help="a name or a folder; without one all that are shipped")
    parser.add_argument("--keep", action="store_true", help="keep the model: it goes with the data as they are")
    given = parser.parse_args(words)
    try:
        for airframe in [_folder(name) for name in given.airframe or aircraft.names()]:
            if given.keep:
                aircraft.keep_written(airframe)
                print(f"kept {aircraft.model(airframe)}")
            else:
                write(airframe)
                print(f"wrote {aircraft.model(airframe)}")
    except (aircraft.AirframeError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        raise SystemExit(2) from None


if __name__ == "__main__":
    main()
