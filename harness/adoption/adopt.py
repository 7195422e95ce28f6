"""Adopts a JSBSim model, stage by stage, each in a process of its own with limits of time and memory."""

import re
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import aircraft
from harness.adoption.adoption import Adoption, Wish, write
from harness.adoption.model import Original, named, source, writers
from harness.adoption.refusal import RefusalError
from harness.adoption.stages import STAGES, Found, identifying
from harness.child import MEMORY, ChildError, limited
from harness.files import make_folder, write_text
from harness.plants.model import ModelError
from harness.plants.plant import PlantError
from harness.plants.wind_tunnel import NotFiniteError

SECONDS = 60.0  # s: time limit of all stages together
LOADING = 20.0  # s: time limit of the load
_IN_TRIM = ("linearise", "design", "90 deg", "circle")  # stages that may succeed with another trim airspeed
_FILES = ("{name}.xml", "airframe.toml", "inner_loop.toml", "identified.toml", "circle.toml")


def adopt(name: str, out: Path, wish: Wish, seconds: float = SECONDS) -> Iterator[tuple[str, str]]:
    """Adopts the model `name` into the folder out/NAME; yields (stage, what it found). Raises `RefusalError`, OSError.

    Each stage runs in a process of its own. The folder is written when all stages are through; the last, which
    identifies the aircraft for the plants `lagged` and `coordinated`, may fail.
    """
    end = time.monotonic() + seconds
    model = source(name)
    kept = out / model.name
    _check_place(kept, model)
    left_out = f", {len(model.fenced.left_out)} left out" if model.fenced.left_out else ""
    yield "guard", f"{len(model.fenced.sources)} files, {sum(1 for _ in model.root.iter())} elements{left_out}"
    with tempfile.TemporaryDirectory(prefix="harness-") as temporary:
        folder = Path(temporary) / model.name
        folder.mkdir()
        adoption = Adoption(
            name=model.name,
            wish=wish,
            folder=folder,
            names=frozenset(named(model.root)),
            writers=writers(model.root),
        )
        stages, first = list(STAGES), None
        while stages:
            stage = stages.pop(0)
            write(adoption, model)
            try:
                adoption, line = _done(stage, adoption, end, seconds)
            except RefusalError as refusal:
                first = first or refusal
                if stage not in _IN_TRIM or not adoption.speeds or time.monotonic() > end:
                    raise first from None
                stages = ["trim", *_IN_TRIM]
                line = f"{refusal.message}: at another airspeed"
            yield from ((stage, part) for part in line.splitlines())
        write(adoption, model)
        try:
            adoption, line = _done("identify", adoption, end, seconds)
        except RefusalError as refusal:
            line = f"without lagged and coordinated: {refusal.message}"
        yield from (("identify", part) for part in line.splitlines())
        write(adoption, model)
        make_folder(kept)
        for pattern in _FILES:
            if (file := folder / pattern.format(name=model.name)).exists():
                write_text(kept / file.name, file.read_text(encoding="utf-8"))
            else:
                (kept / file.name).unlink(missing_ok=True)  # of an earlier adoption
        aircraft.keep_written(kept)


def _done(stage: str, adoption: Adoption, end: float, seconds: float) -> Found:
    """The result of a stage in a separate process, until `end`. Raises `RefusalError` for any failure there."""
    left = max(1.0, end - time.monotonic())
    if is_short := stage == "load" and left > LOADING:
        left = LOADING
    try:
        return limited(stage, left, MEMORY, {**STAGES, "identify": identifying}[stage], adoption)
    except ChildError as error:
        allowed = f"{LOADING:g} s" if is_short else f"{seconds:g} s, which a model has for all stages"
        raise RefusalError(stage, f"not done after {allowed}" if error.is_late else error.cause) from None
    except (ModelError, PlantError, NotFiniteError, RuntimeError) as error:
        what = str(error).replace(f"{adoption.folder.parent}/", "")
        raise RefusalError(stage, " ".join(what.split())) from None


def _check_place(kept: Path, model: Original) -> None:
    """Raises `RefusalError` for a folder that holds the model itself, or something else than an adoption."""
    if not re.fullmatch(r"\w[\w .+-]*", model.name):
        raise RefusalError("guard", f"{model.name!r} is to be a folder's name: letters, digits, spaces and .+-_ only")
    if any(kept.resolve() in Path(file).resolve().parents for file in model.fenced.sources):
        raise RefusalError("guard", f"{kept} holds the model itself, which would be overwritten: give another --out")
    if kept.exists() and not (kept.is_dir() and (_is_adopted(kept) or not any(kept.iterdir()))):
        raise RefusalError("guard", f"{kept} is there, and is no adopted model: give another --out, or move it away")


def _is_adopted(folder: Path) -> bool:
    return (folder / "airframe.toml").is_file() and aircraft.adopted(folder) is not None
