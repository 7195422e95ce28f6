"""A guidance law of my own: a vector field around the circle, followed by feedback of the heading error.

Fly it with `harness fly FILE.toml --set law.name=THIS_FILE.py:MyLaw`, test it with `harness check THIS_FILE.py`.
Inside a law everything is in SI and radians; north-east, headings clockwise from north.
"""

from dataclasses import dataclass
from math import atan
from typing import Annotated, ClassVar

from annotated_types import Gt

from autopilot.guidance import Context, Guidance, LawStep, Observation, telling
from autopilot.quantities import About
from autopilot.standoff import Motion, StandoffLaw, standoff_step


@dataclass(frozen=True, kw_only=True)
class MyLaw(StandoffLaw):
    """The desired heading leans towards the circle by arctan(lean r); k turns the aircraft to it."""

    # The parameters: keys of [flight.law]. A plain `k: float = 0.5` will do; bounds are checked, a meaning is listed.
    # `standoff`, `max_heading_rate`, `direction`, `airspeed` and `command` come from StandoffLaw.
    gains: Annotated[str, About("the named set the gains started from")] = "custom"
    lean: Annotated[float, Gt(0), About("slope of the field towards the circle", "1/m")] = 0.02
    k: Annotated[float, Gt(0), About("feedback of the heading error", "1/s")] = 0.5

    # Named sets of the parameters, for `law.gains`; the first is the default. A law may have none.
    gain_sets: ClassVar = {"gentle": {"lean": 0.02, "k": 0.5}, "firm": {"lean": 0.02, "k": 2.0}}

    def start(self, context: Context) -> LawStep:
        """The law in flight: a new function for each flight. Its state belongs in here, never in the class.

        `context` has the guidance period, the nominal airspeed, the seed, and whether the inner loop is ideal; with
        `uses_response = True` in the class also the identified response of the aircraft, or None.
        """
        lean, k = self.lean, self.k

        def reach(motion: Motion) -> tuple[float, float, float]:
            """(feed-forward, rest of the command, s), rad/s, rad/s, rad, for a circle flown anticlockwise on a map.

            r: distance to the circle. lam_dot: rate of the tangent. heading_error: against the heading that holds the
            distance, which has the rate lam_dot + desired_dot. Wind and the target's motion are in them.
            """
            r, r_dot, lam_dot, heading_error, desired_dot = motion
            s = heading_error + atan(lean * r)
            field_dot = lean * r_dot / (1.0 + (lean * r) ** 2)
            return lam_dot + desired_dot, -field_dot - k * s, s

        step = standoff_step(self, reach)  # the geometry, the limit, and the other direction

        def told(observation: Observation) -> Guidance:
            """The command for an observation. `telling` adds channels to the log, here `law_leaning`."""
            guidance = step(observation)
            return telling(guidance, leaning=atan(lean * guidance.range_error))

        return told

    def broken_conditions(self, speed_ratio: float) -> list[str]:
        """The violated conditions of the law's theory, in sentences; `speed_ratio` is (v_t + v_w) / v_a."""
        return ["v_t + v_w is not below v_a"] if speed_ratio >= 1.0 else []

    # A law with memory returns `autopilot.guidance.Remembering(step, memory)`, which can be compiled: its step is given
    # the memory and gives back the next one. It may also have a method
    #     def linearised(self, context: Context, amplitude: float) -> autopilot.linear.Linear:
    # from (heading error, range error) to its command, from which `harness predict` computes the gain margin.
