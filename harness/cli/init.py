"""`harness init`: an experiment to start from."""

from pathlib import Path

import click

from harness.cli._paths import PATH

EXPERIMENT = Path(__file__).with_name("init.toml")


@click.command()
@click.argument("name", type=PATH)
def init(name: Path) -> None:
    """Write a commented experiment to start from.

    Writes NAME.toml, a file of 56 flights that can be flown as it is; its comments say what else can be set. A file
    that exists is kept. Prints the file and what to type next.

    \b
    Example:
      harness init my_wind
    """
    from shlex import quote

    from harness.cli._input import BadInput
    from harness.cli._paths import writable
    from harness.files import write_text
    from harness.toml_text import shown

    if name.is_dir():
        raise BadInput(f"{name}: is a folder, must be the name of a file")
    file = name if name.suffix == ".toml" else name.with_name(f"{name.name}.toml")
    if file.exists():
        raise BadInput(f"{file}: exists already; choose another name")
    title = shown(file.stem)
    write_text(writable(file), EXPERIMENT.read_text(encoding="utf-8").format(title=title[1:-1]))
    typed, out = quote(str(file)), quote(str(Path("out") / file.stem))
    click.echo(f"{file}\nnext: harness check {typed}, harness run {typed} --out {out}")
