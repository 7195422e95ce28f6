"""What the paper claims of its simulations, Section 4 and the conclusions: questions put to a column's flights."""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from harness.studies.paper.claims_of_geometry import nftsm
from harness.studies.paper.columns import Column
from harness.studies.paper.decision import Decision, decide, metres, sooner, within
from harness.studies.paper.experiments import EXPERIMENTS, NEITHER, NO_TURN_RATE, TRUTH, Reading, flight, paper_law
from harness.studies.paper.measures import (
    CONVERGED,
    ON_THE_CIRCLE,
    azimuth,
    delay,
    overshoot,
    peak,
    restricted,
    settled,
)
from harness.studies.paper.reproduce import NUMBERS, formatted

_LAWS = ("NFTSM", "NFTSM_1", "SMC")


def _numbers(on: Column, where: str, *, printed_gains: bool = False) -> Decision:
    """How many of a section's printed numbers agree here."""
    sentences, agreeing = [], 0
    wanted = [n for n in NUMBERS if n.where == where and (n.law == "NFTSM as printed") == printed_gains]
    for n in wanted:
        duration = EXPERIMENTS[n.experiment].measured
        ours = n.measure(*(on.paper(n.experiment, law, duration=duration) for law in (n.law, n.against) if law))
        agreeing += n.agrees(ours)
        sentences.append(f"{n.law} {formatted(n, ours)} ({n.printed})")
    return decide(agreeing == len(wanted), f"{agreeing} of {len(wanted)}, ours (printed): " + ", ".join(sentences))


def table_3(on: Column) -> Decision:
    """All six rows, NFTSM with the fitted gains."""
    return _numbers(on, "Table 3")


def table_3_as_printed(on: Column) -> Decision:
    """NFTSM's two rows with the gains printed for it."""
    return _numbers(on, "Table 3", printed_gains=True)


def numbers_of_4_2(on: Column) -> Decision:
    """The S."""
    return _numbers(on, "4.2")


def numbers_of_4_3(on: Column) -> Decision:
    """The manoeuvring target."""
    return _numbers(on, "4.3")


def all_circle(on: Column) -> Decision:
    """The three laws round a stationary target, from 30 deg."""
    ends = {label: peak(on.paper("30", label), 75.0) for label in _LAWS}
    return decide(
        all(end < ON_THE_CIRCLE for end in ends.values()),
        "|r| in the last 5 s of 80: " + ", ".join(f"{label} {metres(end)}" for label, end in ends.items()),
    )


def nftsm_is_faster(on: Column) -> Decision:
    """To 1 m and to the column's tolerance, from both starts."""
    sentences, fine = [], True
    for experiment in ("30", "130"):
        for tolerance in sorted({1.0, on.tolerance}, reverse=True):
            a, b = (settled(on.paper(experiment, label), tolerance) for label in ("NFTSM", "SMC"))
            fine = fine and sooner(a, b)
            sentences.append(f"from {experiment}° to {tolerance:g} m NFTSM {within(a)}, SMC {within(b)}")
    return decide(fine, "; ".join(sentences))


def larger_gains_overshoot(on: Column) -> Decision:
    """NFTSM_1 against NFTSM, from 30 deg."""
    small, large = (overshoot(on.paper("30", label)) for label in ("NFTSM", "NFTSM_1"))
    gains = ", ".join(
        f"{label} ({steering.alpha2:g}, {steering.beta2:g}) {metres(x)}"
        for label, steering, x in (("NFTSM_1", nftsm("NFTSM_1"), large), ("NFTSM", nftsm("NFTSM"), small))
    )
    return decide(large > 2.0 * small and large > 1.0, gains)


def slower_from_130(on: Column) -> Decision:
    """SMC from 130 deg, 100 s and longer."""
    nftsm = settled(on.paper("130", "NFTSM"), max(1e-4, on.tolerance))
    smc = on.paper("130", "SMC", Reading(period=0.005), 400.0)
    at_100 = float(smc["range_error"][np.searchsorted(smc["time"], 100.0)])
    return decide(
        nftsm is not None and abs(at_100) > 1.0,
        f"NFTSM within {on.tolerance:g} m {within(nftsm)}; SMC is {at_100:.1f} m off after 100 s, "
        f"within 1 m {within(settled(smc, 1.0))}",
    )


