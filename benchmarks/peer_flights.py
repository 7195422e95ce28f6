"""The flights that benchmarks.peers times, one simulator a process: `python -m benchmarks.peer_flights NAME SECONDS`.

Each is flown by its own package's usual way, in still air unless said, wings level by a plain rule of ours where it has
no autopilot. The process writes its version once it has flown, or what it lacks; then, for each line that it reads, it
flies again and writes the processor time.
"""

import atexit
import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any, NamedTuple

GUIDANCE = 0.05  # s: the period of the law, and of the commands to those that take any
FEET = 0.3048  # m
BATCH = 64  # flights of JAX at once


class End(NamedTuple):
    """Where a flight ends: one that has fallen from the sky is none."""

    time: float  # s
    height: float  # m
    bank: float  # rad


Fly = Callable[[], End]


def limited(command: float) -> float:
    """A command to a surface."""
    return max(-1.0, min(1.0, command))


def bare_own(seconds: float) -> Fly:
    """Nothing but JSBSim: the harness's airframe, with its inner loop, which are both of the model."""
    import aircraft
    from harness.flight import air_of
    from harness.plants.model import load
    from harness.plants.sixdof import engage, trim

    flight = own_flight(seconds)

    def fly() -> End:
        fdm = load(aircraft.folder(flight.aircraft), flight.step)
        engage(fdm, trim(fdm, flight.start, air_of(flight)), flight.start, rate_trim=True)
        for _ in range(round(seconds / flight.step)):
            fdm.run()
        return end_of_jsbsim(fdm)

    return fly


def bare_c172p(seconds: float) -> Fly:
    """Nothing but JSBSim: the c172p that comes with it, commanded as the environments of reinforcement learning do."""
    jsbsim = import_module("jsbsim")
    start = {"ic/h-sl-ft": 5000.0, "ic/u-fps": 120 * 1.6878, "ic/psi-true-deg": 270.0}

    def fly() -> End:
        fdm = jsbsim.FGFDMExec(jsbsim.get_default_root_dir())
        fdm.set_debug_level(0)
        fdm.load_model("c172p")
        fdm.set_dt(1 / 60)
        for key, value in start.items():
            fdm[key] = value
        fdm.run_ic()
        fdm["propulsion/set-running"] = -1
        fdm["fcs/throttle-cmd-norm"] = fdm["fcs/mixture-cmd-norm"] = 0.8
        for _ in range(round(seconds / GUIDANCE)):
            fdm["fcs/aileron-cmd-norm"] = limited(-0.5 * fdm["attitude/phi-rad"])
            fdm["fcs/elevator-cmd-norm"] = limited(0.5 * (fdm["attitude/theta-rad"] - 0.02))
            for _ in range(3):
                fdm.run()
        return end_of_jsbsim(fdm)

    return fly


def end_of_jsbsim(fdm: Any) -> End:
    """Where a flight of JSBSim ends."""
    return End(fdm["simulation/sim-time-sec"], fdm["position/h-sl-ft"] * FEET, fdm["attitude/phi-rad"])


def own_flight(seconds: float, **more: Any) -> Any:
    """The flight of the harness."""
    from autopilot.laws import law
    from harness.flight import Flight

    return Flight(plant="sixdof", law=law("nftsm", "paper_1"), guidance_period=GUIDANCE, duration=seconds, **more)


def own(seconds: float) -> Fly:
    """The harness: the law, the target known, still air."""
    return own_log(own_flight(seconds))


def own_disturbed(seconds: float) -> Fly:
    """The harness in turbulence, with its filter of the target."""
    from autopilot.estimator import Estimator
    from harness.world.wind import Wind

    return own_log(own_flight(seconds, wind=Wind(turbulence="moderate"), estimator=Estimator(kind="ekf")))


def own_c172p(seconds: float) -> Fly:
    """The harness on the c172p, adopted: the aircraft, the steps and the commands of those built on JSBSim."""
    from harness.adoption.adopt import adopt
    from harness.adoption.adoption import Wish
    from harness.settings import load_flight

    folder = TemporaryDirectory(prefix="harness-")
    atexit.register(folder.cleanup)
    for _ in adopt("c172p", Path(folder.name), Wish()):
        pass
    flight = load_flight(Path(folder.name) / "c172p" / "circle.toml")
    return own_log(replace(flight, step=1 / 60, guidance_period=GUIDANCE, duration=seconds))


