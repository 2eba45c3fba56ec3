"""The templates beside this file, with the words that they share."""

from functools import cache
from pathlib import Path

import jinja2

from fem_reference.foundations.markup import exact
from fem_reference.report.words import duration, number, words


def template(name: str) -> jinja2.Template:
    """The template in the file ``name``: what it is filled with is escaped, and a name that it lacks is an error."""
    return _environment().get_template(name)


@cache
def _environment() -> jinja2.Environment:
    """The environment of the templates, each of which is compiled when it is first asked for."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"number": number, "duration": duration, "exact": exact, "words": words}
    return environment