def restricted_8_to_17(on: Column) -> Decision:
    """When NFTSM's command is at the limit."""
    spans = {experiment: restricted(on.paper(experiment, "NFTSM")) for experiment in ("30", "130")}
    times = [f"from {e}° " + (f"{span[0]:.1f} to {span[1]:.1f} s" if span else "never") for e, span in spans.items()]
    right = any(span is not None and (round(span[0]), round(span[1])) == (8, 17) for span in spans.values())
    return decide(right, "at the limit first " + ", ".join(times))


def mobility(on: Column) -> Decision:
    """How hard the two laws steer, from 130 deg, first 60 s."""
    sentences, rates = [], []
    for label in ("NFTSM", "SMC"):
        log = on.paper("130", label)
        command = np.degrees(log["heading_rate_command"][log["time"] < 60.0])
        rates.append((float(np.abs(command).max()), float(np.mean(np.abs(command) > 0.9998 * on.limit))))
        sentences.append(
            f"{label} up to {rates[-1][0]:.2f} deg/s, at the limit {100.0 * rates[-1][1]:.0f} % of the first 60 s"
        )
    return decide(rates[0][1] > 0.25 and rates[1][1] == 0.0, "; ".join(sentences))


def they_stay(on: Column) -> Decision:
    """400 s from 30 deg: the last half."""
    ends = {label: peak(on.paper("30", label, Reading(period=0.005), 400.0), 200.0) for label in _LAWS}
    return decide(
        all(end < ON_THE_CIRCLE for end in ends.values()),
        "|r| from 200 s to 400 s: " + ", ".join(f"{label} {metres(end)}" for label, end in ends.items()),
    )


# Section 4.2


def faster_round_the_s(on: Column) -> Decision:
    """NFTSM against SMC."""
    sentences, fine = [], True
    for tolerance in sorted({1.0, on.tolerance}, reverse=True):
        a, b = (settled(on.paper("S", label, duration=330.0), tolerance) for label in ("NFTSM", "SMC"))
        fine = fine and sooner(a, b)
        sentences.append(f"to {tolerance:g} m NFTSM {within(a)}, SMC {within(b)}")
    return decide(fine, "; ".join(sentences))


def slow_adjustment(on: Column) -> Decision:
    """The largest commands in the first 30 s round the S."""
    rates = []
    for label in ("NFTSM", "SMC"):
        log = on.paper("S", label, duration=330.0)
        rates.append(float(np.degrees(np.abs(log["heading_rate_command"][log["time"] < 30.0])).max()))
    return decide(
        rates[1] < 0.95 * rates[0],
        f"SMC turns with up to {rates[1]:.2f} deg/s in the first 30 s, NFTSM with {rates[0]:.2f}",
    )


def overshoot_improves(on: Column) -> Decision:
    """NFTSM_1 round the S, before and after 75 s."""
    log = on.paper("S", "NFTSM_1", duration=330.0)
    early, late = overshoot(log, 75.0), peak(log, 75.0)
    return decide(early > 1.0 > late, f"{early:.1f} m before 75 s, |r| {metres(late)} after")


def all_converge_in_2000_s(on: Column) -> Decision:
    """The whole S, 2000 s."""
    largest = {label: peak(on.paper("S", label, Reading(period=0.02)), 400.0) for label in _LAWS}
    return decide(
        all(x < CONVERGED for x in largest.values()),
        "largest |r| from 400 s to 2000 s: " + ", ".join(f"{label} {metres(x)}" for label, x in largest.items()),
        under={"zero means 1 m": all(x < ON_THE_CIRCLE for x in largest.values())},
    )


# Section 4.3


def _peaks(on: Column, label: str, reading: Reading | None = None) -> dict[str, float]:
    log = on.paper("manoeuvres", label, reading)
    spans = {
        "300-350 s": (300.0, 350.0),
        "400-410 s": (400.0, 410.0),
        "460-470 s": (460.0, 470.0),
        "550-570 s": (550.0, 570.0),
    }
    return {name: peak(log, *span) for name, span in spans.items()}


