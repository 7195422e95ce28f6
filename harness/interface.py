"""The functions of the Python interface: fly, record, read back, run a matrix."""

import os
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from autopilot import laws
from autopilot.guidance import Law
from harness import loop
from harness.error import ArgumentError, HarnessError, RecordingError, SettingsError
from harness.flight import Flight
from harness.log import FlightLog
from harness.settings import document, flight_from_document
from harness.settings.gains import by_rule
from harness.settings.laws import absolute, is_own, kind_of, kind_of_class

if TYPE_CHECKING:
    import pandas as pd

    from harness.loop import Watch
    from harness.runs.run import Progress

_EVERY = 1.0  # s between two lines of progress


def law(name: str, gains: str | None = None, *, flight: Flight | None = None, **parameters: float | str) -> Law:
    """A guidance law by name with a named gain set, the law's default without one; a frozen value.

    `parameters` override single gains and what all laws have: `standoff` (m), `max_heading_rate` (rad/s, not degrees),
    `direction`, `airspeed`, `command`. `harness list laws` shows all of them. A gain set that follows from a rule needs
    the `flight` for whose circle, airspeed, period and airframe it is calculated. A user-defined law is named by its
    file, "FILE.py:CLASS" relative to the working folder, or as "MODULE:CLASS".

    Raises `ArgumentError` for an unknown law, gain set or parameter (the message lists the known ones) and for a rule
    without a result; FutureWarning for the former name of a gain set.

    >>> harness.law("nftsm")
    >>> harness.law("nftsm", "paper_1", k2=4.0, max_heading_rate=math.radians(10.0))
    >>> harness.law("nftsm", "behind_inner_loop", flight=flight)
    >>> harness.law("my_law.py:MyLaw", lean=0.02)
    """
    try:
        if not is_own(name) and name not in laws.LAWS:
            return laws.law(name)
        kind = kind_of(absolute(name, Path()), run=True)
        if gains is None or gains not in kind.rules or flight is None:
            return laws.made(name, kind, gains, **parameters)
        base: Any = laws.made(name, kind, kind.rules[gains].base, **parameters)
        return by_rule(replace(flight, law=replace(base, gains=gains)), parameters).law
    except ValueError as error:
        raise ArgumentError(str(error)) from None


def simulate(flight: Flight, watch: "Watch | None" = None) -> FlightLog:
    """Flies the flight and returns its log: how it ended, and one row per guidance period.

    A flight that ends early (it hits the ground, loses the target, a law raises) is a result: see `log.outcome` and
    `log.reason`. Repeated flights are bit-identical.

    `watch(time, so_far)` is called after each row with the time in s and a function that returns the log so far.

    It is flown in this process, also on a third-party JSBSim model; such a model is a program and may crash the
    process. `run`, with workers, and `harness fly` fly it in a separate process.

    Raises `SettingsError` if the settings are invalid, with one line for each mistake in the keys and units of a
    settings file; `PlantError` if the aircraft cannot start with them.

    >>> flight = harness.Flight(plant="sixdof", law=harness.law("nftsm", "paper_1"))
    >>> log = harness.simulate(flight)
    >>> log.outcome, log.metrics["convergence_time_s"]
    """
    return loop.simulate(_checked(flight), watch)


def metrics(log: FlightLog) -> dict[str, float | bool | None]:
    """The metrics of a flight by name, with the unit as suffix; equal to `log.metrics`.

    A metric is None if the plant has no such quantity (a kinematic aircraft has no bank), or the flight does not have
    it (it never converged). `harness list metrics` prints their meaning.

    >>> harness.metrics(log)["range_error_rms_m"]
    """
    return log.metrics


