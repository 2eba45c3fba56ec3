"""Pages that contain everything themselves, and the same numbers as JSON and CSV."""

import json
from pathlib import Path
from typing import Any

from fem_reference.assessment import cost_study, omissions, stress
from fem_reference.assessment.claims import Claims
from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.cost_study import Study
from fem_reference.assessment.omissions import CaseOmissions
from fem_reference.assessment.solver_table import Table
from fem_reference.assessment.stress import Stress
from fem_reference.io import files
from fem_reference.report import (
    claims_page,
    effects_page,
    field_page,
    page,
    ranking_page,
    stress_page,
    study_page,
    verify_page,
)
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
]


def write(comparison: Comparison, folder: Path) -> Path:
    """Write ``measures.json``, ``measures.csv`` and ``report.html`` into ``folder``; the path of the page.

    All three are made before the first is written, and each appears whole or not at all.
    """
    numbers = summary(comparison)
    texts = {
        "measures.json": json.dumps(numbers, indent=1, allow_nan=False),
        "measures.csv": as_csv(numbers["measures"]),
        "report.html": _page(comparison),
    }
    _write(texts, folder)
    return folder / "report.html"


def _page(comparison: Comparison) -> str:
    """The page of a comparison: of fields on meshes, or of bodies that move."""
    if "field" in comparison.reference.carries:
        return field_page.render(comparison.scene.title, (comparison,), differences=False)
    return page.render(comparison)


def write_examples(title: str, examples: tuple[Comparison, ...], path: Path, *, differences: bool) -> None:
    """Write the page of scalar cases; with ``differences`` the table of where the report's listings and text part."""
    text = field_page.render(title, examples, differences)
    path.parent.mkdir(parents=True, exist_ok=True)
    files.write_text(path, text)


def write_verification(verification: Verification, folder: Path, name: str) -> Path:
    """Write a page ``name`` and its numbers as JSON into ``folder``; the path of the page."""
    return _write_page(folder, name, verify_page.facts(verification), verify_page.render(verification))


def write_ranking(table: Table, folder: Path, name: str) -> Path:
    """Write the page ``name`` over the kinds of solvers and its numbers as JSON into ``folder``; the path of the page."""
    return _write_page(folder, name, ranking_page.facts(table), ranking_page.render(table))


def write_claims(claims: Claims, folder: Path, name: str) -> Path:
    """Write the page ``name`` of error bars beside errors and its numbers as JSON into ``folder``; the path of the page."""
    return _write_page(folder, name, claims_page.facts(claims), claims_page.render(claims))


def write_study(study: Study, folder: Path, name: str) -> Path:
    """Write the page ``name`` of what accuracy costs and its numbers as JSON into ``folder``; the path of the page."""
    cases = [cost_study.facts(case, study.origin) for case in study.cases]
    return _write_page(folder, name, cases[0] if len(cases) == 1 else cases, study_page.render(study))


def write_effects(found: CaseOmissions, folder: Path, name: str) -> Path:
    """Write the page ``name`` of what each effect changes and its numbers as JSON into ``folder``; the path of the page."""
    return _write_page(folder, name, omissions.facts(found), effects_page.render(found))


def write_stress(found: Stress, folder: Path, name: str) -> Path:
    """Write the page ``name`` of hard cases and its numbers as JSON into ``folder``; the path of the page."""
    return _write_page(folder, name, stress.facts(found), stress_page.render(found))


def _write_page(folder: Path, name: str, facts: Any, text: str) -> Path:
    """Write a page and its ``facts`` as JSON; the path of the page."""
    _write({f"{name}.json": json.dumps(facts, indent=1, allow_nan=False), f"{name}.html": text}, folder)
    return folder / f"{name}.html"


def _write(texts: dict[str, str], folder: Path) -> None:
    """Write each text into ``folder`` under its name."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        files.write_text(folder / name, text)
