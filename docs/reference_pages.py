"""Generated parts of the reference pages, from the code: keys of records, verbs, public names, cases.

``fill`` replaces each ``<!-- generated: NAME -->`` of a page.
"""

import argparse
import inspect
import json
import re
from collections.abc import Callable, Iterable, Iterator
from html import escape
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

import example_pictures
from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic_core import PydanticUndefined

import fem_reference as fr
from fem_reference import effects, solvers
from fem_reference.assessment.baseline import Baseline
from fem_reference.cli._parser import parser
from fem_reference.foundations.records import Record, keys
from fem_reference.foundations.units import LENGTH_UNITS, length_unit, unit_of
from fem_reference.problems import of_case
from fem_reference.report import gallery as gallery_of_runs
from fem_reference.report.embedded import picture_source
from fem_reference.runs.contents import Contents
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.scenes.muscles import MusclesCase
from fem_reference.scenes.scalar import ScalarCase
from fem_reference.solvers.command import Description
from fem_reference.solvers.recorded import About
from fem_reference.studies.hard.records import Hard

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
_BOUNDS = {Gt: ("gt", ">"), Ge: ("ge", "≥"), Lt: ("lt", "<"), Le: ("le", "≤")}
_WORDS = {str: "string", float: "number", int: "whole number", bool: "true or false", NoneType: "", Any: "any value"}


def fill(text: str) -> str:
    """``text`` of a page with its generated parts."""
    return re.sub(r"<!-- generated: (\w+) -->\n", lambda found: GENERATED[found[1]](), text)


def scene_records() -> list[type[Record]]:
    """The records of scene files, each once: the cases and all records inside them."""
    return list(dict.fromkeys(inner for case in (MuscleCase, MusclesCase, ScalarCase) for inner in _and_below(case)))


def solver_records() -> dict[str, list[type[Record]]]:
    """The records of the settings of each solver, by its name, for all tasks that it solves."""
    return {
        name: list(dict.fromkeys(record for offer in solvers.offers(name) for record in _and_below(offer.settings)))
        for name in solvers.names()
    }


def effect_records() -> dict[str, list[type[Record]]]:
    """The record of each effect and the records inside it, by the name of the effect."""
    return {name: list(_and_below(effects.find(name))) for name in effects.names(Record)}


def file_records() -> dict[str, list[type[Record]]]:
    """The records of each other file that users write or read, by the name of the file, without the records of scenes."""
    files = {
        "candidate.toml": About,
        "candidate.toml of a program": Description,
        "a hard case": Hard,
        "a baseline": Baseline,
        "run.json": Contents,
    }
    known = scene_records()
    return {name: [one for one in dict.fromkeys(_and_below(top)) if one not in known] for name, top in files.items()}


def files() -> str:
    """The keys of other files."""
    return _sections(file_records())


def scenes() -> str:
    """The keys of scene files."""
    return "".join(_section(record.__name__, record) for record in scene_records())


def settings() -> str:
    """The settings of solvers."""
    return _sections(solver_records())


def laws() -> str:
    """The effects with their formulas."""
    return _sections(effect_records())


def parameters() -> str:
    """One table with the formula and the parameters of every effect; the page describes the key ``in``, the region, in its text."""
    rows = [
        f"| `{name}` | {_formula(effects.find(name))} | {'; '.join(map(_parameter, keys.items()))} |\n"
        for name, keys in _parameters().items()
    ]
    return "| effect | formula | parameters |\n|---|---|---|\n" + "".join(rows)


def ranges() -> str:
    """The ranges of parameters of effects in the literature."""
    rows = [
        f"| `{name}.{key}` | {one.low} to {one.high}, {one.spread} | {_cell(one.source)} |\n"
        for name in effects.names()
        for key, one in effects.find(name).published.items()
    ]
    return "| parameter | range | source |\n|---|---|---|\n" + "".join(rows)


def verbs() -> str:
    """The help of each verb."""
    (kinds,) = (action for action in parser()._actions if isinstance(action, argparse._SubParsersAction))
    return "\n".join(f"### {name}\n\n```text\n{verb.format_help()}```\n" for name, verb in kinds.choices.items())


def api() -> str:
    """The public names."""
    return "\n".join(_automatic(name) for name in fr.__all__)


def cases() -> str:
    """The shipped cases in one table."""
    read = map(casefile.read, casefile.cases())
    rows = "".join(f"| `{one.name}` | {_cell(one.title)} | {'yes' if one.needed_data else ''} |\n" for one in read)
    return "| case | title | needs data |\n|---|---|---|\n" + rows


def gallery() -> str:
    """The shipped cases, one by one."""
    return "\n".join(_shown(casefile.read(name)) for name in casefile.cases())