def record(log: FlightLog | Mapping[str, FlightLog], path: str | Path, *, title: str = "", notes: str = "") -> Path:
    """Writes one flight, or several by name, into a Rerun recording (`.rrd`) and returns its path, whole or not at all.

    The first flight is the reference; with two flights it is drawn wide and pale. `notes` is Markdown, shown above the
    results. `harness view PATH` shows the recording, `read_flight(PATH)` reads it back.

    Raises `RecordingError` if it cannot be written, or for more flights than there are colours; `SettingsError` for a
    law without a name.

    >>> harness.record(log, "flight.rrd")
    >>> harness.record({"kinematic": kinematic, "sixdof": sixdof}, "pair.rrd", title="The same flight twice")
    """
    from harness.review.recording import write_recording

    path = Path(path)
    logs = {log.flight.plant: log} if isinstance(log, FlightLog) else log
    if not isinstance(logs, Mapping):
        raise ArgumentError(f"log is {log!r}, must be a harness.FlightLog, or several by name")
    with _recording(path):
        write_recording(path, logs, title or path.stem, notes)
    return path


def show(log: FlightLog, *others: FlightLog) -> Any:
    """The view of one flight, or of several overlaid, in a notebook: see `FlightLog.show`."""
    from harness.log.figure import named
    from harness.review.notebook import viewer

    try:
        logs = named((log, *others))
        return viewer(logs, ", ".join(logs)) or log.plot(*others)
    except ValueError as error:
        raise ArgumentError(str(error)) from None


def read_flight(path: str | Path, flight: str | None = None) -> "pd.DataFrame":
    """The log of a recorded flight, bit-identical to `FlightLog.frame()`: one row per guidance period.

    `flight` names it where the file holds several. Columns as in `FlightLog`: SI, rad, north-east-down.

    Raises `RecordingError` when the file cannot be read or holds no such flight; the message names those that it holds.

    >>> harness.read_flight("pair.rrd", "sixdof")["range_error"].iloc[-1]
    """
    from harness.review.reading import read_recording

    with _recording(Path(path)):
        return read_recording(Path(path), flight)


def run(
    path: str | Path,
    out: str | Path,
    *,
    workers: int | None = None,
    limit: int | None = None,
    log: str | None = None,
    overrides: Sequence[str] = (),
    retry_failed: bool = False,
    timeout: float | None = None,
    engine: str | None = None,
    dask: str | None = None,
    progress: bool = False,
) -> "pd.DataFrame":
    """Flies the matrix of a settings file into a directory, and returns its results as `load_results` does.

    Finished flights are kept and not flown again, so the same call resumes an interrupted run.

    - `out`: the directory of the results, created if missing.
    - `workers`: processes; None is one per processor, 0 flies in this process. A script that uses workers must call
      this under `if __name__ == "__main__":`, as Python's multiprocessing requires; a notebook need not.
    - `limit`: the number of flights to fly, the first ones of the matrix.
    - `log`: which flights are recorded in OUT/flights: "all", "sample", "failed" or "none"; None is all of up to 50,
      else a sample.
    - `overrides`: texts KEY=VALUE that set a key for all flights, as `--set` of the command line does.
    - `retry_failed`: fly invalid flights again; flights that timed out or lost their worker always are.
    - `timeout`: process time, s, without progress of the simulated time, after which a flight is ended as hung; None is
      60.
    - `engine`: "python" or "compiled"; None is compiled if possible and faster. The results are identical.
    - `dask`: fly on a Dask cluster instead of processes of this machine: the address or the file of its scheduler, as
      `--dask` of the command line; see the guide "Many machines".
    - `progress`: print the progress to standard error, once a second.

    Raises `SettingsError` with every mistake in the file, each with its line; `StoreError` if the directory cannot be
    used; `WorkersError` if the processes cannot fly; `ArgumentError` for an invalid option; `HarnessError` for flights
    that the engine "compiled" cannot fly, and for a cluster that cannot be used. A flight that fails is a row, not an
    error.

    >>> results = harness.run("experiments/gains.toml", out="out/gains", progress=True)
    >>> results.groupby("plant")["convergence_time_s"].median()
    >>> harness.run("experiments/gains.toml", out="out/gains", dask="127.0.0.1:8786")
    """
    from harness.runs.cluster import connected
    from harness.runs.engine import ENGINES, engine_for
    from harness.runs.matrix import read_matrix
    from harness.runs.results import export, load_results
    from harness.runs.run import LOGS, Options, positions_done
    from harness.runs.run import run as fly
    from harness.runs.survey import survey
    from harness.runs.workers import TIMEOUT
    from harness.settings import read_settings

    for name, value, least in (("workers", workers, 0), ("limit", limit, 1)):
        if value is not None and value < least:
            raise ArgumentError(f"{name} is {value}, must be None or at least {least}")
    if workers is not None and dask is not None:
        raise ArgumentError("workers is for processes of this machine, dask has workers of its own: leave one out")
    if timeout is not None and not timeout > 0.0:
        raise ArgumentError(f"timeout is {timeout:g}, must be None or above 0 s")
    if timeout is not None and workers == 0:
        raise ArgumentError("timeout needs a worker to end: workers must be None or at least 1")
    if log is not None and log not in LOGS:
        raise ArgumentError(f"log is {log!r}, must be None or one of {', '.join(LOGS)}")
    if engine is not None and engine not in ENGINES:
        raise ArgumentError(f"engine is {engine!r}, must be None or one of {', '.join(ENGINES)}")
    path, out = Path(path), Path(out)
    workers = (os.cpu_count() or 1) if workers is None else workers
    matrix = read_matrix(read_settings(path, overrides), draft=True)
    *_, size = survey(matrix, limit, positions_done(matrix, out, retry_failed=retry_failed))  # finds every mistake
    compiled = engine_for(size, engine).compiled
    with nullcontext() if dask is None else connected(dask) as cluster:
        options = Options(
            workers=cluster.workers if cluster else workers,
            limit=limit,
            log=log,
            retry_failed=retry_failed,
            timeout=timeout or TIMEOUT,
            typical=size.typical,
            compiled=compiled,
            cluster=cluster,
        )
        states = fly(matrix, out, options)
        for _ in _printed(states) if progress else states:
            pass
    export(out)
    return load_results(out)


