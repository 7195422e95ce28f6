"""The time of a step of each law: `python -m benchmarks.law_speed [REPEATS]`."""

import sys
import timeit
from math import inf

import aircraft
from autopilot.guidance import Context, Observation
from autopilot.laws import LAWS, law
from harness.plants.identified import identified

_STEPS = 4000
_SEEN = Observation(
    150.0, 120.0, -3.0, -12.0, 13.0, -1.8, 0.0, 0.0, 0.0, 13.0, 3.0, 1.0, 10.0, 10.0, 1.0, 1.0, 0.0, 0.0
)  # fmt: skip


def main(repeats: int = 15) -> None:
    """Print the least of some repeats, us, in both directions: what else the machine does only adds."""
    context = Context(response=identified(aircraft.folder("ultra_stick_25e"), 13.0).heading_rate)
    for name in LAWS:
        least = dict.fromkeys(("paper", "mirrored"), inf)
        for direction in least:
            step = law(name, direction=direction).start(context)
            times = timeit.repeat("step(o)", number=_STEPS, repeat=repeats, globals={"step": step, "o": _SEEN})
            least[direction] = 1e6 * min(times) / _STEPS
        print(f"{name}: {least['paper']:.1f} us a step, mirrored {least['mirrored']:.1f} us")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
