"""Two bars beside each other as muscles of one case, and a stand-in for the solver that moves their points."""

from pathlib import Path

import numpy as np
import pytest
import small
import stand_ins

from fem_reference.assessment import neighbours
from fem_reference.io import files
from fem_reference.runs.contents import vector_scalars
from fem_reference.runs.store import Frame, Outcome
from fem_reference.solvers import fenicsx

OWN = """
[[muscle]]
name = "{0}"
surface = "{0}.vtp"
unit = "mm"
tet_size = "{1} mm"
fibres.traced = {{ count = 4, start = "origin", end = "insertion" }}
[[muscle.attachment]]
name = "origin"
bone = "floor"
within = "1.5 mm"
[[muscle.attachment]]
name = "insertion"
bone = "lid"
within = "1.5 mm"
"""
TOUCHING = '\n[[effect]]\nname = "touching"\nstiffness = "100 kPa/mm"\nsmoothing = "0.2 mm"\n'
SIZES, AREAS = {"wide": 6.0, "thin": 5.0}, {"wide": 100.0, "thin": 36.0}  # [mm, mm2]
GIVES = 1e-5


def growth(own: float, other: float) -> float:
    """What so many tetrahedra of a muscle and of its neighbour add to the growth of a frame number."""
    return 6e-7 * (own + 0.3 * other)


def known(problem, number: float) -> dict[str, float]:
    """Scalars by the names that the reference gives them: each muscle pulls the floor by 1 N per frame number, and by more the more
    tetrahedra it has; it presses any that it may touch by 0.1 N, and by more with stiffer contact.
    """
    pressed, found = (0.1 + GIVES * problem.law.stiffness) * number, dict[str, float]()
    counts = {name: len(one.mesh.tets) for name, one in problem.problems.items()}
    on = {(name, "floor"): (1 + growth(count, 0)) * number for name, count in counts.items()}
    on |= dict.fromkeys(problem.pairs, pressed) | {pair[::-1]: -pressed for pair in problem.pairs}
    for (name, other), force in on.items():
        for kind, size in (("force", force), ("moment", 10 * force)):
            found |= vector_scalars(f"{name}.{kind}_on_{other}", np.array([size, 0.0, 0.0]))
    found |= {f"{name}.volume_ratio": 1 - 1e-9 * count * number for name, count in counts.items()}
    return found | ({"touching_area": 2.0 * number, "touching_pressure": 0.01 * number} if problem.pairs else {})


def swell(problem, _settings, sink) -> Outcome:
    """In place of the reference: the points of each muscle move away from the origin."""
    counts = [len(one.mesh.tets) for one in problem.problems.values()]
    give = GIVES * 0.1 / problem.law.stiffness
    grows = [growth(*counts) + give, growth(*counts[::-1]) + give]
    for number in problem.frames:
        scalars = known(problem, number)
        surface, fibres = problem.rest.surface.points.copy(), problem.rest.fibres.points.copy()
        for span, more in zip(problem.spans, grows, strict=True):
            surface[span.vertices] *= 1 + number * more
            fibres[span.fibres] *= 1 + number * more
        sink(Frame(number, surface, fibres, scalars=scalars))
    return Outcome("converged", "done", {"seconds": 1.0})


def write(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Write the small scene with a thin bar beside the other one into a ``folder``, and let ``swell`` solve it."""
    stand_ins.solve_by(monkeypatch, fenicsx, swell)
    stand_ins.unchecked(monkeypatch)
    monkeypatch.setattr(neighbours, "between", lambda *_: ())
    small.write(folder)
    wide = small.body()
    files.write_surface(folder / "wide.vtp", wide, wide.points)
    files.write_surface(folder / "thin.vtp", wide, wide.points * [0.6, 0.6, 1.0] + [12.5, 0.0, 0.0])
    text = (folder / "case.toml").read_text()
    first, last = text.index("[muscle]"), text.index("[[bone]]")
    text = text[:first] + "".join(OWN.format(name, size) for name, size in SIZES.items()) + text[last:]
    for begin, end in (
        ("[[attachment]]", "[[effect]]"),
        ("[fibres]", "[frames]"),
        ("[[expect]]", "[negative_control]"),
    ):
        text = text[: text.index(begin)] + text[text.index(end) :]
    (folder / "case.toml").write_text(text.replace("[frames]", TOUCHING + "\n[frames]"))
    return folder
