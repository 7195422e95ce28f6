"""`harness init`: an experiment, or a law, to start from."""

from pathlib import Path

import click

from harness.cli._paths import PATH

EXPERIMENT = Path(__file__).with_name("init.toml")
LAW = Path(__file__).with_name("init_law.py")


@click.command()
@click.argument("name", type=PATH)
@click.option("--law", is_flag=True, help="Write a guidance law in Python, NAME.py, instead.")
def init(name: Path, law: bool) -> None:
    """Write a commented experiment, or law, to start from.

    Writes NAME.toml, a file of 56 flights that can be flown as it is; its comments say what else can be set. With --law
    writes NAME.py, a guidance law that flies as it is. A file that exists is kept. Prints the file and what to type
    next.

    \b
    Examples:
      harness init my_wind
      harness init --law my_law.py
    """
    from shlex import quote

    from harness.cli._input import BadInput
    from harness.cli._paths import writable
    from harness.files import write_text
    from harness.toml_text import shown

    if name.is_dir():
        raise BadInput(f"{name}: is a folder, must be the name of a file")
    suffix = ".py" if law else ".toml"
    file = name if name.suffix == suffix else name.with_name(f"{name.name}{suffix}")
    if file.exists():
        raise BadInput(f"{file}: exists already; choose another name")
    if law:
        write_text(writable(file), LAW.read_text(encoding="utf-8").replace("THIS_FILE.py", file.name))
        typed = quote(str(file))
        click.echo(f"{file}\nnext: harness check {typed}, harness fly FILE.toml --set law.name={typed}:MyLaw")
        return
    title = shown(file.stem)
    write_text(writable(file), EXPERIMENT.read_text(encoding="utf-8").format(title=title[1:-1]))
    typed, out = quote(str(file)), quote(str(Path("out") / file.stem))
    click.echo(f"{file}\nnext: harness check {typed}, harness run {typed} --out {out}")
