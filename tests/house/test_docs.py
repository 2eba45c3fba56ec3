"""The documentation: it builds, nothing is missing in its reference, and its commands and snippets are such."""

import argparse
import importlib.util
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import get_args

import drawn_results
import pages
import pytest
import reference_pages
from browser import PROGRAM, Browser

import fem_reference as fr
from fem_reference import effects, metrics, solvers
from fem_reference.cli import parser
from fem_reference.export import febio
from fem_reference.foundations.records import keys, parse
from fem_reference.runs.contents import Status
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.scenes.muscles import MusclesCase
from fem_reference.scenes.scalar import ScalarCase
from fem_reference.solvers.fenicsx import processes


def listed(page: str, heading: str) -> list[str]:
    """The names at the beginning of rows of the first table of a page whose head begins with ``heading``."""
    text = pages.page(page)
    return re.findall(r"^\| `([\w-]+)", text[text.index(f"| {heading} |") :].split("\n\n")[0], re.MULTILINE)


def test_tables_list_what_there_is() -> None:
    (verbs,) = (action for action in parser()._actions if isinstance(action, argparse._SubParsersAction))
    assert sorted(set(listed("docs/command_line.md", "verb"))) == sorted(verbs.choices)
    assert sorted(listed("docs/fast_solvers.md", "solver")) == solvers.names("solve")
    assert sorted(listed("docs/measures.md", "metric")) == metrics.names()


def test_every_status_of_a_run_is_in_the_table() -> None:
    text = pages.page("docs/measures.md")
    table = text[text.index("| status of a run |") :].split("\n\n")[0]
    first = "".join(row.split("|")[1] for row in table.splitlines())
    assert sorted(re.findall(r"`([a-z ]+)`", first)) == sorted(get_args(Status))


def test_every_effect_of_a_muscle_is_in_the_table() -> None:
    text = pages.page("docs/effects.md")
    table = text[text.index("| effect |") :].split("\n\n")[0]
    first = "".join(row.split("|")[1] for row in table.splitlines())
    assert sorted(re.findall(r"`(\w+)`", first)) == effects.names()


def test_what_febio_has_of_each_effect_is_what_is_exported() -> None:
    """A law that is no longer written would else stay in the table, and a new one be missing there."""
    text = pages.page("docs/effects.md")
    rows = [row.split(" | ") for row in text[text.index("| effect |") :].split("\n\n")[0].splitlines()[2:]]
    written = {name for row in rows if row[-1].startswith("`") for name in re.findall(r"`(\w+)`", row[0])}
    assert written == {effects.name_of(kind) for kind in febio.SAME}


@pytest.mark.slow
@pytest.mark.skipif(not processes.installed(), reason="FEniCSx is not installed")
@pytest.mark.parametrize("size", ["15 mm", pytest.param("10 mm", marks=pytest.mark.nightly)])
def test_the_recipe_of_an_ordinary_muscle_can_be_solved(size: str, tmp_path: Path) -> None:
    """Its last frames on unrefined tetrahedra, at night of its own size, with its volume kept."""
    (text,) = (text for name, text in pages.snippets("toml") if name == "docs/ordinary_muscle.md")
    table = tomllib.loads(text)
    assert table["muscle"]["tet_size"] == "10 mm"
    table["muscle"]["refinements"], table["muscle"]["tet_size"], table["frames"]["every"] = 0, size, 50
    case = fr.make_case(table, name="ordinary_muscle")
    run = fr.solve(case, store=tmp_path)
    assert run.outcome.status == "converged"
    assert fr.compare(case, run, []).word in ("pass", "doubtful pass")


def test_every_key_of_every_record_is_in_the_reference() -> None:
    scene, laws, settings = reference_pages.scenes(), reference_pages.laws(), reference_pages.settings()
    places = [(scene, reference_pages.scene_records())]
    places += [(laws, records) for records in reference_pages.effect_records().values()]
    places += [(settings, records) for records in reference_pages.solver_records().values()]
    places += [(reference_pages.files(), records) for records in reference_pages.file_records().values()]
    for text, records in places:
        for record in records:
            section = next(part for part in text.split("### ") if _said(record) in part)
            assert re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE) == keys(record), record
    assert {MuscleCase, MusclesCase, ScalarCase} < set(reference_pages.scene_records())
    assert sorted(reference_pages.effect_records()) == effects.names(reference_pages.Record)
    for name, records in reference_pages.solver_records().items():
        assert {offer.settings for offer in solvers.offers(name)} <= set(records)
    assert not re.search(r"annotated|typing|<class", scene + laws + settings, re.IGNORECASE)


def _said(record: type) -> str:
    """What begins the section of a record, apart from its heading."""
    return reference_pages._section("", record).partition("\n")[2].strip()


def test_the_reference_says_what_a_text_may_be() -> None:
    """In the words that refuse an empty one: the name of a muscle, after which a dot begins names of scalars, has none."""
    text = reference_pages.scenes()
    muscle = text.partition("### MuscleOfSeveral")[2].partition("###")[0]
    assert "| `name` | a name of 1 to 100 letters, digits and _ -, without a dot | required |" in muscle
    assert "| `unsolved` | string |" in text
    formulas = re.findall(r"^\| `(exact|slope|value|where)` \| a number, or a formula of x, y, z", text, re.MULTILINE)
    assert len(formulas) == 4


