"""The command line: `harness COMMAND`. Exit codes: 0 ok, 1 a flight failed, 2 bad input, 130 interrupted."""

import sys
import warnings

import click

from harness.cli._stdout import guard
from harness.cli.check import check
from harness.cli.compare import compare
from harness.cli.demo import demo
from harness.cli.doctor import doctor
from harness.cli.export import export
from harness.cli.fly import fly
from harness.cli.identify import identify
from harness.cli.list import list_
from harness.cli.predict import predict
from harness.cli.report import report
from harness.cli.reproduce import reproduce
from harness.cli.run import run
from harness.cli.show import show
from harness.cli.view import view


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(package_name="standoff-harness")
def harness() -> None:
    """Fly a guidance law on the kinematic aircraft it was proved on, and on a JSBSim aircraft in wind.

    \b
    Example:
      harness fly experiments/stationary.toml --set plant=kinematic
    """


for command in (
    fly,
    run,
    show,
    view,
    export,
    compare,
    report,
    check,
    list_,
    demo,
    reproduce,
    identify,
    predict,
    doctor,
):
    harness.add_command(command)


def main() -> None:
    """The entry point."""
    guard()
    warnings.formatwarning = lambda message, *_, **__: f"warning: {message}\n"
    try:
        code = harness.main(standalone_mode=False)
    except click.ClickException as error:
        _tell(error)
        code = error.exit_code
    except OSError as error:
        if error.filename is None:
            raise  # a fault of the harness, not of a file
        click.echo(f"{error.filename}: {error.strerror}", err=True)
        code = 2
    except (KeyboardInterrupt, click.Abort):
        click.echo("interrupted", err=True)
        code = 130
    sys.exit(code if isinstance(code, int) else 0)


def _tell(error: click.ClickException) -> None:
    """On one line, also what Click tells on several; a command without a word is told how it is used."""
    if isinstance(error, click.UsageError) and not isinstance(error, click.exceptions.NoArgsIsHelpError):
        command = error.ctx.command_path if error.ctx else "harness"
        message = " ".join(error.format_message().split()).rstrip(".")
        click.echo(f"{command}: {message}; try '{command} --help'", err=True)
    else:
        error.show()
