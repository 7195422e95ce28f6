"""What an airframe was identified as: the file beside it that the plants `lagged` and `coordinated` fly by."""

import hashlib
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import aircraft
import autopilot
from harness.plants.coordinated import AirspeedHold, Coordinated
from harness.plants.lagged import Lagged
from harness.plants.plant import PlantError
from harness.plants.response import Response

_NEAR = 0.05  # of the airspeed: farther from it the response is another


class IdentifiedError(PlantError):
    """There is no identification for this airframe at this airspeed; the text says what to do."""

    def __init__(self, message: str) -> None:
        super().__init__("start.airspeed", message)


@dataclass(frozen=True, slots=True, kw_only=True)
class Identified:
    """An airframe with its inner loop at one airspeed, as linear responses. SI, rad."""

    airspeed: float
    heading_rate: Response  # from its command, with the rate trim
    bank: Response  # from its command, without the rate trim
    hold: AirspeedHold
    bank_limit: float  # of the inner loop's command
    measured: Mapping[str, float]  # of the flown step and sweep
    errors: Mapping[str, tuple[float, float]]  # of lagged and coordinated in each held-out manoeuvre, RMS / command's

    @property
    def lagged(self) -> Lagged:
        return Lagged(self.heading_rate)

    @property
    def coordinated(self) -> Coordinated:
        return Coordinated(self.bank, self.hold, self.bank_limit)


def identified(airframe: Path, airspeed: float) -> Identified:
    """The identification nearest to this airspeed. Raises `IdentifiedError` without one within 5 %."""
    known = read(airframe)
    near = min(known, key=lambda one: abs(one.airspeed - airspeed), default=None)
    if near is None or abs(near.airspeed - airspeed) > _NEAR * near.airspeed:
        speeds = ", ".join(f"{one.airspeed:g}" for one in known)
        at = f"identified at {speeds} m/s" if known else "not identified"
        raise IdentifiedError(
            f"{airframe.name} is {at}, the flight is at {airspeed:g} m/s: "
            f"run harness identify {called(airframe)} --airspeed {airspeed:g}"
        )
    return near


def read(airframe: Path) -> list[Identified]:
    """All identifications of an airframe, by airspeed; none without the file. `IdentifiedError` for a damaged file."""
    file = aircraft.identified(airframe)
    if not file.is_file():
        return []
    try:
        tables = tomllib.loads(file.read_text(encoding="utf-8"))["at"]
        return sorted((_from(table) for table in tables), key=lambda one: one.airspeed)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, KeyError, TypeError, ValueError) as error:
        again = f"run harness identify {called(airframe)}"
        raise IdentifiedError(f"{file}: is damaged ({type(error).__name__}: {error}): {again}") from None


def is_stale(airframe: Path) -> bool:
    """Whether the model or its inner loop has changed since it was identified."""
    text = aircraft.identified(airframe).read_text(encoding="utf-8")
    return tomllib.loads(text).get("model") != model_digest(airframe)


def model_digest(airframe: Path) -> str:
    """A hash of the airframe's model and of the inner loop."""
    inner_loop = Path(autopilot.__file__).parent / "inner_loop.xml"
    content = aircraft.model(airframe).read_bytes() + inner_loop.read_bytes()
    return hashlib.blake2b(content, digest_size=16).hexdigest()


def document(airframe: Path, known: list[Identified]) -> str:
    """The file's text."""
    lines = [
        f"# Written by `harness identify {called(airframe)}`: what the plants lagged and coordinated fly by. SI, rad.",
        "",
        f'model = "{model_digest(airframe)}" # of the model and inner loop that were flown',
    ]
    for one in sorted(known, key=lambda one: one.airspeed):
        lines += ["", "[[at]]", f"airspeed = {one.airspeed:g}", f"bank_limit = {one.bank_limit:g}"]
        for title, values, about in (
            ("heading_rate", asdict(one.heading_rate), "from its command, the rate trim on: lagged"),
            ("bank", asdict(one.bank), "from its command, the rate trim off: coordinated"),
            ("hold", asdict(one.hold), "what the load factor beyond one does to the airspeed: coordinated"),
            ("measured", one.measured, "flown on sixdof"),
        ):
            lines += [f"[at.{title}] # {about}", *(f"{name} = {value:.5g}" for name, value in values.items())]
        lines.append(
            "[at.errors] # of the heading rate, RMS over the command's, [lagged, coordinated]; not used in the fit"
        )
        lines += [f'"{name}" = [{a:.4f}, {b:.4f}]' for name, (a, b) in one.errors.items()]
    return "\n".join(lines) + "\n"


def _from(table: Mapping[str, Any]) -> Identified:
    return Identified(
        airspeed=float(table["airspeed"]),
        heading_rate=Response(**_numbers(table["heading_rate"])),
        bank=Response(**_numbers(table["bank"])),
        hold=AirspeedHold(**_numbers(table["hold"])),
        bank_limit=float(table["bank_limit"]),
        measured=MappingProxyType(_numbers(table["measured"])),
        errors=MappingProxyType({name: (float(a), float(b)) for name, (a, b) in table["errors"].items()}),
    )


def _numbers(table: Mapping[str, Any]) -> dict[str, float]:
    return {name: float(value) for name, value in table.items()}


def called(airframe: Path) -> str:
    """What the user calls the airframe: its name, or its folder."""
    return airframe.name if airframe.parent == aircraft.FOLDER else str(airframe)