@contextmanager
def _recording(path: Path) -> Iterator[None]:
    """Raises errors of a recording as `RecordingError`."""
    try:
        yield
    except HarnessError:
        raise
    except OSError as error:
        raise RecordingError(f"{error.filename or path}: {error.strerror or error}") from error
    except ValueError as error:
        raise RecordingError(str(error)) from error


def _printed(states: "Iterator[Progress]") -> "Iterator[Progress]":
    """The states, with a line on standard error once a second and at the end."""
    due = time.monotonic()
    state = None
    for state in states:
        if time.monotonic() >= due:
            due = time.monotonic() + _EVERY
            print(_line(state), end="\r", file=sys.stderr, flush=True)
        yield state
    if state is not None:
        print(_line(state), file=sys.stderr)


def _line(state: "Progress") -> str:
    done = state.earlier + state.done
    left = f", about {state.left:.0f} s left" if state.left and done < state.total else ""
    return f"{done} of {state.total} flights done, {state.failed} failed, {state.seconds:.0f} s{left}"


def _checked(flight: Flight) -> Flight:
    """The flight, every field checked by its declaration as a file's values are; paths become text.

    Raises `SettingsError`.
    """
    if not isinstance(flight, Flight):
        raise SettingsError([f"flight: is {flight!r}, must be a harness.Flight"])
    if not callable(getattr(flight.law, "start", None)):
        raise SettingsError([f"flight.law: is {flight.law!r}, must be a law, as harness.law('nftsm') is"])
    for part in fields(Flight):
        value, kind = getattr(flight, part.name), part.default_factory
        if isinstance(kind, type) and is_dataclass(kind) and not isinstance(value, kind):
            raise SettingsError([f"flight.{part.name}: is {value!r}, must be a harness.{kind.__name__}"])
    target = flight.target
    if target.track is not None:
        target = replace(target, track=str(target.track))
    flight = replace(flight, aircraft=str(flight.aircraft), target=target)
    has_name = kind_of_class(type(flight.law)) is not None  # a user-defined law without a name checks itself
    flight_from_document(document(flight if has_name else replace(flight, law=laws.law("nftsm"))))
    return flight
