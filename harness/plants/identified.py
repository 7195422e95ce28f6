"""The identified inner loop of an airframe: the file `identified.toml`, for the plants `lagged` and `coordinated`."""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

import aircraft
import autopilot
from autopilot.response import Response
from harness.plants.coordinated import AirspeedHold, Coordinated
from harness.plants.lagged import Lagged
from harness.plants.plant import PlantError
from harness.toml_text import tables_of

_NEAR = 0.05  # relative: an identification holds for airspeeds this close to its own


class IdentifiedError(PlantError):
    """The airframe is not identified at this airspeed, or its file is damaged; the message names the command to run."""

    def __init__(self, message: str) -> None:
        super().__init__("start.airspeed", message)


class Sweep(NamedTuple):
    """A flown sweep of small commands: flown over commanded heading rate, a value per frequency, slowest first."""

    frequency: tuple[float, ...]  # rad/s
    gain: tuple[float, ...]
    phase: tuple[float, ...]  # rad, counted on beyond a whole turn; negative where the aircraft lags

    def at(self, omega: float) -> tuple[float, float]:
        """(gain, phase in rad) at a frequency in rad/s, between the flown ones; NaN beyond them."""
        if not self.frequency[0] <= omega <= self.frequency[-1]:
            return math.nan, math.nan
        known, at = np.log(self.frequency), math.log(omega)
        return float(np.interp(at, known, self.gain)), float(np.interp(at, known, self.phase))


@dataclass(frozen=True, slots=True, kw_only=True)
class Identified:
    """Linear responses of an airframe under its inner loop at one airspeed. SI, rad."""

    airspeed: float
    heading_rate: Response  # from its command, with the rate trim
    bank: Response | None  # from its command, without the rate trim; None where only heading rates were commanded
    hold: AirspeedHold
    bank_limit: float  # of the inner loop's command
    measured: Mapping[str, float]  # figures of the flown step and sweep, by name
    errors: Mapping[str, tuple[float, float]]  # by validation manoeuvre: (lagged, coordinated), RMS over the command's
    sweep: Sweep | None = None  # of the smallest commands swept; None in a file of an earlier version

    @property
    def lagged(self) -> Lagged:
        return Lagged(self.heading_rate)

    @property
    def coordinated(self) -> Coordinated:
        """Raises `PlantError` if the response of the bank is unknown."""
        if self.bank is None:
            raise PlantError(
                "plant", "coordinated requires the response of the bank, which the log does not give: use lagged"
            )
        return Coordinated(self.bank, self.hold, self.bank_limit)


def identified(airframe: Path, airspeed: float) -> Identified:
    """The identification nearest to this airspeed, m/s. Raises `IdentifiedError` when none is within 5 %."""
    known = read(airframe)
    near = min(known, key=lambda entry: abs(entry.airspeed - airspeed), default=None)
    if near is None or abs(near.airspeed - airspeed) > _NEAR * near.airspeed:
        speeds = ", ".join(f"{entry.airspeed:g}" for entry in known)
        if aircraft.is_recorded(airframe):
            raise IdentifiedError(f"{airframe.name} was recorded at {speeds} m/s, the flight is at {airspeed:g} m/s")
        at = f"identified at {speeds} m/s" if known else "not identified"
        raise IdentifiedError(
            f"{airframe.name} is {at}, the flight is at {airspeed:g} m/s: "
            f"run harness identify {aircraft.argument(airframe)} --airspeed {airspeed:g} --keep"
        )
    return near


def read(airframe: Path) -> list[Identified]:
    """All identifications of an airframe, by airspeed; none without a file. `IdentifiedError` if it is damaged."""
    file = aircraft.identified(airframe)
    if not file.is_file():
        return []
    try:
        return list(_entries(file.read_text(encoding="utf-8")))
    except (AttributeError, LookupError, TypeError, ValueError, ArithmeticError) as error:
        again = f"run harness identify {aircraft.argument(airframe)} --keep"
        if aircraft.is_recorded(airframe):
            again = "write it anew with harness assess --fit"
        raise IdentifiedError(f"{file}: is damaged ({type(error).__name__}: {error}): {again}") from None