def _reading(**changed: Any) -> Reading:
    """That of the manoeuvring target, with something read differently."""
    return replace(EXPERIMENTS["manoeuvres"].reading, **changed)


def _peaks_in_words(peaks: dict[str, float]) -> str:
    return ", ".join(f"{metres(x)} in {span}" for span, x in peaks.items())


def circles_then_follows(on: Column) -> Decision:
    """NFTSM before 300 s and after 600 s."""
    log = on.paper("manoeuvres", "NFTSM")
    angle, time = azimuth(log), log["time"]
    early, late = (
        abs(angle[np.searchsorted(time, b)] - angle[np.searchsorted(time, a)]) / math.tau
        for a, b in ((50.0, 300.0), (600.0, 899.0))
    )
    return decide(
        late < 0.5,
        f"{early:.1f} turns from 50 s to 300 s; at 11 m/s {late:.1f} turns from 600 s to 899 s",
    )


def all_return(on: Column) -> Decision:
    """|r| in the last 100 of 900 s, and of NFTSM_1 without its limit."""
    ends = {label: peak(on.paper("manoeuvres", label), 800.0) for label in _LAWS}
    free = peak(on.paper("manoeuvres", "NFTSM_1", _reading(limited=False)), 800.0)
    sentences = ", ".join(f"{label} {metres(x)}" for label, x in ends.items())
    number = f"|r| from 800 s on: {sentences}; NFTSM_1 without its limit {metres(free)}"
    returned = {label: x < ON_THE_CIRCLE for label, x in (*ends.items(), ("free", free))}
    return decide(
        all(returned[label] for label in _LAWS),
        number,
        under={"NFTSM_1 has no limit either": all(returned[label] for label in ("NFTSM", "SMC", "free"))},
    )


def adjusts_in_turns(on: Column) -> Decision:
    """How far NFTSM's command wanders, in deg/s per second."""
    log = on.paper("manoeuvres", "NFTSM")
    command, time = np.degrees(log["heading_rate_command"]), log["time"]

    def activity(begin: float, end: float) -> float:
        during = (time >= begin) & (time <= end)
        return float(np.abs(np.diff(command[during])).sum()) / (end - begin)

    steady, speeding, turning = activity(200.0, 299.0), activity(300.0, 350.0), activity(399.0, 411.0)
    return decide(
        turning > 2.0 * speeding,
        f"the command moves by {turning:.2g} deg/s² in the turn at 400 s, {speeding:.2g} while accelerating, "
        f"{steady:.2g} before",
    )


def only_smc_is_off(on: Column) -> Decision:
    """While the target accelerates, and up to the next manoeuvre."""
    peaks = {label: (_span(on, label, 300.0, 350.0), _span(on, label, 350.0, 399.0)) for label in _LAWS}
    sentences = ", ".join(f"{label} {metres(a)} and {metres(b)}" for label, (a, b) in peaks.items())
    stable = {label: max(pair) < ON_THE_CIRCLE for label, pair in peaks.items()}
    until_350_s = peaks["SMC"][0] > 10.0 and all(peaks[label][0] < ON_THE_CIRCLE for label in ("NFTSM", "NFTSM_1"))
    return decide(
        until_350_s and stable["NFTSM"] and stable["NFTSM_1"],
        f"|r| while it accelerates, and until 399 s: {sentences} (printed: 17.4 m for SMC; NFTSM_1 is limited to "
        f"{on.limited}, the circle of a target at 7 m/s takes up to {_circle_takes(on, 7.0):.1f})",
        under={"one looks no further than 350 s": until_350_s},
    )


def _circle_takes(on: Column, speed: float) -> float:
    """The largest heading rate on the circle of a target of this speed, (v_a + w)^2 / (v_a R_d), deg/s."""
    paper_flight = on.change(flight("manoeuvres", "NFTSM_1"))
    v_a, wind = paper_flight.start.airspeed, math.hypot(*paper_flight.wind.steady)
    return math.degrees((v_a + speed + wind) ** 2 / (v_a * paper_flight.law.standoff))


def _span(on: Column, label: str, begin: float, end: float, reading: Reading | None = None) -> float:
    return peak(on.paper("manoeuvres", label, reading), begin, end)


