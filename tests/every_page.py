"""A page of every kind, small: written from the same stand-ins as the tests of each kind."""

from pathlib import Path

import numpy as np

from fem_reference import report
from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.cost_study import Study
from fem_reference.assessment.stress import Bound, Cell, HardCase, History, Scene, Stress
from fem_reference.report import (
    against_page,
    asked,
    claims_page,
    credibility_page,
    effects_page,
    estimation_page,
    field_page,
    ranking_page,
    standings_page,
    stress_page,
    study_page,
    uncertainty_page,
    verify_page,
)
from tests.assessment import test_credibility, test_estimation, test_uncertainty, test_versions
from tests.report import entries as made_entries
from tests.report import examples as scalar_examples
from tests.report import test_standings_page, test_study_page
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
    "estimation",
    "credibility",
    "uncertainty",
    "standings",
    "versions",
    "index",
)


def write(folder: Path, comparison: Comparison, alone: Comparison) -> dict[str, Path]:
    """Every kind of page in ``folder``, by kind."""
    folder.mkdir(exist_ok=True)
    examples = (scalar_examples.rod(folder / "rod"), scalar_examples.plate(folder / "plate", lambda base: 3 * base))
    left_out = test_study_page.points("arap", 0.5, 9.0)
    cases = tuple(test_study_page.study(case, *left_out) for case in ("hip", "knee", "jaw"))
    results = [
        test_table_5_1.solver_result(case, *values) for case, values in (("case0", (1.0, 4.0)), ("case1", (2.0, 3.0)))
    ]
    entries = [
        made_entries.made(name, 2.0 + i / 50, order=2.0, ladder=made_entries.LADDER)
        for i, name in enumerate(("bar", "rod", "a_name_that_is_long_enough_to_wrap"))
    ]
    comparisons = {"press": comparison, "press-reference": alone, "rod-page": examples[0]}
    verified, known = made_entries.verification(*entries), test_claims.whole("one", "other")
    pages = {
        "octave-examples": ("page", field_page.page("Octave examples", examples)),
        "verify": ("verify", verify_page.page(verified)),
        "study": ("study", study_page.page(Study(cases, {"lost": "why"}, {"machine": "this one"}))),
        "table-5-1": ("page", ranking_page.page(test_table_5_1.table(*results))),
        "error-bars": ("page", claims_page.page(known)),
        "effects": ("effects", effects_page.page(test_effects_verb.found())),
        "stress": ("stress", stress_page.page(stress(comparison))),
        "estimation": ("page", estimation_page.page(test_estimation.found())),
        "credibility": ("page", credibility_page.page(test_credibility.found())),
        "uncertainty": ("uncertainty", uncertainty_page.page(test_uncertainty.study(test_uncertainty.band()))),
        "standings": ("standings", standings_page.page(test_standings_page.found())),
    }
    paths = [
        report.write(report.of_comparison(one), folder / name, report.NAME, f"fem-reference compare {name}")
        for name, one in comparisons.items()
    ]
    paths += [report.write(page, folder, name, f"fem-reference {verb}") for name, (verb, page) in pages.items()]
    against = against_page.page(test_versions.pair(comparison), comparison.setup)
    paths.append(report.write(against, folder / "quick-against_old", "against", "fem-reference compare"))
    asked.write_index(folder)
    return dict(zip(KINDS, [*paths, folder / "index.html"], strict=True))


def stress(comparison: Comparison) -> Stress:
    """Two hard cases by three solvers, with a picture and a curve."""
    surface, numbers = comparison.reference.surface, comparison.reference.numbers
    history = History("kinetic_energy", "mJ", numbers, np.array([0, 1.0, 4.0, 90.0, np.nan]))
    shown = {"history": history, "scene": Scene(surface.points, surface.triangles, surface.points[0]), "bound": 1.0}
    verdicts = ("ok", "degraded", "failed", "not applicable", "no solution", "inconclusive")
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
