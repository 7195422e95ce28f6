"""Trial of a user-defined law before it is flown: on synthetic observations, and within a time limit."""

import math
import random
import signal
import statistics
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from autopilot.guidance import Guidance, Law, Observation, started
from harness.flight import Flight, context_of
from harness.plants.plant import End, Outcome
from harness.plants.turn import bank_of_turn

SLOW = 1e-3  # s per command, above which a law counts as slow: a flight of 100 s takes 2 s more
ANSWERS_WITHIN = 60.0  # s: time limit of a command in this process; a worker has its own
TRIED_WITHIN = 5.0  # s: time limit of the trial
_STEPS, _LONGEST = 60, 0.3  # number of commands that are timed, and time limit for all of them, s


def observations(flight: Flight, count: int, seed: int = 1) -> list[Observation]:
    """Synthetic observations, one per guidance period, with wind and a turning target. SI, rad."""
    draw, law, v_a = random.Random(seed), flight.law, flight.start.airspeed
    W_x, W_y, turn = (draw.uniform(-0.3 * v_a, 0.3 * v_a) for _ in range(3))
    turn *= 0.01
    x, y = (draw.uniform(-3.0, 3.0) * law.standoff for _ in range(2))
    x_t, y_t, psi, course = 0.0, 0.0, draw.uniform(-math.pi, math.pi), draw.uniform(-math.pi, math.pi)
    v_t, made = 0.2 * v_a, []
    for k in range(count):
        rate = 0.05 * math.sin(0.01 * k)
        v_x, v_y = v_a * math.cos(psi) + W_x, v_a * math.sin(psi) + W_y
        v_t_x, v_t_y = v_t * math.cos(course), v_t * math.sin(course)
        bank = bank_of_turn(v_a, rate)
        made.append(
            Observation(
                x,
                y,
                v_x,
                v_y,
                v_a,
                psi,
                rate,
                bank,
                0.0,
                v_a,
                W_x,
                W_y,
                x_t,
                y_t,
                v_t_x,
                v_t_y,
                0.0,
                turn,
                k * flight.guidance_period,
            )
        )
        x, y, x_t, y_t = (p + v * flight.guidance_period for p, v in ((x, v_x), (y, v_y), (x_t, v_t_x), (y_t, v_t_y)))
        psi = math.remainder(psi + rate * flight.guidance_period, math.tau)
        course += turn * flight.guidance_period
    return made


def answers(flight: Flight, law: Law, seen: Sequence[Observation]) -> list[Guidance]:
    """The law's answers to consecutive observations, from its start."""
    step = started(law, context_of(flight))
    return [step(observation) for observation in seen]


def cost(flight: Flight) -> float:
    """The computing time of a command of the flight's law on this machine, s: a median."""
    step, times = started(flight.law, context_of(flight)), []
    end = time.perf_counter() + _LONGEST
    for observation in observations(flight, _STEPS):
        begin = time.perf_counter()
        step(observation)
        times.append(time.perf_counter() - begin)
        if time.perf_counter() > end:
            break
    return statistics.median(times)


def slowness(flight: Flight) -> Iterator[str]:
    """A sentence on a law that is slow. A law that raises is not reported here, but by its flight."""
    try:
        with within(TRIED_WITHIN):
            each = cost(flight)
    except End as end:
        yield str(end)
        return
    except (Exception, SystemExit):
        return
    if each > SLOW:
        whole = each * (flight.periods + 1)
        yield f"the law takes {1e3 * each:.3g} ms for a command, {whole:.3g} s for the {flight.periods + 1} of a flight"


@contextmanager
def within(seconds: float) -> Iterator[Callable[..., None]]:
    """Raises `End` inside a law that takes longer. Yields a function that restarts the time.

    Only in the main thread, where Python runs signal handlers; elsewhere it has no effect.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda *_: None
        return

    def late(number: int, frame: object) -> None:
        raise End(Outcome.TIMEOUT, f"the law gave no answer in {seconds:g} s")

    def anew(*_: object) -> None:
        signal.setitimer(signal.ITIMER_REAL, seconds)

    earlier = signal.signal(signal.SIGALRM, late)
    anew()
    try:
        yield anew
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, earlier)
