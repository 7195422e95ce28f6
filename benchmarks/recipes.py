"""The recipes of the guide to many machines, tried as they stand there: `python -m benchmarks.recipes`.

Needs `pip install dask-jobqueue dask-kubernetes kubernetes-validate`, and for the first recipe a SLURM of which this
machine is a node. A cluster of Kubernetes is not needed: what its recipe asks for is held against the schemas, and the
commands of its containers run as processes. Writes the block that says so into docs/guide/cluster.md.
"""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

from benchmarks.measured import keep
from harness.runs.results import load_results

PAGE = Path("docs/guide/cluster.md")
MATRIX = """\
[flight]
duration_s = 100.0
[flight.law]
name = "nftsm"
[matrix]
plant = ["kinematic", "sixdof"]
"start.heading_deg" = { uniform = [0.0, 360.0] }
seed = { start = 0, count = 160 }
"""
NEEDED = ("dask-jobqueue", "dask-kubernetes", "kubernetes-validate")
JOBS = 2  # and workers


def recipe(heading: str) -> str:
    """The Python code below a heading of the guide."""
    found = re.search(rf"^## {heading}$.*?^```text\n(from .*?)^```", PAGE.read_text(encoding="utf-8"), re.S | re.M)
    assert found, f"{PAGE} has no recipe below {heading}"
    return found[1]


def changed(code: str, *changes: tuple[str, str]) -> str:
    """The code with each of these texts, which stands there once, in place of another one."""
    for before, after in changes:
        assert code.count(before) == 1, f"{before} does not stand once in the recipe"
        code = code.replace(before, after)
    return code


def flown(folder: Path, *words: str) -> dict[str, str]:
    """The digests of the matrix by key, flown with these words into this folder."""
    file = folder.parent / "many.toml"
    file.write_text(MATRIX, encoding="utf-8")
    told = ["--out", str(folder), "--log", "none", "--engine", "python", *words]
    subprocess.run([sys.executable, "-m", "harness", "run", str(file), *told], check=True, stdout=subprocess.DEVNULL)
    results = load_results(folder)
    return dict(zip(results["key"], results["digest"], strict=True))


def alike(far: dict[str, str], home: dict[str, str]) -> str:
    """That the flights are those of a run at home, in words."""
    assert far == home
    return "the digests are those of a run at home"


def until(true: Callable[[], bool]) -> None:
    """Waits for it, a minute at most."""
    deadline = time.monotonic() + 60.0
    while not true():
        assert time.monotonic() < deadline, "this takes too long"
        time.sleep(0.2)


def answered(words: Sequence[str]) -> str:
    """What a command prints."""
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout


