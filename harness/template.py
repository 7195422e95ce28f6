"""The template of a page or a document, from the folder of the package that fills it in."""

from jinja2 import Environment, PackageLoader, StrictUndefined, Template


def template(package: str, name: str) -> Template:
    """The Jinja template of this name; what goes into an HTML page is escaped, a name left unfilled is an error."""
    return Environment(
        loader=PackageLoader(package, "."),
        autoescape=".html" in name,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    ).get_template(name)
