"""The thresholds and margins of the verdict, the table [assess] of a file; each with where its default comes from.

Sources: *Part 60*: 14 CFR Part 60, Appendices C and D, how closely a flight simulator must follow the aircraft it
stands for. *ACS*: FAA-S-ACS-6, what a pilot's steep turn at 45 deg of bank is allowed. *Ours*: a choice, with its
reason.
"""

import math
from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Gt, Lt

from autopilot.quantities import About, Degrees, Metres, Unit

DegreesPerSecond2 = Annotated[float, Unit("deg_s2", math.pi / 180.0)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Assess:
    """The margins of the verdict. Relative ones and shares are numbers; the rest in SI, rad."""

    airspeed_deviation: Annotated[
        float, Gt(0), About("rms over nominal airspeed. Ours: 5 % of airspeed is 5 % of turn rate at the same bank")
    ] = 0.05
    heading_rate_gain: Annotated[
        float,
        Gt(0),
        About("|flown over commanded - 1| at low frequency. Ours: the 5 % required of an identified inner loop"),
    ] = 0.05
    limit_cycle_margin: Annotated[
        float,
        Gt(0),
        About(
            "gain margin to the limit cycle. Ours: 1.5, so that an inner loop with two thirds of the identified "
            "bandwidth still has none"
        ),
    ] = 1.5
    chatter_share: Annotated[
        float, Ge(0), Lt(1), About("share of the flights with a limit cycle. Ours: as for lost flights")
    ] = 0.05
    sideslip: Annotated[Degrees, Gt(0), About("rms. Part 60, adverse yaw: 2 deg of sideslip")] = math.radians(2.0)
    altitude_deviation: Annotated[Metres, Gt(0), About("peak. ACS: 100 ft, to the metre below")] = 30.0
    turn_ratio: Annotated[
        float, Gt(0), About("|flown turn over g tan(bank)/V - 1|. Ours: 5 %, as for the heading-rate gain")
    ] = 0.05
    bank_reserve: Annotated[
        Degrees, Ge(0), About("bank limit minus bank at the rate limit. Ours: room to correct, as 50 deg leaves for 45")
    ] = math.radians(5.0)
    lost_share: Annotated[
        float, Ge(0), Lt(1), About("share of the flights that end early. Ours: 95 % of the flights must complete")
    ] = 0.05
    convergence_share_margin: Annotated[
        float, Ge(0), Lt(1), About("difference of the shares that converge. Ours: as for lost flights")
    ] = 0.05
    convergence_time_margin: Annotated[
        float, Gt(0), About("relative to the baseline's mean. Part 60: 10 %, as of a yaw rate")
    ] = 0.10
    circling_error: Annotated[
        float,
        Gt(0),
        About(
            "settled error, rms, over the standoff distance; where the baseline's is larger its law does not circle, "
            "and the pair says nothing of the cost. Ours: a quarter, beyond all that a law that circles was seen to do"
        ),
    ] = 0.25
    range_error_margin: Annotated[Metres, Gt(0), About("settled error, rms. Ours: 1 % of the standoff distance")] = 2.0
    saturation_margin: Annotated[
        float, Gt(0), About("share of the time at the limit. Ours: a twentieth of the time")
    ] = 0.05
    command_activity_margin: Annotated[
        DegreesPerSecond2, Gt(0), About("Ours: the paper's 5 deg/s reached and left again once in 10 s")
    ] = math.radians(1.0)
    significance: Annotated[float, Gt(0), Lt(0.5), About("of the tests, Holm's over all of a scorecard")] = 0.05