def own_log(flight: Any) -> Fly:
    """Flies it, and keeps its log."""
    from harness.loop import simulate

    def fly() -> End:
        log = simulate(flight)
        return End(*(float(log[column][-1]) for column in ("time", "altitude", "bank")))

    return fly


def environment(package: str, **given: str) -> Callable[[float], Fly]:
    """A relative of the first environment for JSBSim: they differ in what they wrap it with."""

    def ready(seconds: float) -> Fly:
        import numpy as np

        tasks = import_module(f"{package}.tasks")
        arguments = {name: getattr(tasks, task) for name, task in given.items()}
        world = import_module(f"{package}.environment").NoFGJsbSimEnv(
            agent_interaction_freq=round(1 / GUIDANCE), **arguments
        )
        names = [variable.name for variable in world.task.state_variables]
        bank, pitch = names.index("attitude/roll-rad"), names.index("attitude/pitch-rad")

        def fly() -> End:
            found = world.reset()
            state = found[0] if isinstance(found, tuple) else found
            for _ in range(round(seconds / GUIDANCE)):
                action = np.array([limited(-0.5 * state[bank]), limited(0.5 * (state[pitch] - 0.02)), 0.0])
                state = world.step(action)[0]
            return end_of_jsbsim(world.sim.jsbsim)

        return fly

    return ready


def pyflyt(seconds: float) -> Fly:
    """A fixed wing of lifting surfaces in PyBullet."""
    import numpy as np

    world = import_module("PyFlyt.core").Aviary(
        start_pos=np.array([[0.0, 0.0, 300.0]]),
        start_orn=np.zeros((1, 3)),
        drone_type="fixedwing",
        drone_options={"control_hz": round(1 / GUIDANCE)},
    )

    def fly() -> End:
        world.reset()
        world.set_mode(0)
        for _ in range(round(seconds / GUIDANCE)):
            rates, angles, _, _ = world.state(0)
            pitch, roll = limited(-angles[1] - 0.2 * rates[1]), limited(angles[0] + 0.1 * rates[0])
            world.set_setpoint(0, np.array([pitch, roll, 0.0, 0.3]))
            world.step()
        return End(world.elapsed_time, world.state(0)[3][2], world.state(0)[1][0])

    return fly


def pyfly(seconds: float) -> Fly:
    """The Skywalker X8 with the autopilot that comes with it."""
    folder = next(iter(import_module("pyfly").__path__))
    world = import_module("pyfly.pyfly").PyFly(f"{folder}/pyfly_config.json", f"{folder}/x8_param.mat")
    pid = import_module("pyfly.pid_controller").PIDController
    start = {"roll": 0.0, "pitch": 0.05, "yaw": 0.0, "velocity_u": 20.0, "velocity_v": 0.0, "velocity_w": 1.0}
    start |= {"position_d": -100.0, "omega_p": 0.0, "omega_q": 0.0, "omega_r": 0.0}
    start |= {"wind_n": 0.0, "wind_e": 0.0, "wind_d": 0.0}

    def fly() -> End:
        control = pid(world.dt)
        control.set_reference(phi=0.0, theta=0.05, va=20.0)
        world.seed(0)
        world.reset(state=dict(start))
        state, steps = world.state, 0
        for _ in range(round(seconds / world.dt)):
            rates = [state[name].value for name in ("omega_p", "omega_q", "omega_r")]
            going, _ = world.step(control.get_action(*(state[name].value for name in ("roll", "pitch", "Va")), rates))
            if not going:
                break
            steps += 1
        return End(steps * world.dt, -state["position_d"].value, state["roll"].value)

    return fly


def flycraft(seconds: float) -> Fly:
    """An F-16 and its control law, both compiled, in an environment of reinforcement learning."""
    import numpy as np

    settings = {"step_frequence": round(1 / GUIDANCE), "max_simulate_time": 2 * seconds}
    world = import_module("flycraft.env").FlyCraftEnv({"debug_mode": False, "task": settings})

    def fly() -> End:
        _, told = world.reset(seed=1)
        state = told["plane_state"]
        for _ in range(round(seconds / GUIDANCE)):
            action = np.array([max(-85.0, min(85.0, -2.0 * state["phi"])), 1.0 - 0.1 * state["mu"], 0.3])
            state = world.step(action)[-1]["plane_state"]
        return End(world.step_cnt * GUIDANCE, state["h"], float(np.radians(state["phi"])))

    return fly


