"""The command line as a user meets it: real processes, real files, exit codes."""

import contextlib
import fcntl
import json
import os
import pty
import re
import signal
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete

from harness.cli._input import BadInput, flight_of, read_file
from harness.cli._paths import writable, writable_folder
from harness.cli.main import COMMANDS, Entry, load
from harness.cli.main import harness as command_line
from harness.log.metric import METRICS
from tests.builders import ROOT, command, copied_airframe, invoke, python, words_of, write

FILE = """\
[flight]
plant = "kinematic"
duration_s = 40.0
[flight.law]
name = "nftsm"
gains = "paper_1"
[flight.wind]
steady_mps = [0.0, 0.0]
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return write(tmp_path / "flight.toml", FILE)


def test_a_flight_is_told_in_lines(file: Path) -> None:
    done = command("fly", file)
    assert done.returncode == 0
    first, *_, outcome, key = done.stdout.splitlines()
    assert "feasible" in first
    assert "3.72 deg/s" in first  # what holding it takes
    assert "margin +1.28 deg/s" in first
    assert "convergence_time_s" in done.stdout
    assert outcome == "outcome: completed"
    assert key.startswith("key ")
    assert "Eq. (28)" in done.stderr  # the set breaks the paper's condition, flies and says so


def test_json_is_one_object_with_the_contracts_keys(file: Path) -> None:
    done = command("fly", file, "--json", "--set", "law.name=smc", "--set", "law.gains=paper")
    answer = json.loads(done.stdout)
    assert {"key", "outcome", "digest", "flight", "metrics", "feasibility_margin_deg_s"} <= set(answer)
    assert answer["flight"]["law"]["c1"] == 0.2
    assert answer["metrics"]["sideslip_rms_deg"] is None
    assert answer["feasibility_margin_deg_s"] == pytest.approx(5.0 - 3.724, abs=1e-3)


def test_without_a_limit_json_still_has_no_infinity(file: Path) -> None:
    done = command("fly", file, "--json", "--set", "law.max_heading_rate_deg_s=inf")
    assert json.loads(done.stdout)["feasibility_margin_deg_s"] is None


def test_another_setting_is_another_key_and_the_same_one_is_not(file: Path) -> None:
    keys = [
        json.loads(command("fly", file, "--json", "--set", f"start.heading_deg={heading}").stdout)["key"]
        for heading in (30, 30.0, 31)
    ]
    assert keys[0] == keys[1] != keys[2]


BAD = [
    ("plant=sixdoff", "flight.plant", "sixdof"),
    ("law.standof_m=3", "flight.law.standof_m", "did you mean 'standoff_m'"),
    ("law.gains=paper_2", "flight.law.gains", "paper_1"),
    ("law.name=nftms", "flight.law.name", "did you mean 'nftsm'"),
    ("duration_s=-5", "flight.duration_s", "> 0"),
    ('duration_s="5"', "flight.duration_s", "a number"),
    ("guidance_period_s=0.052", "flight.guidance_period_s", "not a whole multiple of step_s, 0.005 s"),
    ("wind.steady_mps=[13.0, 0.0]", "flight.wind.steady_mps", "below the airspeed, 13 m/s"),
    ("aircraft=cessna", "flight.aircraft", "skywalker_x8"),
    ("start.airspeed_mps=1e300", "flight.start.airspeed_mps", "of 1e+09 at most in size"),
    ("duration_s=400000", "flight.duration_s", "8e+06 guidance periods of 0.05 s, must be 4e+06 at most"),
]


@pytest.mark.parametrize(("setting", "key", "hint"), BAD)
def test_a_bad_setting_is_one_line_and_exit_code_2(file: Path, setting: str, key: str, hint: str) -> None:
    done = command("fly", file, "--set", setting)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"--set {setting}: {key}: ")
    assert hint in line


def test_a_mistake_in_the_file_is_told_with_its_line(file: Path) -> None:
    write(file, FILE.replace('"paper_1"', '"papre"'))
    done = command("check", file)
    assert done.returncode == 2
    assert done.stderr.startswith(f"{file}:6: flight.law.gains: ")


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        (["start.airspeed_mps=7"], "flight.start.airspeed_mps: no level trim at 7 m/s"),
        (["start.altitude_m=12"], "flight.start.altitude_m: 12 m is not above 15 m"),
    ],
)
def test_what_the_airframe_cannot_do_is_one_line_and_exit_code_2(file: Path, settings: list[str], told: str) -> None:
    words = [word for setting in ["plant=sixdof", *settings] for word in ("--set", setting)]
    done = command("fly", file, *words)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert told in line
    assert done.stdout == ""


@pytest.mark.parametrize(
    ("broken", "old", "new", "told"),
    [
        ("plane.xml", "aero/q-hat </property>", "aero/q-hut </property>", "plane.xml: unknown properties aero/q-hut"),
        ("plane.xml", "</fdm_config>", "", "plane.xml:"),
        ("airframe.toml", "[meta]", "[meta", "airframe.toml: not valid TOML"),
        ("airframe.toml", "alpha_stall", "alpha_stal", "airframe.toml: aero.alpha_stall.v must be a number"),
        ("inner_loop.toml", "[limit]", "[limits]", "inner_loop.toml: limit.bank-rad.v must be a number"),
        ("inner_loop.toml", "", None, "inner_loop.toml: No such file"),
    ],
)
def test_a_broken_airframe_is_one_line_that_names_its_file(
    file: Path, broken: str, old: str, new: str | None, told: str
) -> None:
    airframe = copied_airframe("ultra_stick_25e", file.parent / "plane")
    flown = ("plant=sixdof", f"aircraft={airframe}")
    flight = flight_of(read_file(file, flown))
    assert flight.aircraft == str(airframe)
    text = (airframe / broken).read_text(encoding="utf-8")
    if new is None:
        (airframe / broken).unlink()
    else:
        assert old in text
        write(airframe / broken, text.replace(old, new, 1))
    with pytest.raises(BadInput) as caught:
        flight_of(read_file(file, flown))
    (line,) = caught.value.message.splitlines()
    assert line.startswith("--set aircraft=")
    assert f": flight.aircraft: {airframe}" in line
    assert told in line


def test_what_is_there_is_replaced_only_where_that_can_be_meant(tmp_path: Path) -> None:
    recording, protected = tmp_path / "old.rrd", tmp_path / "protected.rrd"
    recording.touch()
    protected.touch(mode=0o444)
    assert writable(recording) == recording
    for path in (protected, Path("/dev/null"), tmp_path / ("x" * 300), tmp_path / "nowhere" / "x.rrd"):
        with pytest.raises(BadInput, match=re.escape(str(path))):
            writable(path)
    for path in (recording, recording / "below"):
        with pytest.raises(BadInput, match=re.escape(str(path))):
            writable_folder(path)
    assert writable_folder(tmp_path / "a" / "b").is_dir()


@pytest.mark.parametrize("where", ["nowhere/flight.rrd", "."])
def test_a_recording_that_cannot_be_written_is_refused_before_the_flight(
    file: Path, tmp_path: Path, where: str
) -> None:
    before = sorted(tmp_path.rglob("*"))
    done = command("fly", file, "--rrd", tmp_path / where)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert done.stdout == ""
    assert sorted(tmp_path.rglob("*")) == before


def test_a_law_that_leaves_its_domain_is_flown_with_warnings(file: Path) -> None:
    done = command(
        "fly",
        file,
        "--set",
        "wind.steady_mps=[8.0,0.0]",
        "--set",
        "target.speed_mps=7.0",
        "--set",
        "target.heading_deg=180",
    )
    assert done.returncode == 0
    assert "INFEASIBLE" in done.stdout
    assert "infeasible" not in done.stderr  # said once
    assert "Remark 1" in done.stderr


def test_help_needs_none_of_the_heavy_libraries() -> None:
    code = (
        "import sys\n"
        "from harness.cli.main import harness\n"
        "harness.main(['--help'], standalone_mode=False)\n"
        "heavy = {'jsbsim', 'pandas', 'rerun', 'scipy', 'matplotlib', 'numpy', 'pydantic'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    done = python(code)
    assert done.returncode == 0, done.stderr
    assert "Example" in done.stdout


@pytest.mark.parametrize(("name", "entry"), [item for group in COMMANDS.values() for item in group.items()])
def test_every_command_says_what_it_does_and_prints_and_shows_an_example(name: str, entry: Entry) -> None:
    text = invoke(name, "--help").stdout
    assert (load(name).help or "").splitlines()[0] == entry.sentence  # as `harness --help` says
    assert "Example" in text
    assert f"harness {name}" in text.partition("Example")[2]
    assert re.search(r"\b[Pp]rints?\b", text)


def test_the_help_groups_its_commands() -> None:
    _, *groups = re.split(r"^(?=\S.*:$)", invoke("--help").stdout.partition("Options:")[2], flags=re.MULTILINE)
    told = {group.splitlines()[0]: re.findall(r"^  (\w+)", group, flags=re.MULTILINE) for group in groups}
    assert told == {f"{heading}:": list(entries) for heading, entries in COMMANDS.items()}


def test_a_commands_help_imports_that_command_alone() -> None:
    code = (
        "import sys\n"
        "from harness.cli.main import COMMANDS, harness\n"
        "harness.main(['check', '--help'], standalone_mode=False)\n"
        "print([name for group in COMMANDS.values() for name in group if f'harness.cli.{name}' in sys.modules])\n"
    )
    done = python(code)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "['check']"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("fyl", "harness: No such command 'fyl'. Did you mean 'fly'?; try"),
        (
            "list planes",
            "harness list: Invalid value for '{laws|aircraft|plants|metrics|margins|settings}': 'planes' is not",
        ),
        ("run", "harness run: Missing argument 'FILE'; try"),
        ("run x.toml --wokers 2", "harness run: No such option '--wokers'"),
        ("run x.toml --out", "harness run: Option '--out' requires an argument; try 'harness run --help'"),
        ("run x.toml --out x --workers two", "harness run: Invalid value for '--workers': 'two' is not"),
        ("run x.toml", "--out DIR is missing"),
        ("run x.toml --out x", "x.toml: No such file or directory"),
    ],
)
def test_a_mistyped_command_line_is_one_line_and_exit_code_2(words: str, told: str) -> None:
    done = command(*words.split())
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert told in line  # after the name by which the command was called
    assert not done.stdout


def test_output_that_nobody_reads_ends_the_command_quietly(file: Path) -> None:
    for words in (("list", "metrics"), ("fly", file, "--set", "law.name=smc", "--set", "law.gains=paper"), ("--help",)):
        reader, writer = os.pipe()
        os.close(reader)
        done = subprocess.run(words_of(*words), stdout=writer, stderr=subprocess.PIPE, check=False)
        os.close(writer)
        assert done.returncode == 128 + signal.SIGPIPE
        assert not done.stderr


def test_output_for_which_there_is_no_room_is_one_line() -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(words_of("list", "metrics"), stdout=full, stderr=subprocess.PIPE, check=False)
    assert done.returncode == 2
    assert done.stderr.decode() == "standard output: No space left on device\n"


@pytest.mark.parametrize("kind", ["laws", "aircraft", "plants", "metrics", "margins", "settings"])
def test_every_kind_is_listed(kind: str) -> None:
    done = command("list", kind)
    assert done.returncode == 0
    assert len(done.stdout.splitlines()) >= 2


def test_the_settings_are_listed_with_every_key_that_set_takes_each_with_default_and_meaning(file: Path) -> None:
    lines = invoke("list", "settings").stdout.splitlines()
    told = {line.split()[0]: line for line in lines if line and "  " in line}
    settings = json.loads(invoke("fly", file, "--json").stdout)["flight"]
    for key, value in settings.items():
        for name in [f"{key}.{inner}" for inner in value] if isinstance(value, dict) else [key]:
            assert name in told
    for name in ("law.c1", "target.segments.turn_rate_deg_s", "wind.gusts.to_s", "assess.sideslip_deg"):
        assert name in told
    assert re.fullmatch(r"start\.heading_deg +° +30\.0 +direction of the air velocity, .*", told["start.heading_deg"])
    assert told["wind.turbulence"].endswith("; one of none, light, moderate, severe")


def test_the_experiment_to_start_from_checks_and_runs_as_it_is_and_with_all_that_its_comments_offer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    told = invoke("init", 'a "new" question').stdout.splitlines()
    file = Path('a "new" question.toml')
    assert told == [str(file), f"next: harness check '{file}', harness run '{file}' --out 'out/{file.stem}'"]
    checked = invoke("check", file)
    assert (checked.exit_code, checked.stderr) == (0, "")
    assert checked.stdout.startswith(f"{file.stem}\n")
    assert "56 flights" in checked.stdout
    run = invoke("run", file, "--out", "out", "--limit", "2", "--workers", "0", "--log", "none")
    assert "2 flown, 0 earlier, 0 failed" in run.stdout
    everything = re.sub(r"^# (?=\S+ = |\[)", "", file.read_text(), flags=re.MULTILINE)
    assert invoke("check", write(tmp_path / "all.toml", everything)).exit_code == 0
    assert "exclude" in everything
    again = invoke("init", file)
    assert (again.exit_code, again.stderr) == (2, f"{file}: exists already; choose another name\n")
    inside = invoke("init", tmp_path)
    assert (inside.exit_code, inside.stderr) == (2, f"{tmp_path}: is a folder, must be the name of a file\n")


def test_a_long_path_is_never_cut(file: Path, tmp_path: Path) -> None:
    deep = tmp_path.joinpath(*["a_folder_with_a_long_name"] * 6)
    deep.mkdir(parents=True)
    for setting, path in (("aircraft", deep / "plane"), ("target.track", deep / "track.csv")):
        told = invoke("check", file, "--set", f"{setting}={path}").stderr
        assert told.startswith(f"--set {setting}={path}: flight.{setting}: ")
        assert told.count(str(path)) == 2  # what was typed, and in the message
    out = deep / "out"
    run = invoke("run", file, "--out", out, "--set", "seed=[1,2]", "--workers", "0", "--log", "none").stdout
    assert f"results in {out}\nnext: harness show {out}, " in run
    assert invoke("check", deep / "none.toml").stderr == f"{deep / 'none.toml'}: No such file or directory\n"


COMPLETED = [
    ("", "fl", ["fly"]),
    ("list", "se", ["settings"]),
    ("fly x.toml", "--ag", ["--against"]),
    ("fly x.toml --set", "start.h", ["start.heading_deg=", "start.heading_deg=30.0"]),
    ("run x.toml --set", "law.dir", ["law.direction=", "law.direction=paper", "law.direction=mirrored"]),
    ("check x.toml --set", "law.direction=m", ["law.direction=mirrored"]),
    ("predict x.toml --set", "plant=s", ["plant=sixdof"]),
    ("fly x.toml --set", "aircraft=sky", ["aircraft=skywalker_x8"]),
    ("fly x.toml --set", "inner_loop.rate_trim=", ["inner_loop.rate_trim=true", "inner_loop.rate_trim=false"]),
    ("show out --where", "law.k2=", ["law.k2=12", "law.k2=3"]),
    ("compare out --set", "assess.turn", ["assess.turn_ratio=", "assess.turn_ratio=0.05"]),
    ("compare out --set", "law.", []),
    ("fly x.toml --set", "wind.s", ["wind.steady_mps=", "wind.shear_mps_per_m="]),
    ("fly x.toml --set", "nothing", []),
]


@pytest.mark.parametrize(("words", "begun", "offered"), COMPLETED)
def test_the_shell_completes_keys_of_settings_and_values_of_a_closed_list(
    words: str, begun: str, offered: list[str]
) -> None:
    shell = ShellComplete(command_line, {}, "harness", "_HARNESS_COMPLETE")
    assert [item.value for item in shell.get_completions(words.split(), begun)] == offered


def test_bash_is_given_the_completion() -> None:
    words = {"_HARNESS_COMPLETE": "bash_complete", "COMP_WORDS": "harness\nfly\n--set\nplant=l", "COMP_CWORD": "3"}
    main = "import sys; sys.argv[0] = 'harness'; from harness.cli.main import main; main()"
    done = subprocess.run([sys.executable, "-c", main], env={**os.environ, **words}, capture_output=True, check=False)
    assert done.stdout == b"plain,plant=lagged\n"


@pytest.mark.parametrize("words", ["fly a.toml", "list laws", "--help"])
def test_a_working_directory_that_is_gone_is_told(tmp_path: Path, words: str) -> None:
    line = f"cd {tmp_path}; mkdir gone; cd gone; rmdir ../gone; {sys.executable} -m harness {words}"
    done = subprocess.run(
        ["sh", "-c", line], capture_output=True, text=True, check=False, env={**os.environ, "PYTHONPATH": str(ROOT)}
    )
    assert done.returncode == 2
    assert done.stderr == "the working directory no longer exists: change to another one, with cd\n"


def on_a_terminal(columns: int, *words: object) -> list[str]:
    """The lines that a command prints on a terminal so wide."""
    ours, terminal = pty.openpty()
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 50, columns, 0, 0))
    environment = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "NO_COLOR")}
    with subprocess.Popen(words_of(*words), stdout=terminal, stderr=subprocess.DEVNULL, env=environment) as process:
        os.close(terminal)
        shown = b""
        with contextlib.suppress(OSError):  # the end of what a terminal shows
            while part := os.read(ours, 65536):
                shown += part
    os.close(ours)
    assert process.returncode == 0
    return shown.decode().splitlines()


@pytest.mark.parametrize("columns", [80, 120, 200])
def test_on_a_terminal_tables_fit_and_in_a_pipe_a_row_is_a_line(columns: int) -> None:
    shown = on_a_terminal(columns, "list", "metrics")
    assert 0.7 * columns < max(map(len, shown)) <= columns
    assert "\x1b[" not in "".join(shown)
    piped = command("list", "metrics").stdout.splitlines()
    assert len(piped) == len(METRICS) + 2


def test_the_numeric_libraries_of_a_command_use_one_thread() -> None:
    """Of many, on a busy machine, each waits for the others: it took ten times as long."""
    code = """if True:
        import os, sys
        from harness.cli.main import main
        sys.argv = ["harness", "predict", "experiments/stationary.toml"]
        try:
            main()
        finally:
            import numpy as np
            np.linalg.svd(np.ones((2000, 50)))
            print(len(os.listdir("/proc/self/task")), file=sys.stderr)
    """
    many = {name: value for name, value in os.environ.items() if not name.endswith("_THREADS")}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT, env=many)
    assert done.stderr.splitlines()[-1] == "1"
