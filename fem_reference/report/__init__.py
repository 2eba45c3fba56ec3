"""Pages that contain everything themselves, and the same numbers as JSON and CSV.

Each is written with the command that it was ``asked`` for by, empty where a program writes it.
"""

import json
from pathlib import Path
from typing import Any

from fem_reference.assessment import cost_study, omissions, stress
from fem_reference.assessment.claims import Claims, Cover
from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.cost_study import Study
from fem_reference.assessment.judge import overall
from fem_reference.assessment.omissions import CaseOmissions
from fem_reference.assessment.solver_table import Table
from fem_reference.assessment.stress import Stress
from fem_reference.assessment.versions import Versions
from fem_reference.io import files
from fem_reference.problems.setup import Setup
from fem_reference.report import (
    against_page,
    claims_page,
    effects_page,
    field_page,
    page,
    pages,
    ranking_page,
    stress_page,
    study_page,
    verify_page,
)
from fem_reference.report.pages import About
from fem_reference.report.tables import as_csv, summary
from fem_reference.report.verify_page import Verification

__all__ = [
    "summary",
    "write",
    "write_claims",
    "write_effects",
    "write_examples",
    "write_ranking",
    "write_stress",
    "write_study",
    "write_verification",
    "write_versions",
]


def write(comparison: Comparison, folder: Path, asked: str = "") -> Path:
    """Write ``measures.json``, ``measures.csv`` and ``report.html`` into ``folder``; the path of the page.

    All three are made before the first is written, and each appears whole or not at all.
    """
    numbers = summary(comparison)
    of_field = "field" in comparison.reference.carries
    title = comparison.scene.title
    said = _examples((comparison,)) if of_field else tuple(page.headlines(comparison))
    text = field_page.render(title, (comparison,), differences=False) if of_field else page.render(comparison)
    texts = {
        "measures.json": json.dumps(numbers, indent=1, allow_nan=False),
        "measures.csv": as_csv(numbers["measures"]),
        "report.html": pages.stamped(text, About("comparison", title, said, asked)),
    }
    _write(texts, folder)
    return folder / "report.html"


def write_examples(title: str, examples: tuple[Comparison, ...], folder: Path, name: str, asked: str = "") -> Path:
    """Write the page ``name`` of scalar cases with the table of where the report's listings and text part; its path."""
    text = field_page.render(title, examples, differences=True)
    _write({f"{name}.html": pages.stamped(text, About("examples", title, _examples(examples), asked))}, folder)
    return folder / f"{name}.html"


def _examples(examples: tuple[Comparison, ...]) -> tuple[tuple[str, str, str], ...]:
    """How scalar cases came out."""
    words = [one.word for one in examples]
    said = field_page.apart(examples[0]) if len(examples) == 1 else f"{words.count('pass')} of {len(words)} pass"
    return (("", overall(words), said),)


def write_verification(verification: Verification, folder: Path, name: str, asked: str = "") -> Path:
    """Write a page ``name`` and its numbers as JSON into ``folder``; the path of the page."""
    passed = len(verification.results) - len(verification.failed)
    said = (("", verification.word, f"{passed} of {len(verification.results)} pass"),)
    about = About("verification", "Verification: problems whose answers are known", said, asked)
    return _write_page(folder, name, verify_page.facts(verification), verify_page.render(verification), about)


def write_ranking(table: Table, folder: Path, name: str, asked: str = "") -> Path:
    """Write the page ``name`` over the kinds of solvers and its numbers as JSON into ``folder``; the path of the page."""
    said = f"{len(table.results)} results on {len(table.scenarios)} scenes"
    about = About("ranking", "Table 5.1 in numbers", (("", "", said),), asked)
    return _write_page(folder, name, ranking_page.facts(table), ranking_page.render(table), about)


def write_claims(claims: Claims, folder: Path, name: str, asked: str = "") -> Path:
    """Write the page ``name`` of error bars beside errors and its numbers as JSON into ``folder``; the path of the page."""
    whole = Cover.of(claims.claims)
    said = f"{100 * whole.share:.0f} % of {whole.count} error bars cover the difference from a finer solution"
    about = About("error bars", "Error bars: claimed against true", (("", "", said),), asked)
    return _write_page(folder, name, claims_page.facts(claims), claims_page.render(claims), about)


def write_study(study: Study, folder: Path, name: str, asked: str = "") -> Path:
    """Write the page ``name`` of what accuracy costs and its numbers as JSON into ``folder``; the path of the page."""
    cases = [cost_study.facts(case, study.origin) for case in study.cases]
    several = len(study.cases) > 1
    said = tuple(
        (case.case if several else "", "", text) for case in study.cases for text in study_page.sentences(case)[-1:]
    )
    about = About("study", study_page.title(study), said, asked)
    return _write_page(folder, name, cases[0] if len(cases) == 1 else cases, study_page.render(study), about)


def write_effects(found: CaseOmissions, folder: Path, name: str, asked: str = "") -> Path:
    """Write the page ``name`` of what each effect changes and its numbers as JSON into ``folder``; the path of the page."""
    said = (("", "", effects_page.sentences(found, found.ablations[0])[0]),)
    about = About("effects", f"What each effect changes: {found.title}", said, asked)
    return _write_page(folder, name, omissions.facts(found), effects_page.render(found), about)


def write_stress(found: Stress, folder: Path, name: str, asked: str = "") -> Path:
    """Write the page ``name`` of hard cases and its numbers as JSON into ``folder``; the path of the page."""
    about = About("hard cases", "Hard cases", (("", "", stress_page.summary(found)),), asked)
    return _write_page(folder, name, stress.facts(found), stress_page.render(found), about)


def write_versions(versions: Versions, setup: Setup, folder: Path, name: str, asked: str = "") -> Path:
    """Write the page ``name`` of two versions of a solver and its numbers as JSON into ``folder``; the path of the page."""
    title = f"{versions.current.candidate.name} against what it was: {versions.current.scene.title}"
    said = (("", against_page.word(versions), against_page.headline(versions)),)
    text = against_page.render(versions, setup)
    return _write_page(folder, name, against_page.facts(versions), text, About("two versions", title, said, asked))


def _write_page(folder: Path, name: str, facts: Any, text: str, about: About) -> Path:
    """Write a page and its ``facts`` as JSON; the path of the page."""
    texts = {f"{name}.json": json.dumps(facts, indent=1, allow_nan=False), f"{name}.html": pages.stamped(text, about)}
    _write(texts, folder)
    return folder / f"{name}.html"


def _write(texts: dict[str, str], folder: Path) -> None:
    """Write each text into ``folder`` under its name."""
    files.make_folder(folder)
    for name, text in texts.items():
        files.write_text(folder / name, text)