def jax_f16(flights: int) -> Callable[[float], Fly]:
    """An F-16 with its control law, which JAX compiles whole; it has no integrator: ours is JSBSim's kind."""

    def ready(seconds: float) -> Fly:
        os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")
        jax = import_module("jax")
        jax.config.update("jax_enable_x64", True)
        jnp, F16 = import_module("jax.numpy"), import_module("jax_f16.f16").F16
        model, step = F16(), 0.005
        trimmed = jnp.array(model.trim_control())

        def integrated(_: int, carried: Any, command: Any) -> Any:
            x, before = carried
            rate = model.xdot(x, command)
            return x + step * (1.5 * rate - 0.5 * before), rate

        def period(carried: Any, _: None) -> Any:
            x = carried[0]
            climb = x[F16.THETA] - x[F16.ALPHA]
            command = trimmed.at[F16.PS].set(jnp.clip(-x[F16.PHI], -1.0, 1.0)).at[F16.NZ].add(-climb)
            carried = jax.lax.fori_loop(0, round(GUIDANCE / step), lambda i, c: integrated(i, c, command), carried)
            return carried, carried[0]

        def flown(x: Any) -> Any:
            return jax.lax.scan(period, (x, model.xdot(x, trimmed)), None, length=round(seconds / GUIDANCE))[1]

        start = jnp.array(model.trim_state())
        if flights > 1:
            start, flown = jnp.tile(start, (flights, 1)), jax.vmap(flown)
        compiled = jax.jit(flown)

        def fly() -> End:
            last = compiled(start).block_until_ready().reshape(-1, F16.NX)[-1]
            return End(seconds, float(last[F16.H]) * FEET, float(last[F16.PHI]))

        return fly

    return ready


class Simulator(NamedTuple):
    """A row of the table: how it is flown, and what is said of it."""

    package: str  # whose version is told
    ready: Callable[[float], Fly]
    flies: str
    step_ms: str  # of the integration
    command_ms: str  # between commands from without
    reference: str  # the bare loop beside it
    does: str
    flights: int = 1  # at once
    requires: tuple[str, ...] = ()  # what pip installs; nothing: it is here