def smc_comes_back(on: Column) -> Decision:
    """SMC after the acceleration."""
    log = on.paper("manoeuvres", "SMC")
    at = [float(abs(log["range_error"][np.searchsorted(log["time"], t)])) for t in (350.0, 375.0, 399.0)]
    return decide(at[2] < 0.5 * at[0], "|r| " + ", ".join(f"{x:.2g}" for x in at) + " m at 350, 375, 399 s")


def larger_at_460(on: Column) -> Decision:
    """SMC: the sharp acceleration with a turn, against the slow one."""
    slow, sharp = _span(on, "SMC", 300.0, 350.0), _span(on, "SMC", 460.0, 549.0)
    return decide(sharp > slow, f"{sharp:.1f} m from 460 s on, {slow:.1f} m at 300 s to 350 s")


def small_at_550(on: Column) -> Decision:
    """SMC in the slow turn."""
    turn = _span(on, "SMC", 550.0, 570.0)
    slow = _span(on, "SMC", 300.0, 350.0)
    return decide(
        turn < 0.25 * slow, f"|r| up to {metres(turn)} from 550 s to 570 s, {metres(slow)} while accelerating"
    )


def sensitive_to_speed(on: Column) -> Decision:
    """SMC: |r| while accelerating, and in the sharp turn and after it; under other knowledge too."""
    known = {
        "turn rate only": None,
        "all": _reading(known=TRUTH),
        "acceleration only": _reading(known=NO_TURN_RATE),
        "neither": _reading(known=NEITHER),
    }
    if on.change(flight("30", "SMC")).estimator.kind == "ekf":  # whatever else the law might know
        known = {"EKF": None}
    spans = {
        name: (_span(on, "SMC", 300.0, 350.0, reading), _span(on, "SMC", 400.0, 459.0, reading))
        for name, reading in known.items()
    }
    sensitive = {name: speed > 2.0 * turn for name, (speed, turn) in spans.items()}
    sentences = "; ".join(f"{name} {metres(a)} and {metres(b)}" for name, (a, b) in spans.items())
    return decide(
        all(sensitive.values()),
        f"|r| while accelerating, and in and after the sharp turn, by what the law knows: {sentences}",
        under={"it knows the target's turn rate and not its acceleration": sensitive.get("turn rate only", False)},
    )


def nftsm_1_is_sensitive_to_turns(on: Column) -> Decision:
    """NFTSM_1, limited, and not."""
    limited = _span(on, "NFTSM_1", 300.0, 350.0), _span(on, "NFTSM_1", 400.0, 459.0)
    free = tuple(_span(on, "NFTSM_1", *span, _reading(limited=False)) for span in ((300.0, 350.0), (400.0, 459.0)))
    number = (
        f"{metres(limited[0])} while accelerating, {metres(limited[1])} in and after the sharp turn at "
        f"{on.limited}; without the limit "
        f"{metres(free[0])} and {metres(free[1])}"
    )
    return decide(
        limited[1] > limited[0] and free[1] > free[0],
        number,
        under={"its command is limited": limited[1] > limited[0]},
    )


def within_0_1_m(on: Column) -> Decision:
    """NFTSM in all manoeuvres, and what it is when it knows neither acceleration nor turn rate."""
    worst = _span(on, "NFTSM", 300.0, 900.0)
    blind = _span(on, "NFTSM", 300.0, 900.0, _reading(known=NEITHER))
    limited = _span(on, "NFTSM", 300.0, 900.0, _reading(limited=True))
    return decide(
        max(worst, limited) <= 0.1,
        f"{metres(worst)} at the most, {metres(blind)} when it knows neither acceleration nor turn rate; "
        f"at {on.limited} {metres(limited)}",
        under={"its command is not limited": worst <= 0.1},
    )


def more_sensitive_to_turns(on: Column) -> Decision:
    """NFTSM: turning against accelerating."""
    peaks = _peaks(on, "NFTSM")
    blind = _peaks(on, "NFTSM", _reading(known=NEITHER))
    number = f"NFTSM {_peaks_in_words(peaks)}; knowing neither acceleration nor turn rate {_peaks_in_words(blind)}"
    more, more_blind = (each["400-410 s"] > each["300-350 s"] for each in (peaks, blind))
    return decide(more and more_blind, number, under={"it does not know the turn rate": more_blind})


