"""Jinja templates of pages and documents, which lie beside the code that fills them in."""

from jinja2 import Environment, PackageLoader, StrictUndefined, Template

from harness import markup


def template(package: str, name: str) -> Template:
    """The template `name` in the folder of `package`. Values in HTML are escaped; an undefined name is an error."""
    environment = Environment(
        loader=PackageLoader(package, "."),
        autoescape=".html" in name,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"markdown": markup.markdown, "code": markup.code, "block": markup.block}
    return environment.get_template(name)
