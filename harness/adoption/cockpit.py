"""FlightGear's properties of cockpit controls and engine instruments, which a model may read.

Such a property has no writer outside FlightGear, so an adopted model reads JSBSim's own in its place.
"""

import re
from collections.abc import Iterable

_ENGINE = re.compile(r"/(?:controls/engines|engines)/engine(?:\[(\d+)\])?/(.+)")
_TANK = re.compile(r"/consumables/fuel/tank(?:\[(\d+)\])?/(.+)")
_OF_ENGINE = {  # by the last part of the name, in the same unit
    "mixture": "fcs/mixture-cmd-norm[{}]",
    "propeller-pitch": "fcs/advance-cmd-norm[{}]",
    "starter": "propulsion/starter_cmd",
    "cutoff": "propulsion/cutoff_cmd",
    "running": "propulsion/engine[{}]/set-running",
    "rpm": "propulsion/engine[{}]/engine-rpm",
    "thruster/rpm": "propulsion/engine[{}]/propeller-rpm",
    "n1": "propulsion/engine[{}]/n1",
    "n2": "propulsion/engine[{}]/n2",
    "mp-inhg": "propulsion/engine[{}]/map-inhg",
    "mp-osi": "propulsion/engine[{}]/map-inhg",
    "cht-degf": "propulsion/engine[{}]/cht-degF",
    "egt-degf": "propulsion/engine[{}]/egt-degF",
    "oil-temperature-degf": "propulsion/engine[{}]/oil-temperature-degF",
    "oil-pressure-psi": "propulsion/engine[{}]/oil-pressure-psi",
    "itt_degC": "propulsion/engine[{}]/itt-c",
    "fuel-flow-gph": "propulsion/engine[{}]/fuel-flow-rate-gph",
    "thrust-lbs": "propulsion/engine[{}]/thrust-lbs",
}
_OF_TANK = {"level-lb": "propulsion/tank[{}]/contents-lbs", "level-lbs": "propulsion/tank[{}]/contents-lbs"}
_FLIGHT = {
    "/controls/flight/elevator": "fcs/elevator-cmd-norm",
    "/controls/flight/aileron": "fcs/aileron-cmd-norm",
    "/controls/flight/rudder": "-fcs/rudder-cmd-norm",  # FlightGear's rudder is positive to the right
    "/controls/flight/flaps": "fcs/flap-cmd-norm",
    "/controls/flight/speedbrake": "fcs/speedbrake-cmd-norm",
    "/controls/gear/gear-down": "gear/gear-cmd-norm",
}


def throttles(names: Iterable[str], engines: int) -> tuple[str, ...]:
    """The throttles of the cockpit, of engine after engine, that these names of properties have."""
    known = {name.replace("[0]", "") for name in names}
    all_of_them = (f"/controls/engines/engine[{i}]/throttle" for i in range(engines))
    return tuple(name for name in all_of_them if name.replace("[0]", "") in known)


def source_of(name: str) -> str | None:
    """The property of JSBSim whose value FlightGear would write into the one of this name; None for others."""
    for pattern, table in ((_ENGINE, _OF_ENGINE), (_TANK, _OF_TANK)):
        if (found := pattern.fullmatch(name)) and found[2] in table:
            return table[found[2]].format(found[1] or 0)
    return _FLIGHT.get(name)
