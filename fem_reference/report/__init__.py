"""Pages that contain everything themselves, and the same numbers as JSON and CSV."""

import json
from pathlib import Path

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
    texts = {
        f"{name}.json": json.dumps(verify_page.facts(verification), indent=1, allow_nan=False),
        f"{name}.html": verify_page.render(verification),
    }
    _write(texts, folder)
    return folder / f"{name}.html"


def write_ranking(table: Table, folder: Path, name: str) -> Path:
    """Write the page ``name`` over the kinds of solvers and its numbers as JSON into ``folder``; the path of the page."""
    texts = {
        f"{name}.json": json.dumps(ranking_page.facts(table), indent=1, allow_nan=False),
        f"{name}.html": ranking_page.render(table),
    }
    _write(texts, folder)
    return folder / f"{name}.html"


def write_claims(claims: Claims, folder: Path, name: str) -> Path:
    """Write the page ``name`` of error bars beside errors and its numbers as JSON into ``folder``; the path of the page."""
    texts = {
        f"{name}.json": json.dumps(claims_page.facts(claims), indent=1, allow_nan=False),
        f"{name}.html": claims_page.render(claims),
    }
    _write(texts, folder)
    return folder / f"{name}.html"


def write_study(study: Study, folder: Path, name: str) -> Path:
    """Write the page ``name`` of what accuracy costs and its numbers as JSON into ``folder``; the path of the page."""
    cases = [cost_study.facts(case, study.origin) for case in study.cases]
    texts = {
        f"{name}.json": json.dumps(cases[0] if len(cases) == 1 else cases, indent=1, allow_nan=False),
        f"{name}.html": study_page.render(study),
    }
    _write(texts, folder)
    return folder / f"{name}.html"


def write_effects(found: CaseOmissions, folder: Path, name: str) -> Path:
    """Write the page ``name`` of what each effect changes and its numbers as JSON into ``folder``; the path of the page."""
    texts = {
        f"{name}.json": json.dumps(omissions.facts(found), indent=1, allow_nan=False),
        f"{name}.html": effects_page.render(found),
    }
    _write(texts, folder)
    return folder / f"{name}.html"


def write_stress(found: Stress, folder: Path, name: str) -> Path:
    """Write the page ``name`` of hard cases and its numbers as JSON into ``folder``; the path of the page."""
    texts = {
        f"{name}.json": json.dumps(stress.facts(found), indent=1, allow_nan=False),
        f"{name}.html": stress_page.render(found),
    }
    _write(texts, folder)
    return folder / f"{name}.html"


def _write(texts: dict[str, str], folder: Path) -> None:
    """Write each text into ``folder`` under its name."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        files.write_text(folder / name, text)