@lru_cache(maxsize=16)
def _entries(text: str) -> tuple[Identified, ...]:
    """All identifications in the text of a file, by airspeed."""
    return tuple(sorted((_from(table) for table in tables_of(text)["at"]), key=lambda entry: entry.airspeed))


def is_stale(airframe: Path) -> bool:
    """Whether the airframe's model or its inner loop has changed since it was identified. OSError without the file."""
    if aircraft.is_recorded(airframe):
        return False
    return _model(aircraft.identified(airframe).read_text(encoding="utf-8")) != model_digest(airframe)


@lru_cache(maxsize=16)
def _model(text: str) -> object:
    """The hash of the model that was identified, from the text of a file."""
    return tables_of(text).get("model")


def model_digest(airframe: Path) -> str:
    """A hash, 32 hex digits, of the airframe's JSBSim model and of the inner loop."""
    inner_loop = Path(autopilot.__file__).parent / "inner_loop.xml"
    content = aircraft.model(airframe).read_bytes() + inner_loop.read_bytes()
    return hashlib.blake2b(content, digest_size=16).hexdigest()


def document(airframe: Path, known: list[Identified]) -> str:
    """The text of `identified.toml` with these identifications."""
    command = f"harness identify {airframe.name}"  # no path of the machine in a file that travels
    lines = [
        f"# Written by `{command}`: what the plants lagged and coordinated fly by. SI, rad.",
        "",
        f'model = "{model_digest(airframe)}" # of the model and inner loop that were flown',
    ]
    for entry in sorted(known, key=lambda entry: entry.airspeed):
        lines += ["", *table_of(entry)]
    return "\n".join(lines) + "\n"


def table_of(entry: Identified, source: str = "flown on sixdof") -> list[str]:
    """The lines of one identification in a file; `source` is where the measured numbers are from."""
    lines = ["[[at]]", f"airspeed = {entry.airspeed:g}", f"bank_limit = {entry.bank_limit:g}"]
    bank = [("bank", asdict(entry.bank), "from its command, the rate trim off: coordinated")] if entry.bank else []
    for title, values, about in (
        ("heading_rate", asdict(entry.heading_rate), "from its command, the rate trim on: lagged"),
        *bank,
        ("hold", asdict(entry.hold), "what the load factor beyond one does to the airspeed: coordinated"),
        ("measured", entry.measured, source),
    ):
        lines += [f"[at.{title}] # {about}", *(f"{name} = {value:.5g}" for name, value in values.items())]
    lines.append(
        "[at.errors] # of the heading rate, RMS over the command's, [lagged, coordinated]; not used in the fit"
    )
    lines += [f'"{name}" = [{a:.4f}, {b:.4f}]' for name, (a, b) in entry.errors.items()]
    if entry.sweep:
        lines.append("[at.sweep] # of small commands, flown on sixdof: heading rate over its command, rad/s, 1, rad")
        lines += [
            f"{name} = [{', '.join(f'{v:.5g}' for v in values)}]"
            for name, values in zip(Sweep._fields, entry.sweep, strict=True)
        ]
    return lines


def _from(table: Mapping[str, Any]) -> Identified:
    return Identified(
        airspeed=float(table["airspeed"]),
        heading_rate=Response(**_numbers(table["heading_rate"])),
        bank=Response(**_numbers(table["bank"])) if "bank" in table else None,
        hold=AirspeedHold(**_numbers(table["hold"])),
        bank_limit=float(table["bank_limit"]),
        measured=MappingProxyType(_numbers(table["measured"])),
        errors=MappingProxyType({name: (float(a), float(b)) for name, (a, b) in table["errors"].items()}),
        sweep=_sweep(table["sweep"]) if "sweep" in table else None,
    )


def _sweep(table: Mapping[str, Any]) -> Sweep:
    return Sweep._make(tuple(float(value) for value in table[name]) for name in Sweep._fields)


def _numbers(table: Mapping[str, Any]) -> dict[str, float]:
    return {name: float(value) for name, value in table.items()}
