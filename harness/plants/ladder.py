"""The ladder of plants: each adds one effect to the one before it, from Eq. (1) to six degrees of freedom.

A plant is one file beside this one and one entry of `PLANTS`; tables, help and references follow from the entry.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import aircraft
import autopilot
from harness.flight_errors import Errors
from harness.plants.kinematic import Kinematic
from harness.plants.plant import Plant, PlantError

_FOLDER = Path(__file__).parent


class Setup(NamedTuple):
    """The inputs from which a plant is made."""

    airframe: Path  # the airframe's folder
    airspeed: float  # nominal, m/s
    step: float  # of the 6-DOF simulation, s
    rate_trim: bool  # whether the inner loop removes the shortfall of the turn rate
    errors: Errors = Errors()  # of the aircraft


class Cost(NamedTuple):
    """Processor time, s, of a plant, without the guidance loop, on the machine of `make bench`."""

    start: float = 0.0  # once per flight
    period: float = 0.0  # per guidance period, or per 50 ms of a longer one
    step: float = 0.0  # per simulation step


def _nothing(setup: Setup) -> list[str]:
    return []


def _no_files(airframe: Path) -> Mapping[str, Path]:
    return {}


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantKind:
    """The declaration of a plant. Its place in `PLANTS` is its rung on the ladder."""

    about: str  # one sentence
    adds: str  # what it adds to the rung below, as a noun phrase
    make: Callable[[Setup], Plant]  # raises `PlantError`
    at_once: bool = False  # whether the heading rate equals its command, without lag
    has_body: bool = False  # whether it has a mass, a centre of gravity and actuators
    banks: bool = False  # whether it turns by banking, within the airframe's bank limit and airspeed envelope
    files: Callable[[Path], Mapping[str, Path]] = _no_files  # the files of an airframe that decide its flights, by name
    libraries: tuple[str, ...] = ()  # the distributions whose version decides its flights
    cost: Cost = Cost()
    warnings: Callable[[Setup], list[str]] = _nothing  # sentences that a user should know first

    @property
    def has_airframe(self) -> bool:
        """Whether an airframe decides its flights: `kinematic` has none."""
        return self.files is not _no_files


def _kinematic(setup: Setup) -> Plant:
    return Kinematic()


def _lagged(setup: Setup) -> Plant:
    from harness.plants.identified import identified  # imported when used: only the identified plants need SciPy

    return identified(setup.airframe, setup.airspeed).lagged


def _coordinated(setup: Setup) -> Plant:
    from harness.plants.identified import identified

    return identified(setup.airframe, setup.airspeed).coordinated


def _sixdof(setup: Setup) -> Plant:
    if aircraft.is_recorded(setup.airframe):
        fitted = f"{setup.airframe.name} was fitted to a recorded flight: it flies on lagged and coordinated only"
        raise PlantError("plant", fitted)
    from harness.plants.sixdof import SixDof  # imported when used: only this plant needs JSBSim

    return SixDof(setup.airframe, setup.step, setup.rate_trim, setup.errors)


def _airframe_files(airframe: Path) -> dict[str, Path]:
    names = ("airframe.toml", "inner_loop.toml")
    return {"aircraft/model": aircraft.model(airframe), **{f"aircraft/{name}": airframe / name for name in names}}


def identification_files(airframe: Path) -> dict[str, Path]:
    """The file with what is identified of an airframe, by a name for its purpose; none where it is not identified."""
    identification = aircraft.identified(airframe)
    return {_identified_name(airframe): identification} if identification.is_file() else {}


def _identified_files(airframe: Path) -> Mapping[str, Path]:
    identification = {_identified_name(airframe): aircraft.identified(airframe)}
    return identification if aircraft.is_recorded(airframe) else {**_airframe_files(airframe), **identification}


def _identified_name(airframe: Path) -> str:
    return f"aircraft/{aircraft.RECORDED if aircraft.is_recorded(airframe) else aircraft.identified(airframe).name}"


def _sixdof_files(airframe: Path) -> Mapping[str, Path]:
    return {
        "autopilot/inner_loop.xml": Path(autopilot.__file__).parent / "inner_loop.xml",
        "harness/plants/planet.xml": _FOLDER / "planet.xml",
        **_airframe_files(airframe),
    }


def _identification_warnings(setup: Setup) -> list[str]:
    from harness.plants.identified import is_stale

    warnings = []
    if is_stale(setup.airframe):
        again = f"run harness identify {aircraft.argument(setup.airframe)} --keep"
        warnings.append(f"{setup.airframe.name} has changed since it was identified: {again}")
    if not setup.rate_trim:
        warnings.append("rate_trim = false changes the plant sixdof only: this plant has no shortfall of turn rate")
    return warnings


PLANTS: Mapping[str, PlantKind] = MappingProxyType(
    {
        "kinematic": PlantKind(
            about="The paper's plant, Eq. (1): constant airspeed, level, the commanded heading rate followed at once.",
            adds="Eq. (1)",
            make=_kinematic,
            at_once=True,
        ),
        "lagged": PlantKind(
            about="The heading rate follows its command with the lag of the airframe's inner loop, gain one.",
            adds="lag of the heading rate",
            make=_lagged,
            files=_identified_files,
            cost=Cost(start=0.003, period=20e-6),
            warnings=_identification_warnings,
        ),
        "coordinated": PlantKind(
            about="Bank and airspeed have dynamics and limits of their own, and the turn is coordinated.",
            adds="bank and airspeed dynamics",
            make=_coordinated,
            banks=True,
            files=_identified_files,
            cost=Cost(start=0.003, period=45e-6),
            warnings=_identification_warnings,
        ),
        "sixdof": PlantKind(
            about="A JSBSim airframe with six degrees of freedom under its native inner loop.",
            adds="the rest of 6-DOF",
            make=_sixdof,
            has_body=True,
            banks=True,
            files=_sixdof_files,
            libraries=("jsbsim",),
            cost=Cost(start=0.003, step=6.5e-6),
        ),
    }
)
BASELINE = next(iter(PLANTS))  # the lowest rung: what the paper assumes


def rung(plant: str) -> int:
    """The place of a plant on the ladder, 0 at the bottom; -1 for an unknown plant."""
    return list(PLANTS).index(plant) if plant in PLANTS else -1