def examples() -> str:
    """The complete scripts."""
    scripts = sorted(EXAMPLES.glob("*.py")) + sorted(EXAMPLES.glob("effects/*.py"))
    return "\n".join(_script(path.relative_to(EXAMPLES).as_posix()) for path in scripts)


def cards() -> str:
    """The examples with pictures, each a link to its source."""
    return f'```{{raw}} html\n<div class="cards">\n{"".join(map(_card, example_pictures.sources()))}</div>\n```\n'


def notebooks() -> str:
    """The complete notebooks: their text and code."""
    return "\n".join(map(_notebook, sorted(EXAMPLES.glob("*.ipynb"))))


GENERATED: dict[str, Callable[[], str]] = {
    "effects": laws,
    "ranges": ranges,
    "verbs": verbs,
    "api": api,
    "gallery": gallery,
    "examples": examples,
    "cards": cards,
    "notebooks": notebooks,
}


def _parameters() -> dict[str, dict[str, Any]]:
    found = {name: _fields(records[0]) for name, records in effect_records().items()}
    return {name: {key: field for key, field in fields.items() if key != "in"} for name, fields in found.items()}


def _formula(record: type[Record]) -> str:
    """The first paragraph of the docstring of an effect."""
    return _cell(_markdown(inspect.getdoc(record) or "").partition("\n\n")[0])


_SHORTER = {
    re.escape("list of `RampPoint` tables (at least 1)"): "list of `{ frame, amount }`",
    r"vector \[(.*?)\]": r"vector, \1",
    r"quantity \[(.*?)\]": r"\1",
    r" \((.*)\)": r", \1",
}


def _parameter(named: tuple[str, Any]) -> str:
    """A key with its allowed values; for a quantity only the unit."""
    key, field = named
    value = _value(field.annotation, field.metadata)
    for long, short in () if _rule(field.annotation, field.metadata) else _SHORTER.items():
        value = re.sub(long, short, value)
    return f"`{key}` ({_cell(value)}{'' if field.is_required() else ', optional'})"


def _script(name: str) -> str:
    return f"## {name}\n\n```{{literalinclude}} ../examples/{name}\n:language: python\n```\n"


def _card(name: str) -> str:
    return (
        f'<a href="#{re.sub("[^a-z]+", "-", name)}"><img src="_static/examples/{example_pictures.picture(name).name}" alt="">'
        f"<b>{escape(example_pictures.title(name))}</b><code>{name}</code></a>\n"
    )