def on_slurm(folder: Path, home: dict[str, str]) -> str:
    """The recipe of SLURM, with two jobs of this machine, one of which is cancelled while they fly."""
    code = changed(
        recipe("On SLURM"),
        ('interface="ib0"', 'interface="lo", log_directory="logs"'),
        ("jobs=100", f"jobs={JOBS}"),
        ("~/standoff-harness/.venv", sys.prefix),
    )
    with subprocess.Popen(
        [sys.executable, "-u", "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=folder
    ) as cluster:
        assert cluster.stdin
        assert cluster.stdout
        address = cluster.stdout.readline().strip()
        until(lambda: answered(["squeue", "-h", "-t", "running"]).count("dask") == JOBS)
        first = answered(["squeue", "-h", "-o", "%i"]).split()[0]
        cancel = subprocess.Popen(["sh", "-c", f"sleep 12; scancel {first}"])
        far = flown(folder / "slurm", "--dask", address)
        assert cancel.poll() == 0, "the run was over before the job was cancelled"
        cluster.communicate("\n")
    until(lambda: not answered(["squeue", "-h"]))
    slurm = answered(["sbatch", "--version"]).split()[1]
    return (
        f"- **SLURM** {slurm} with one node, dask-jobqueue {version('dask-jobqueue')}: "
        f'the recipe with `interface="lo"` and {JOBS} jobs flew {len(far)} flights, and one job was cancelled in the '
        f"middle; {alike(far, home)}."
    )


def on_kubernetes(folder: Path, home: dict[str, str]) -> str:
    """What the recipe of Kubernetes asks for against the schemas, and its containers' commands on loopback."""
    code, _, _ = recipe("On Kubernetes").partition("cluster = ")
    made: dict[str, Any] = {}
    exec(code, made)
    cluster = json.loads(json.dumps(made["spec"]))
    operator = import_module("dask_kubernetes.operator")
    (types,) = Path(str(operator.__file__)).parent.rglob("crds/daskcluster.yaml")
    (served,) = import_module("yaml").safe_load(types.read_text(encoding="utf-8"))["spec"]["versions"]
    import_module("jsonschema").validate(cluster, served["schema"]["openAPIV3Schema"])
    controller = import_module("dask_kubernetes.operator.controller.controller")
    scheduler, worker = (cluster["spec"][part]["spec"] for part in ("scheduler", "worker"))
    name = cluster["metadata"]["name"]
    workers = controller.build_worker_deployment_spec(f"{name}-default", "default", name, "0", worker, {}, {})
    validator = import_module("kubernetes_validate")
    newest = validator.latest_version()
    for one in (
        controller.build_scheduler_deployment_spec(name, scheduler, {}, {}),
        controller.build_scheduler_service_spec(name, cluster["spec"]["scheduler"]["service"], {}, {}),
        workers,
    ):
        validator.validate(one, newest, strict=True)
    (one,) = scheduler["containers"]
    (other,) = workers["spec"]["template"]["spec"]["containers"]
    with containers(one, other) as address:
        far = flown(folder / "kubernetes", "--dask", address)
    return (
        "- **Kubernetes**: no cluster was at hand. What the recipe asks for, with dask-kubernetes "
        f"{version('dask-kubernetes')}, fits the schemas of its operator and of Kubernetes {newest}; "
        f"the commands of its containers, as processes on loopback, flew {len(far)} flights, and {alike(far, home)}. "
        "Not tried: pods, the image, and the network between them."
    )


@contextmanager
def containers(scheduler: Mapping[str, Any], worker: Mapping[str, Any]) -> Iterator[str]:
    """The address of a scheduler that these containers' commands start on loopback, with workers."""
    address = "tcp://127.0.0.1:8786"
    names = {one["name"]: one["value"] for one in worker["env"]} | {"DASK_SCHEDULER_ADDRESS": address}
    began = [started(scheduler["args"], {})]
    try:
        probe = scheduler["readinessProbe"]["httpGet"]
        (port,) = (one["containerPort"] for one in scheduler["ports"] if one["name"] == probe["port"])
        until(lambda: is_answered(f"http://127.0.0.1:{port}{probe['path']}"))
        for i in range(JOBS):
            own = names | {"DASK_WORKER_NAME": f"{names['DASK_WORKER_NAME']}{i}"}
            began.append(started([own.get(word.strip("$()"), word) for word in worker["args"]], own))
        yield address
    finally:
        for process in reversed(began):
            process.terminate()
            process.wait()


def started(words: Sequence[str], environment: Mapping[str, str]) -> subprocess.Popen[bytes]:
    """A container's command, with an address that no other machine reaches."""
    program, *rest = (word for word in words if word not in ("--host", "0.0.0.0"))
    path = Path(sys.prefix) / "bin" / program
    env = {**os.environ, **environment}
    return subprocess.Popen([path, *rest, "--host", "127.0.0.1"], env=env, stderr=subprocess.DEVNULL)


def is_answered(url: str) -> bool:
    """Whether a GET of this address is a success."""
    try:
        with urllib.request.urlopen(url, timeout=1.0) as answer:
            return bool(answer.status == 200)
    except OSError:
        return False


def main() -> None:
    """Tries both, and writes what was tried into the guide."""
    missing = [name for name in NEEDED if importlib.util.find_spec(name.replace("-", "_")) is None]
    if missing or not shutil.which("sbatch"):
        said = f"pip install {' '.join(missing)}" if missing else "sbatch, of a SLURM that runs"
        print(f"not here, which this needs: {said}", file=sys.stderr)
        sys.exit(2)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        home = flown(folder / "home")
        lines = [tried(folder, home) for tried in (on_slurm, on_kubernetes)]
    text = "\n".join(lines) + "\n"
    print(text, end="")
    keep(PAGE, "benchmarks.recipes", text)


if __name__ == "__main__":
    main()