ADOPTED = "this harness, c172p"
_OWN, _C172P = "JSBSim alone, ultra_stick_25e", "JSBSim alone, c172p"
_REWARDS = (
    "it computes 11 state variables, a reward and whether the episode has ended, whose end is not heeded, and keeps "
    "nothing of the flight; "
)
SIMULATORS: Mapping[str, Simulator] = MappingProxyType(
    {
        _OWN: Simulator(
            "jsbsim",
            bare_own,
            flies="ultra_stick_25e",
            step_ms="5",
            command_ms="5",
            reference=_OWN,
            does="`fdm.run()` and nothing else; the inner loop and the actuators are part of the model",
        ),
        "this harness": Simulator(
            "standoff-harness",
            own,
            flies="ultra_stick_25e",
            step_ms="5",
            command_ms="50",
            reference=_OWN,
            does="trims anew for each flight; a guidance law on a circle round a target, the inner loop at each "
            "step, 52 channels logged at 20 Hz; no metrics",
        ),
        "this harness, turbulence, EKF": Simulator(
            "standoff-harness",
            own_disturbed,
            flies="ultra_stick_25e",
            step_ms="5",
            command_ms="50",
            reference=_OWN,
            does="the same in moderate turbulence, made anew for each flight and written at each step, with "
            "measurements of the target and a filter at 2 Hz",
        ),
        _C172P: Simulator(
            "jsbsim",
            bare_c172p,
            flies="c172p",
            step_ms="16.7",
            command_ms="50",
            reference=_C172P,
            does="`fdm.run()`, and two commands each 50 ms that hold wings and pitch; no autopilot, nothing logged",
        ),
        ADOPTED: Simulator(
            "standoff-harness",
            own_c172p,
            flies="c172p",
            step_ms="16.7",
            command_ms="50",
            reference=_C172P,
            does="the same as on its own aircraft; `harness adopt` has given the model an inner loop, which is not in "
            "the bare loop beside it",
        ),
        "jsbgym": Simulator(
            "jsbgym",
            environment("jsbgym"),
            flies="c172p",
            step_ms="16.7",
            command_ms="50",
            reference=_C172P,
            does=_REWARDS + "the model is loaded once, and set back for each flight",
            requires=("jsbgym==0.4.3",),
        ),
        "gymnasium-jsbsim": Simulator(
            "gymnasium-jsbsim",
            environment("gymnasium_jsbsim", task_type="HeadingControlTask"),
            flies="c172p",
            step_ms="16.7",
            command_ms="50",
            reference=_C172P,
            does="of the same origin, and does the same",
            requires=("gymnasium-jsbsim==0.1.1",),
        ),
        "flyrl": Simulator(
            "flyrl",
            environment("flyrl", task_type="HeadingControlTask"),
            flies="c172p",
            step_ms="16.7",
            command_ms="50",
            reference=_C172P,
            does="of the same origin, and does the same",
            requires=("flyrl==0.3.7",),
        ),
        "PyFlyt": Simulator(
            "PyFlyt",
            pyflyt,
            flies="a model aircraft of six lifting surfaces",
            step_ms="4.2",
            command_ms="50",
            reference=_OWN,
            does="PyBullet's rigid body with contacts; the forces of the surfaces one by one in Python, parts of "
            "it compiled by Numba; density constant; nothing logged",
            requires=("PyFlyt==0.29.0",),
        ),
        "pyfly-fixed-wing": Simulator(
            "pyfly-fixed-wing",
            pyfly,
            flies="Skywalker X8",
            step_ms="10",
            command_ms="10",
            reference=_OWN,
            does="equations in Python, integrated by SciPy's adaptive Runge-Kutta, which begins anew at each "
            "step; actuators and its own autopilot; keeps the history of every variable",
            requires=("pyfly-fixed-wing==0.1.2",),
        ),
        "flycraft": Simulator(
            "flycraft",
            flycraft,
            flies="F-16",
            step_ms="50",
            command_ms="50",
            reference=_OWN,
            does="compiled model and control law, asked for one step each 50 ms (what they do within is not "
            "told); reward and ends of the episode, which are not heeded, in Python; keeps all states",
            requires=("flycraft==0.2.0",),
        ),
        "jax-f16": Simulator(
            "jax-f16",
            jax_f16(1),
            flies="F-16",
            step_ms="5",
            command_ms="50",
            reference=_OWN,
            does="the equations of the aircraft with its control law alone; a loop around them by us, with one "
            "evaluation a step, is compiled with them; no actuators but the engine, no wind; 16 states kept at 20 "
            "Hz. Compiling takes seconds and is not counted. It needs a JAX before 0.9",
            requires=("jax-f16==0.0.2", "jax<0.9"),
        ),
        f"jax-f16, {BATCH} at once": Simulator(
            "jax-f16",
            jax_f16(BATCH),
            flies="F-16",
            step_ms="5",
            command_ms="50",
            reference=_OWN,
            does="the same, vectorised: the time of all, over their number",
            flights=BATCH,
            requires=("jax-f16==0.0.2", "jax<0.9"),
        ),
    }
)


def flown(fly: Fly, seconds: float) -> float:
    """Processor time of a flight, which is still in the air when it ends."""
    begin = time.process_time()
    end = fly()
    taken = time.process_time() - begin
    if not (end.time > seconds - 2 * GUIDANCE and end.height > 10.0 and abs(end.bank) < 1.0):
        raise RuntimeError(f"flew {end.time:.2f} s, to {end.height:.0f} m with a bank of {end.bank:.2f} rad")
    return taken


def answers(name: str, seconds: float) -> Iterator[object]:
    """The version after a first flight, or what is lacking; then a processor time for each line read."""
    simulator = SIMULATORS[name]
    try:
        fly = simulator.ready(seconds)
        flown(fly, seconds)
    except Exception as error:
        yield {"lacks": f"{type(error).__name__}: {error}"}
        return
    yield {"version": version(simulator.package)}
    for _ in sys.stdin:
        yield flown(fly, seconds)


def main(name: str, seconds: str) -> None:
    """Answer on the output, to which what the packages print does not go."""
    with os.fdopen(os.dup(1), "w") as output, suppress(BrokenPipeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        for answer in answers(name, float(seconds)):
            print(json.dumps(answer), file=output, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
