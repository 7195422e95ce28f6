"""Thirty flights of all plants, laws, airframes and airs: none may move by a bit unless the CHANGELOG says so.

`python -m tests.test_digests` writes `digests.json` anew.
"""

import json
import platform
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

import harness
from harness.settings import flight_from_document

STORED = Path(__file__).parent / "digests.json"
SHOWN = ("north", "east", "altitude", "heading", "airspeed", "range_error")  # of the last row
SI_TOLERANCE = 1e-5  # of the last row, on another kind of machine

AIRFRAMES = {"ultra_stick_25e": 13.0, "skywalker_x8": 13.0, "aerosonde": 25.0}
LAWS: Mapping[str, Mapping[str, Any]] = {
    "nftsm": {"name": "nftsm", "gains": "custom", "alpha2": 0.4, "alpha3": 0.2, "beta2": 2.4, "beta3": 2.0 / 3.0,
              "eta": 0.001, "k1": 0.05, "k2": 12.0, "k3": 6.0, "gamma1": 0.9},
    "nftsm paper": {"name": "nftsm", "gains": "paper"},
    "nftsm paper_1": {"name": "nftsm", "gains": "paper_1"},
    "smc": {"name": "smc", "gains": "paper"},
    "nftsm mirrored": {"name": "nftsm", "gains": "paper_1", "direction": "mirrored"},
    "nftsm course": {"name": "nftsm", "gains": "paper_1", "command": "course_rate"},
    "smc measured": {"name": "smc", "gains": "paper", "airspeed": "measured"},
}  # fmt: skip
AIR: Mapping[str, Mapping[str, Any]] = {
    "still air": {},
    "wind": {"steady_mps": [3.0, -2.0]},
    "turbulence": {"steady_mps": [2.0, 1.0], "turbulence": "moderate"},
    "gusts": {
        "shear_mps_per_m": [0.02, 0.0],
        "gusts": [{"from_s": 2.0, "to_s": 6.0, "velocity_mps": [2.0, -3.0, 1.0]}],
    },
}
MANOEUVRE = {"speed_mps": 3.0, "heading_deg": -45.0, "segments": [
    {"from_s": 3.0, "to_s": 12.0, "acceleration_mps2": 0.2, "turn_rate_deg_s": 6.0}]}  # fmt: skip


def flights() -> Iterator[tuple[str, dict[str, Any]]]:
    """Each flight's name, and its [flight] table in file units."""
    for airframe in AIRFRAMES:
        for law, air in (("nftsm", "still air"), ("smc", "wind"), ("nftsm paper_1", "turbulence"), ("smc", "gusts")):
            yield one("sixdof", airframe, law, air)
        for plant in ("lagged", "coordinated"):
            yield one(plant, airframe, "nftsm", "wind")
    for law in LAWS:
        yield one("sixdof" if law == "smc measured" else "kinematic", "ultra_stick_25e", law, "wind")
    yield one("kinematic", "ultra_stick_25e", "nftsm", "turbulence")
    yield one("lagged", "skywalker_x8", "smc", "turbulence")
    yield one("coordinated", "aerosonde", "nftsm paper_1", "gusts")
    yield one("kinematic", "ultra_stick_25e", "nftsm", "still air", estimator={"kind": "ekf"}, target=MANOEUVRE)
    yield one("sixdof", "ultra_stick_25e", "smc", "still air", estimator={"kind": "ekf"}, target=MANOEUVRE)


def one(plant: str, airframe: str, law: str, air: str, **others: Any) -> tuple[str, dict[str, Any]]:
    airspeed = AIRFRAMES[airframe]
    flight = {
        "plant": plant, "aircraft": airframe, "duration_s": 40.0, "seed": 7,
        "law": {**LAWS[law], "standoff_m": 200.0 * airspeed / 13.0, "max_heading_rate_deg_s": 10.0},
        "start": {"airspeed_mps": airspeed}, "wind": AIR[air], **others,
    }  # fmt: skip
    return ", ".join([plant, airframe, law, air, *others]), flight


def flown(flight: Mapping[str, Any]) -> dict[str, Any]:
    log = harness.simulate(flight_from_document(flight))
    last = {name: float(log[name][-1]) for name in SHOWN}
    return {"digest": log.digest, "outcome": log.outcome.value, "rows": len(log), "last": last}


def machine() -> dict[str, str]:
    """What decides the last bits beside the code: equal here, equal bits."""
    return {"machine": platform.machine(), **{name: version(name) for name in ("jsbsim", "numpy", "scipy", "filterpy")}}


FLIGHTS = dict(flights())


@pytest.mark.parametrize("name", FLIGHTS)
def test_a_flight_of_all_plants_laws_and_airs_is_as_it_was_stored(name: str) -> None:
    stored = json.loads(STORED.read_text(encoding="utf-8"))
    then, now = stored["flights"][name], flown(FLIGHTS[name])
    assert now["outcome"] == then["outcome"] == "completed"
    assert now["rows"] == then["rows"]
    assert now["last"] == pytest.approx(then["last"], rel=SI_TOLERANCE, abs=SI_TOLERANCE)
    if machine() == stored["machine"]:
        assert now["digest"] == then["digest"]


def test_thirty_flights_are_stored_and_no_two_are_the_same() -> None:
    stored = json.loads(STORED.read_text(encoding="utf-8"))["flights"]
    assert set(stored) == set(FLIGHTS)
    assert len({flight["digest"] for flight in stored.values()}) == len(FLIGHTS) >= 30


if __name__ == "__main__":
    text = json.dumps({"machine": machine(), "flights": {n: flown(f) for n, f in FLIGHTS.items()}}, indent=1)
    STORED.write_text(text + "\n", encoding="utf-8")
