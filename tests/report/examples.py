"""Small scalar examples that tests of pages share, made by hand so that they stand alone."""

import fields
import numpy as np

from fem_reference.assessment.comparison import Comparison, Convergence
from fem_reference.assessment.judge import Verdict
from fem_reference.metrics import FieldContext, Measure
from fem_reference.problems import scalar as field_problem
from fem_reference.runs.store import Outcome, Run

NAN = float("nan")
DIFFUSION = {"name": "diffusion", "coefficient": 1.0}
SOURCE = {"name": "source", "strength": "-1", "where": "everywhere"}
LADDERS = (
    Convergence("P1", (8, 16, 32), (0.25, 0.0625, 0.015625), 2.25, "distance to <exact>"),
    Convergence("P2", (8, 16, 32), (0.125, NAN, 0.0), NAN, "rms at the coarsest vertices"),
)


def example_of(folder, values=None, **tables) -> Comparison:
    """The scene in ``folder`` with a reference of zeros at the vertices and the ``listing`` of ``values``, else also zeros."""
    folder.mkdir()
    tables = {"effect": [DIFFUSION, SOURCE], "boundary": ()} | tables
    if callable(tables["domain"]):
        tables["domain"] = tables["domain"](folder)
    scene = fields.scene(folder, **tables)
    problem = field_problem.build(scene)
    base = np.linspace(0.0, -2.0, len(problem.fixed))
    values = base if values is None else values(base)
    done = Outcome("converged", "done", {"seconds_assembly": 0.25, "seconds_solve": 0.5})
    reference = run_of("reference", "fenicsx", problem, base, done)
    listing = run_of(
        "listing", "listing", problem, values, Outcome("converged", "computed"), form="as in the report's listing"
    )
    return Comparison(
        scene,
        problem,
        reference,
        (listing,),
        FieldContext(problem.exact),
        {"listing": (Measure("nodal_error", "max", "1", np.array([0.03125])),)},
        {"reference": (Measure("minimum", "value", "1", np.array([NAN])),), "listing": ()},
        None,
        (Verdict("pass", scene.expect[0], 0.375, 0.0, 0.5, "1", 0),),
        ladders=LADDERS,
    )


def run_of(name, solver, problem, values, outcome, **origin) -> Run:
    """A run of one frame with ``values`` at the nodes."""
    shown = {"has_surface": False, "mesh": problem.mesh, "fields": {"psi": values[None]}}
    return Run(name, solver, outcome, (0,), origin=origin, **shown)


def rod(folder, values=None, **tables) -> Comparison:
    fixed = {"boundary": [{"on": "left", "value": "0"}], "exact": "x**2/2 - 2*x"}
    interval = {"interval": {"start": 0.0, "end": 1.0, "count": 20, "seed": 1}}
    return example_of(folder, values, **({"domain": interval} | fixed | tables))


def plate(folder, values=None, **tables) -> Comparison:
    square = {"domain": lambda path: fields.square(path, 5), "boundary": [{"on": "rim", "value": "0"}]}
    return example_of(folder, values, **(square | tables))


def ball(folder, values=None) -> Comparison:
    (folder.parent / "bounds.csv").write_text("1,2\n0,0\n")
    bounds = [{"bounds": str(folder.parent / "bounds.csv")}]
    return example_of(folder, values, domain=lambda path: fields.sphere(path, 1), boundary=bounds)


def nowhere(example: Comparison):
    return {"psi": example.reference.values * NAN}
