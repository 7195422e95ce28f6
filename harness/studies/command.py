"""What the studies' commands share: a folder to write to, progress, and every error on one line."""

import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TypeVar

import click

from harness.error import HarnessError
from harness.files import make_folder, write_text

Item = TypeVar("Item")

out_option = click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("docs/answers"),
    show_default=True,
    help="The folder to write to.",
)


def run(command: click.Command, module: str) -> None:
    """Runs the command of a module and ends the process with 0, with 2 for bad input, with 130 when interrupted."""
    name = f"python -m {module}"
    try:
        command.main(prog_name=name, standalone_mode=False)
    except click.UsageError as error:
        _end(f"{name}: {' '.join(error.format_message().split()).rstrip('.')}; try '{name} --help'", 2)
    except HarnessError as error:
        _end(str(error), 2)
    except OSError as error:
        if error.filename is None:
            raise  # a fault of the study, not of a file
        _end(f"{error.filename}: {error.strerror}", 2)
    except (KeyboardInterrupt, click.Abort):
        _end("interrupted", 130)


def _end(message: str, code: int) -> None:
    click.echo(message, err=True)
    sys.exit(code)


def write(folder: Path, texts: Mapping[str, str]) -> None:
    """Writes each text whole to the file of its name, and says where. OSError when a file cannot be written."""
    for name, text in texts.items():
        make_folder((folder / name).parent)
        write_text(folder / name, text)
        click.echo(folder / name)


def counted(items: Iterable[Item], total: int, what: str) -> Iterator[Item]:
    """The items as they come; on a terminal a bar counts them."""
    from rich.console import Console
    from rich.progress import MofNCompleteColumn, Progress

    terminal = Console(stderr=True)
    columns = (*Progress.get_default_columns(), MofNCompleteColumn())
    with Progress(*columns, console=terminal, transient=True, disable=not terminal.is_terminal) as bar:
        task = bar.add_task(what, total=total)
        for item in items:
            yield item
            bar.advance(task)