def limit_is_the_reason(on: Column) -> Decision:
    """NFTSM_1 with and without the limit."""
    limited, free = (_span(on, "NFTSM_1", 300.0, 900.0, reading) for reading in (None, _reading(limited=False)))
    return decide(limited > 100.0 * free, f"|r| up to {limited:.0f} m with the limit, {metres(free)} without")


def delayed(on: Column) -> Decision:
    """SMC's heading behind the others'."""
    logs = {label: on.paper("manoeuvres", label, duration=600.0) for label in _LAWS}
    behind = {label: delay(logs["SMC"], logs[label]) for label in ("NFTSM", "NFTSM_1")}
    sentences = ", ".join(f"behind {label} {'-' if x is None else f'{x:.1f} s'}" for label, x in behind.items())
    lag = behind["NFTSM"]
    return decide(lag is not None and round(lag, 1) == 10.3, f"SMC passes 180° {sentences}")


# Conclusions


def constraints_satisfied(on: Column) -> Decision:
    """The largest commands that NFTSM gives where it is not limited: to converge, and to hold the circle."""
    log = on.paper("manoeuvres", "NFTSM")
    command, time = np.degrees(np.abs(log["heading_rate_command"])), log["time"]
    whole, slow, fast = command.max(), command[(time > 100.0) & (time < 299.0)].max(), command[time > 600.0].max()
    return decide(
        bool(whole <= on.limit),
        f"Section 4.3 is flown without the limit of {on.limited}: NFTSM commands up to {whole:.0f} deg/s, "
        f"{slow:.1f} to hold the circle at 2 m/s, {fast:.1f} at 11 m/s",
        under={
            "the command is limited": bool(max(slow, fast) <= on.limit),
            "the target is slow and the command limited": bool(slow <= on.limit),
        },
    )


def high_manoeuvring(on: Column) -> Decision:
    """NFTSM's r, without the limit and with it."""
    free, limited = (
        peak(on.paper("manoeuvres", "NFTSM", reading), 800.0) for reading in (None, _reading(limited=True))
    )
    return decide(
        max(free, limited) < ON_THE_CIRCLE,
        f"|r| from 800 s on {metres(free)} without the limit, {metres(limited)} with it",
        under={f"its command is not limited to {on.limited}": free < ON_THE_CIRCLE},
    )


def alpha2_and_beta2(on: Column) -> Decision:
    """Convergence and overshoot from 30 deg as alpha2, then beta2, grows."""
    lines: list[str] = []
    times: dict[tuple[float, float], float | None] = {}
    shocks: dict[tuple[float, float], float] = {}
    for pair in ((0.1, 2.4), (0.2, 2.4), (0.4, 2.4), (0.8, 2.4), (1.6, 2.4), (0.4, 1.2), (0.4, 4.8)):
        paper_flight = flight("30", "NFTSM", Reading(period=0.005))
        log = on.fly(replace(paper_flight, law=paper_law("NFTSM", alpha2=pair[0], beta2=pair[1])))
        times[pair], shocks[pair] = settled(log, ON_THE_CIRCLE), overshoot(log)
        lines.append(f"({pair[0]:g}, {pair[1]:g}) {within(times[pair])}, {metres(shocks[pair])}")
    small, fitted, large = (0.1, 2.4), (0.4, 2.4), (1.6, 2.4)
    shock = shocks[fitted] < 1.0 < shocks[large]
    alpha2_reduces = sooner(times[fitted], times[small])
    alpha2_goes_on = sooner(times[large], times[fitted])
    beta2_reduces = sooner(times[0.4, 4.8], times[0.4, 1.2])
    return decide(
        shock and alpha2_reduces and alpha2_goes_on and beta2_reduces,
        "(α2, β2): within 1 m in, overshoot: " + "; ".join(lines),
        under={
            "it is α2 that grows": shock and alpha2_reduces and alpha2_goes_on,
            "it is α2 that grows, and moderately: far beyond, the shock makes it longer": shock and alpha2_reduces,
        },
    )