def _notebook(path: Path) -> str:
    """The cells of a notebook below a heading with its file name; the notebook's own heading becomes a bold line."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    texts = [(cell["cell_type"], "".join(cell["source"])) for cell in cells]
    shown = [f"```python\n{text}\n```" if kind == "code" else text for kind, text in texts]
    shown[0] = re.sub("^# (.*)", r"**\1**", shown[0])
    shown.append(f"![The last figure](_static/examples/{example_pictures.picture(path.name).name})")
    return "\n\n".join([f"## {path.name}", *shown]) + "\n"


def _automatic(name: str) -> str:
    entry = getattr(fr, name)
    kind = (
        ("autoexception" if issubclass(entry, Exception) else "autoclass") if inspect.isclass(entry) else "autofunction"
    )
    members = "   :members:\n" if kind == "autoclass" and not issubclass(entry, Record) else ""
    return f"## {name}\n\n```{{eval-rst}}\n.. {kind}:: fem_reference.{name}\n{members}```\n"


def _shown(case: Any) -> str:
    candidates = ", ".join(f"`{one.name}`" for one in case.candidate) or "none"
    rows = [*case.facts.items(), ("effects", ", ".join(case.acting)), ("reference", f"`{case.reference.solver}`")]
    table = "".join(f"| {name} | {_cell(text)} |\n" for name, text in [*rows, ("candidates", candidates)])
    return f"## {case.name}\n\n{case.title}. {case.proves}\n\n{_pictures(case)}| | |\n|---|---|\n{table}"


def _pictures(case: Any) -> str:
    """Two views of a muscle and its bones at rest; empty for separately licensed data, or if nothing can draw."""
    if not isinstance(case, MuscleCase) or case.needed_data:
        return ""
    rest = of_case.setup(case)
    try:
        views = gallery_of_runs.draw(rest, rest.surface, [gallery_of_runs.Shot("rest", 0, rest.surface.points)])[0]
    except fr.MissingSoftware:
        return ""
    kept = (picture_source(view) for view in views)
    return "".join(f'<img src="{one}" alt="{case.name} at rest" width="48%">\n' for one in kept) + "\n"


def _sections(records: dict[str, list[type[Record]]]) -> str:
    """A section for each name: the table of its first record, then the tables of the records inside it, each record once."""
    made, seen = "", set()
    for name, of_it in records.items():
        for record in of_it:
            title = f"`{name}`" if record is of_it[0] else f"{record.__name__} of `{name}`"
            made += "" if record in seen else _section(title, record)
            seen.add(record)
    return made


def _section(title: str, record: type[Record]) -> str:
    if record is effects.Effect:
        return f"### {title}\n\nAn effect, written as in a case ([Effects](effects.md#formulas-and-parameters)).\n\n"
    rows = [_row(name, field) for name, field in _fields(record).items()]
    table = "| key | value | default |\n|---|---|---|\n" + "".join(rows) if rows else "It has no keys of its own.\n"
    return f"### {title}\n\n{_markdown(inspect.getdoc(record) or '')}\n\n{table}\n"


def _row(name: str, field: Any) -> str:
    default = field.default_factory() if field.default_factory else field.default
    absent = {PydanticUndefined: "required", None: "none"}.get(_hashable(default)) or f"`{_plain(default)}`"
    return f"| `{name}` | {_cell(_value(field.annotation, field.metadata))} | {_cell(absent)} |\n"


def _value(annotation: Any, metadata: Any = ()) -> str:
    """The allowed values of a key, in words."""
    unit, origin, inside = unit_of(metadata), get_origin(annotation), get_args(annotation)
    if rule := _rule(annotation, metadata):
        return rule
    after = _bounds(metadata)
    if unit:
        return f"{'vector' if origin is tuple else 'quantity'} [{unit}]{after}"
    if hasattr(annotation, "__metadata__"):
        return _value(annotation.__origin__, (*annotation.__metadata__, *metadata))
    if origin is Literal:
        return _either(f"`{_plain(value)}`" for value in inside) + after
    if origin in (Union, UnionType):
        return _either(dict.fromkeys(filter(None, map(_value, inside)))) + after
    if origin is tuple and inside[-1:] == (Ellipsis,):
        return f"list of {_many(_value(inside[0]))}{after}"
    if origin is tuple:
        return f"list of {len(inside)} {_many(_value(inside[0]))}{after}"
    if origin is dict:
        return f"table of {_many(_value(inside[1]))}{after}"
    if isinstance(annotation, type) and issubclass(annotation, Record):
        return f"`{annotation.__name__}` table"
    return _WORDS.get(annotation, getattr(annotation, "__name__", str(annotation))) + after


def _either(values: Iterable[str]) -> str:
    """Alternatives in words."""
    *first, last = values
    return f"{', '.join(first)} or {last}" if first else last


def _many(value: str) -> str:
    """The plural of the words of a value."""
    return re.sub(r"\b(list|number|string|table|value)\b", r"\1s", value).replace("quantity", "quantities")


def _bounds(metadata: Any) -> str:
    """The bounds of a value, in brackets; empty if there are none."""
    bounds = [
        f"{sign} {getattr(one, key):g}" for one in metadata for of, (key, sign) in _BOUNDS.items() if type(one) is of
    ]
    bounds += [f"at least {one.min_length}" for one in metadata if isinstance(one, MinLen)]
    bounds += [f"at most {one.max_length}" for one in metadata if isinstance(one, MaxLen)]
    return f" ({', '.join(bounds)})" if bounds else ""


def _rule(annotation: Any, metadata: Any) -> str:
    """The rule for a text, in the words of the check that refuses an empty text; empty if no check does."""
    checks = [getattr(entry, "func", None) for entry in metadata]
    if length_unit in checks:
        return f"unit of length: {', '.join(f'`"{unit}"`' for unit in LENGTH_UNITS)}"
    for check in filter(None, checks if annotation is str else []):
        try:
            check("")
        except ValueError as error:
            return str(error)
    return ""


def _and_below(record: type[Record]) -> Iterator[type[Record]]:
    """A record and all records inside it."""
    yield record
    for field in _fields(record).values():
        yield from (inner for kind in _kinds(field.annotation) for inner in _and_below(kind))


def _fields(record: type[Record]) -> dict[str, Any]:
    """The fields of a record by their keys in files."""
    named = {field.alias or name: field for name, field in record.model_fields.items()}
    return {key: named[key] for key in keys(record)}


def _kinds(annotation: Any) -> Iterator[type[Record]]:
    if isinstance(annotation, type) and issubclass(annotation, Record):
        yield annotation
    for inside in (*get_args(annotation), *((annotation.__origin__,) if hasattr(annotation, "__metadata__") else ())):
        yield from _kinds(inside)


def _markdown(docstring: str) -> str:
    """A docstring as Markdown: roles become plain code, double backticks single backticks."""
    return re.sub(r":\w+:`~?([^`]+)`", r"`\1`", docstring).replace("``", "`")


def _cell(text: str) -> str:
    return str(text).replace("|", "\\|").replace("\n", " ")


def _plain(value: Any) -> str:
    """A value as a scene file writes it."""
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else str(list(value) if isinstance(value, tuple) else value)


def _hashable(value: Any) -> Any:
    return value if value is None or value is PydanticUndefined else ""
