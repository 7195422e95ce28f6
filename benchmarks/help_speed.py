"""The time to `harness --help`, started cold, and what it imports: `python -m benchmarks.help_speed [STARTS]`.

Wall time of a whole process as a user starts it, beside that of an interpreter that does nothing.
"""

import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

HARNESS = Path(sys.executable).with_name("harness")
HEAVY = ("jsbsim", "pandas", "rerun", "scipy", "matplotlib")


def seconds(command: Sequence[str]) -> float:
    """Wall time of one process."""
    begin = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begin


def imported() -> set[str]:
    """The packages that `harness --help` imports."""
    program = (
        "import sys; from harness.cli.main import harness as h; h(['-h'], standalone_mode=False); print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    return {name.partition(".")[0] for name in done.stdout.splitlines()[-1].split()}


def main(starts: int = 15) -> None:
    """Print median and range of both, and which heavy packages were imported."""
    for what, command in (("harness --help", [HARNESS, "--help"]), ("bare Python", [sys.executable, "-c", ""])):
        times = [1e3 * seconds(list(map(str, command))) for _ in range(starts)]
        print(f"{what}: {statistics.median(times):.0f} ms ({min(times):.0f} to {max(times):.0f}, {starts} starts)")
    heavy = imported() & set(HEAVY)
    print(f"of {', '.join(HEAVY)} it imports {', '.join(sorted(heavy)) or 'none'}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