@pytest.mark.slow
@pytest.mark.usefixtures("without_pictures")
def test_every_public_name_verb_and_case_is_in_the_reference() -> None:
    assert re.findall(r"^## (\w+)$", reference_pages.api(), re.MULTILINE) == fr.__all__
    assert re.findall(r"^## (\w+)$", reference_pages.gallery(), re.MULTILINE) == fr.cases()
    (verbs,) = (action for action in parser()._actions if isinstance(action, argparse._SubParsersAction))
    assert re.findall(r"^### (\S+)$", reference_pages.verbs(), re.MULTILINE) == sorted(verbs.choices)
    places = re.findall(r"<!-- generated: (\w+) -->", "".join(pages.page(name) for name in pages.PAGES))
    assert sorted(places) == sorted(reference_pages.GENERATED)


def test_every_page_is_in_a_table_of_contents() -> None:
    listed = set(re.findall(r"^(\w+)$", pages.page("docs/index.md"), re.MULTILINE))
    assert {f"docs/{name}.md" for name in listed} == set(pages.PAGES) - {"README.md", "docs/index.md"}


def commands() -> list[tuple[str, str]]:
    """Every command line of ours in the pages, without its comment."""
    lines = [(name, line) for name, text in pages.snippets("sh") for line in text.splitlines()]
    return [(name, line) for name, line in lines if re.match(r"(\./fem|fem-reference) ", line)]


def test_commands_can_be_given() -> None:
    reader = parser()
    for page, line in commands():
        words = shlex.split(line.split(" > ")[0], comments=True)[1:]
        try:
            if words[0] not in ("test", "docs"):
                reader.parse_args(words)
        except SystemExit:
            pytest.fail(f"{page}: {line}")


def test_python_is_python() -> None:
    found = list(pages.snippets("python"))
    assert len(found) >= 5
    for name, text in found:
        compile(text, name, "exec")


def test_scenes_and_effects_can_be_read() -> None:
    whole = 0
    for name, text in pages.snippets("toml"):
        table = tomllib.loads(text)
        if "reference" in table and "title" in table:
            assert fr.make_case(table, name="my_muscle").numbers, name
            whole += 1
        elif "effect" in table:
            for i, effect in enumerate(table["effect"]):
                record = effects.find(effect.pop("name"))
                assert isinstance(parse(record, effect, f"{name}: effect[{i}]"), record)
    assert whole >= 1
    assert casefile.cases()


@pytest.mark.slow
@pytest.mark.usefixtures("without_pictures")
@pytest.mark.filterwarnings("ignore")  # those of Sphinx's own code; what pages have to be warned of is a mistake by -W
def test_the_pages_are_read_without_a_warning(tmp_path: Path) -> None:
    """Links and anchors lead somewhere, docstrings are valid, and each page is in a table of contents."""
    build = pytest.importorskip("sphinx.cmd.build", reason="Sphinx is not installed (extra docs)")
    assert build.main(["-q", "-W", "--keep-going", "-b", "dummy", str(pages.ROOT / "docs"), str(tmp_path)]) == 0
    drawn = {name for page in pages.PAGES for name in re.findall(r"<!-- drawn: (\w+) -->", pages.page(page))}
    assert drawn == set(drawn_results.DRAWN)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the pages, built once without a warning."""
    if not all(map(importlib.util.find_spec, ("sphinx", "furo"))):
        pytest.skip("Sphinx and furo are not installed (extra docs)")
    folder = tmp_path_factory.mktemp("docs")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", "docs", str(folder)]
    done = subprocess.run(command, cwd=pages.ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.mark.nightly  # by day the pages are read without being written
@pytest.mark.slow
def test_the_pages_load_nothing_from_elsewhere_and_have_their_pictures(built: Path) -> None:
    for path in built.glob("*.html"):
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"(src|<link[^>]*href)=\"(https?:)?//", text), path.name
        for source in re.findall(r'<img[^>]* src="(?!data:)([^"]+)"', text):
            assert (built / source).is_file(), f"{path.name}: {source}"
    assert "compare" in (built / "api.html").read_text(encoding="utf-8")
    front = (built / "index.html").read_text(encoding="utf-8")
    assert front.count("<svg viewBox") == 3
    assert "--c-0072b2: #4aa3f0" in front  # pbd on dark paper, as on the pages of results


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.skipif(PROGRAM is None, reason="chromium is not installed: apt-get install chromium")
def test_no_table_is_cut_without_a_sign_on_a_phone(built: Path, tmp_path: Path) -> None:
    with Browser(tmp_path) as browser:
        for name in ("scene_keys", "fast_solvers", "cost"):
            browser.screen(390, scheme="dark")
            browser.open(built / f"{name}.html")
            browser.wait("document.readyState === 'complete'")
            assert browser.ask("document.documentElement.scrollWidth") <= 390, name
            cut = "[...document.querySelectorAll('.table-wrapper')].filter(it => it.scrollWidth > it.clientWidth + 1)"
            assert browser.ask(
                f"{cut}.every(it => getComputedStyle(it, '::before').content.includes('scroll for more'))"
            )
        assert browser.ask(f"{cut}.length") > 0  # the last page has such a table
