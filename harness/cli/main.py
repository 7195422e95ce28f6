"""The command line: `harness COMMAND`. Exit codes: 0 ok, 1 a flight failed, 2 bad input, 130 interrupted."""

from __future__ import annotations

import importlib
import shutil
import signal
import sys
import warnings
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import click

from harness.cli._input import BadInput
from harness.cli._stdout import guard
from harness.error import HarnessError
from harness.neighbours import in_the_way
from harness.tables import WIDTH
from harness.threads import use_one_thread


class Entry(NamedTuple):
    """A command before it is imported."""

    where: str  # module:attribute, the module in this folder
    sentence: str  # what the command does: the first line of its own help


COMMANDS: Mapping[str, Mapping[str, Entry]] = MappingProxyType(
    {
        "One flight": {
            "fly": Entry("fly:fly", "Fly one flight and print its metrics."),
            "check": Entry("check:check", "Check a settings file, or a user-defined law, without flying it."),
            "predict": Entry("predict:predict", "Predict the limit cycle of a flight without flying it."),
            "view": Entry("view:view", "Open flights in the Rerun viewer."),
            "plot": Entry("plot:plot", "Draw flights, or a map of a run, as a figure in print size."),
            "export": Entry("export:export", "Write the log of a flight, or the flights of a run, as a table."),
        },
        "Many flights": {
            "init": Entry("init:init", "Write a commented experiment, or law, to start from."),
            "run": Entry("run:run", "Fly a matrix of flights, or resume it where it stopped."),
            "merge": Entry("merge:merge", "Make one run of the parts that several machines flew."),
            "show": Entry("show:show", "Show the flights of a run, or one of them in full."),
            "compare": Entry("compare:compare", "Compare the flights of a run that differ in one setting alone."),
            "map": Entry("map:map_", "Map where the answer changes over two settings."),
            "falsify": Entry("falsify:falsify", "Search for the flight that violates a requirement most."),
            "tune": Entry("tune:tune", "Search for the settings that do best."),
            "report": Entry("report:report", "Write the comparison as one HTML page with figures."),
        },
        "Real flights": {
            "assess": Entry("assess:assess", "Judge the coordinated-flight assumption on the log of a real flight."),
            "validate": Entry(
                "validate:validate", "Replay the recorded surface commands of a flight on an airframe's model."
            ),
        },
        "The paper": {
            "demo": Entry("demo:demo", "Fly the paper's first case, two laws on three aircraft, and compare."),
            "reproduce": Entry("reproduce:reproduce", "Fly the paper's simulations and check its claims."),
        },
        "Airframes and installation": {
            "list": Entry("list:list_", "List the laws, aircraft, plants, metrics, margins or settings."),
            "adopt": Entry("adopt:adopt", "Make an aircraft of a JSBSim model, with an inner loop of its own."),
            "identify": Entry("identify:identify", "Identify how an airframe follows a heading-rate command."),
            "doctor": Entry("doctor:doctor", "Check this installation: packages, wind, units and the bits of flights."),
        },
    }
)


def load(name: str) -> click.Command:
    """The command of this name, imported."""
    module, _, attribute = _ENTRIES[name].where.partition(":")
    command: click.Command = getattr(importlib.import_module(f"harness.cli.{module}"), attribute)
    return command


class LazyGroup(click.Group):
    """Knows the commands by name and sentence, and imports the one that is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)  # as they are declared

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name, known, rest = super().resolve_command(ctx, args)
        return name, known and load(args[0]), rest

    def invoke(self, ctx: click.Context) -> object:
        try:
            return super().invoke(ctx)
        except HarnessError as error:  # what was given cannot be used, wherever that was found
            raise BadInput(str(error)) from None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        width = max(map(len, self.commands))
        for heading, entries in COMMANDS.items():
            with formatter.section(heading):
                formatter.write_dl([(name.ljust(width), entry.sentence) for name, entry in entries.items()])


_ENTRIES = {name: entry for entries in COMMANDS.values() for name, entry in entries.items()}


@click.group(
    cls=LazyGroup,
    commands={name: click.Command(name, short_help=entry.sentence) for name, entry in _ENTRIES.items()},
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)
@click.version_option(package_name="standoff-harness")
def harness() -> None:
    """Fly a guidance law on the kinematic aircraft that it was proved on and on a JSBSim aircraft in wind.

    \b
    Examples:
      harness demo
      harness fly experiments/stationary.toml --set plant=kinematic
      harness run experiments/wind.toml --out out/wind
      harness compare out/wind
    """


class _Terminated(BaseException):
    """SIGTERM. It is no `SystemExit`, which would count as one of the law that flies just then."""


def _terminate(*_: object) -> None:
    raise _Terminated  # the command ends in order: what was flown is kept


def main() -> None:
    """The entry point."""
    guard()
    use_one_thread()
    warnings.formatwarning = lambda message, *_, **__: f"warning: {message}\n"
    if message := in_the_way():
        click.echo(message, err=True)
        sys.exit(2)
    try:
        Path.cwd()
    except FileNotFoundError:
        click.echo("the working directory no longer exists: change to another one, with cd", err=True)
        sys.exit(2)
    if sys.stdout.isatty():
        WIDTH.set(shutil.get_terminal_size().columns - 2)  # some tables are indented
    signal.signal(signal.SIGTERM, _terminate)
    try:
        code = harness.main(standalone_mode=False)
    except click.ClickException as error:
        _print_error(error)
        code = error.exit_code
    except OSError as error:
        if error.filename is None:
            raise  # a fault of the harness, not of a file
        click.echo(f"{error.filename}: {error.strerror}", err=True)
        code = 2
    except (KeyboardInterrupt, click.Abort):
        click.echo("interrupted", err=True)
        code = 130
    except _Terminated:
        code = 128 + signal.SIGTERM
    sys.exit(code if isinstance(code, int) else 0)


def _print_error(error: click.ClickException) -> None:
    """On one line, also what Click prints on several; the command without any argument prints its help."""
    if isinstance(error, click.UsageError) and not isinstance(error, click.exceptions.NoArgsIsHelpError):
        called = [name for name in sys.argv[1:2] if name in _ENTRIES]  # Click names no command for a missing value
        command = error.ctx.command_path if error.ctx else " ".join(["harness", *called])
        message = " ".join(error.format_message().split()).rstrip(".")
        click.echo(f"{command}: {message}; try '{command} --help'", err=True)
    else:
        error.show()
