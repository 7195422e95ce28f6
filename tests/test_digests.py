"""Thirty flights of all plants, laws, airframes and airs: none may move by a bit unless the CHANGELOG says so.

`python -m tests.test_digests` writes anew what of them is stored with the package, for `harness doctor`.
"""

import json
from collections.abc import Iterator, Mapping
from typing import Any

import pytest

from harness.doctor.stored_flights import STORED, TOLERANCE, flown, moved, stored
from harness.provenance import decides_bits

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
        "law": {"airspeed": "nominal", **LAWS[law], "standoff_m": 200.0 * airspeed / 13.0,
                "max_heading_rate_deg_s": 10.0},
        "start": {"airspeed_mps": airspeed}, "wind": AIR[air], **others,
    }  # fmt: skip
    return ", ".join([plant, airframe, law, air, *others]), flight


FLIGHTS = dict(flights())


@pytest.mark.parametrize("name", FLIGHTS)
def test_a_flight_of_all_plants_laws_and_airs_is_as_it_was_stored(name: str) -> None:
    bits, stored_flights = stored()
    then = stored_flights[name]
    assert then.flight == FLIGHTS[name]
    assert then.outcome == "completed"
    if found := moved(then, flown(FLIGHTS[name])):
        assert bits != decides_bits(), found
        assert found.relative <= TOLERANCE, found


def test_thirty_flights_are_stored_and_no_two_are_the_same() -> None:
    _, flights = stored()
    assert set(flights) == set(FLIGHTS)
    assert len({flight.digest for flight in flights.values()}) == len(FLIGHTS) >= 30


if __name__ == "__main__":
    lines = [f"{json.dumps(name)}: {json.dumps(flown(flight)._asdict())}" for name, flight in FLIGHTS.items()]
    text = ",\n".join(lines)
    STORED.write_text(f'{{"bits": {json.dumps(decides_bits())},\n"flights": {{\n{text}\n}}}}\n', encoding="utf-8")
