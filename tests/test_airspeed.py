"""Which airspeed a law should compute with: what the page makes of planted results."""

import pandas as pd

from harness.studies.airspeed import AIRSPEEDS, lines, page


def planted() -> pd.DataFrame:
    """Of an airframe in two airs: in turbulence `ground` is best in three of four seeds, in still air all are alike."""
    rows = []
    for seed in range(4):
        for turbulence in ("none", "moderate"):
            for airspeed in AIRSPEEDS:
                error = {"nominal": 2.0, "measured": 1.0, "ground": 0.5 if seed else 3.0}[airspeed]
                rows.append(
                    {"aircraft": "stick", "wind.steady_mps": (3.0, 4.0), "errors.wind_mps": 0.0,
                     "wind.turbulence": turbulence, "seed": seed,
                     "law.airspeed": airspeed, "command_activity_deg_s2": 1.0 + seed,
                     "range_error_rms_m": error if turbulence == "moderate" else 0.0}
                )  # fmt: skip
    return pd.DataFrame(rows)


def test_means_and_wins_are_counted_for_each_air_by_itself() -> None:
    still, gusty = lines(planted())
    assert (still.air, still.apart) == ("wind of 5 m/s", 0.0)
    assert gusty.air == "wind of 5 m/s, moderate turbulence"
    assert (gusty.flights, gusty.nearest) == (4, 3)
    assert gusty.error == (2.0, 1.0, 1.125)
    assert gusty.activity == (2.5, 2.5, 2.5)


def test_what_is_no_further_apart_than_a_millimetre_is_alike() -> None:
    still, gusty = page(planted()).splitlines()[-6:-4]
    assert still.endswith("| alike |")
    assert gusty.endswith("| 3 of 4 |")
