"""A page of every kind, small: written from the same stand-ins as the tests of each kind."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from fem_reference import report
from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.cost_study import Study
from fem_reference.assessment.stress import Bound, Cell, HardCase, History, Scene, Stress
from fem_reference.report import index_page
from tests.assessment import test_versions
from tests.report import test_field_page, test_study_page, test_verify_page
from tests.studies import test_omissions as test_effects_verb
from tests.studies import test_table_5_1
from tests.studies import test_true_errors as test_claims

KINDS = (
    "comparison",
    "reference",
    "field",
    "examples",
    "verify",
    "study",
    "ranking",
    "claims",
    "effects",
    "stress",
    "versions",
    "index",
)


def write(folder: Path, comparison: Comparison, alone: Comparison) -> dict[str, Path]:
    """Every kind of page in ``folder``, by kind."""
    folder.mkdir(exist_ok=True)
    examples = (test_field_page.rod(folder / "rod"), test_field_page.plate(folder / "plate", lambda base: 3 * base))
    left_out = test_study_page.points("arap", 0.5, 9.0)
    cases = tuple(test_study_page.study(case, *left_out) for case in ("hip", "knee", "jaw"))
    results = [
        test_table_5_1.solver_result(case, *values) for case, values in (("case0", (1.0, 4.0)), ("case1", (2.0, 3.0)))
    ]
    entries = [
        test_verify_page.made(name, 2.0 + i / 50, order=2.0, ladder=test_verify_page.LADDER)
        for i, name in enumerate(("bar", "rod", "a_name_that_is_long_enough_to_wrap"))
    ]
    written = {
        "comparison": report.write(comparison, folder / "press", "fem-reference compare press"),
        "reference": report.write(alone, folder / "press-reference", "fem-reference run press"),
        "field": report.write(
            replace(examples[0], changes=examples[0].changes | {"listing": ()}),
            folder / "rod-page",
            "fem-reference run rod",
        ),
        "examples": report.write_examples(
            "Octave examples", examples, folder, "octave-examples", "fem-reference page octave-examples"
        ),
        "verify": report.write_verification(
            test_verify_page.verification(*entries), folder, "verify", "fem-reference verify"
        ),
        "study": report.write_study(
            Study(cases, {"lost": "why"}, {"machine": "this one"}),
            folder,
            "study",
            "fem-reference study hip knee jaw",
        ),
        "ranking": report.write_ranking(
            test_table_5_1.table(*results), folder, "table-5-1", "fem-reference page table-5-1"
        ),
        "claims": report.write_claims(
            test_claims.whole("one", "other"), folder, "error-bars", "fem-reference page error-bars"
        ),
        "effects": report.write_effects(test_effects_verb.found(), folder, "effects", "fem-reference effects hip"),
        "stress": report.write_stress(stress(comparison), folder, "stress", "fem-reference stress"),
    }
    pair = test_versions.pair(comparison)
    written["versions"] = report.write_versions(
        pair, comparison.setup, folder / "quick-against_old", "against", "fem-reference compare"
    )
    index_page.write(folder)
    return written | {"index": folder / "index.html"}


def stress(comparison: Comparison) -> Stress:
    """Two hard cases by three solvers, with a picture and a curve."""
    surface, numbers = comparison.reference.surface, comparison.reference.numbers
    history = History("kinetic_energy", "mJ", numbers, np.array([0, 1.0, 4.0, 90.0, np.nan]))
    shown = {"history": history, "scene": Scene(surface.points, surface.triangles, surface.points[0]), "bound": 1.0}
    verdicts = ("ok", "degraded", "failed", "refused", "inconclusive", "failed")
    places = [(case, solver) for case in ("at_rest", "squeeze") for solver in ("fenicsx", "pbd", "mass_spring")]
    cells = tuple(
        Cell(*place, verdict, f"It is {verdict}.", "converged", seconds=1.0, **shown)
        for place, verdict in zip(places, verdicts, strict=True)
    )
    cases = tuple(
        HardCase(name, f"The {name}", "it stays", (Bound(quantity="energy", at_most=1.0),))
        for name in ("at_rest", "squeeze")
    )
    return Stress(cases, ("fenicsx", "pbd", "mass_spring"), cells, 6.0, {"machine": "this one"})
