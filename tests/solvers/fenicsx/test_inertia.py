"""Inertia: the rule of its steps, contact with it, and that a scene without an effect is as if there were none."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import small
from acting import make
from slides import Slide

from fem_reference.effects import Effect
from fem_reference.effects import make as made
from fem_reference.geometry.rigid_bodies import HalfSpace
from fem_reference.problems import shapes
from fem_reference.problems.body import Body
from fem_reference.problems.contact import ContactBone, ContactLaw
from fem_reference.runs.key import PACKAGE
from fem_reference.solvers.fenicsx import BodySettings
from tests.solvers.fenicsx.test_stability import flesh

# The rule


@pytest.mark.parametrize("radius", [0.0, 0.5, 0.9, 1.0])
def test_short_waves_keep_what_the_spectral_radius_says(radius: float) -> None:
    """By hand: x'' = -w^2 x in steps far longer than its period; the balance of a step is that of its potential."""
    effect, seconds, square = make("inertia", spectral_radius=radius), 1.0, 1e12
    u, v, a = 1.0, 0.0, -square
    sizes = []
    for _ in range(400):
        predicted, weight = effect.predicted(u, v, a, seconds), 2 * (1 + radius) / seconds**2
        now = weight * predicted / (weight + square)
        v, a = effect.advanced(u, v, a, now, seconds)
        u = now
        sizes.append(np.hypot(np.hypot(u * square, v * 1e6), a))
    if radius == 0:
        assert sizes[-1] == pytest.approx(0, abs=1e-2 * sizes[0])
    else:  # a double root: times a factor that grows no faster than the number of steps
        assert (sizes[-1] / sizes[199]) ** (1 / 200) == pytest.approx(radius, abs=0.01)


@pytest.mark.parametrize("radius", [0.3, 1.0])
def test_constant_acceleration_is_exact(radius: float) -> None:
    effect = make("inertia", spectral_radius=radius)
    u, v, a = 2.0, -3.0, 5.0
    for i, seconds in enumerate((0.1, 0.3, 0.2)):
        now = u + seconds * v + seconds**2 / 2 * a
        v, a = effect.advanced(u, v, a, now, seconds)
        assert (a, v) == (pytest.approx(5.0), pytest.approx(-3.0 + 5.0 * (0.1, 0.4, 0.6)[i]))
        u = now
    # The slope of the potential of a step is the mass times the acceleration that its balance is about.
    weight = 2 * (1 + radius) / 0.2**2
    alpha = (radius - 1) / (radius + 1)
    assert weight * (u + 1e-3 - effect.predicted(u, v, a, 0.2)) == pytest.approx(
        (1 - alpha) * effect.advanced(u, v, a, u + 1e-3, 0.2)[1] + alpha * a
    )


# ContactLaw


def dropped(acting: tuple[Effect, ...]) -> Body:
    """A cube of 10 mm that falls 2 mm onto a fixed plane, and bounces."""
    mesh = shapes.box((2, 2, 2), (10.0, 10.0, 10.0), "tetrahedron")
    plane = ContactBone("plane", HalfSpace((0.0, 0.0, -2.0), (0.0, 0.0, 1.0)), Slide((0.0, 0.0, 0.0)))
    weight = made("gravity", density=1e-9, acceleration="0, 0, -9810 mm/s^2", ramp=[{"frame": 0.0, "amount": 1.0}])
    frames = tuple(float(i) for i in range(151))
    contact = ContactLaw("z0", 0.01, 0.2)
    return Body(mesh, (*flesh("P2/P1"), weight, *acting), (), frames, contact=contact, bones=(plane,), interval=4e-4)


@pytest.mark.slow
def test_a_bounce_makes_no_energy(session) -> None:
    settings = BodySettings(first_step=1.0, largest_step=1.0)
    found = session.solve(dropped((made("inertia", density=1e-9),)), settings)
    states = found.states
    assert found.outcome.status == "converged", found.outcome.message
    assert len(states) == 151
    total = np.array([state.scalars["energy"] + state.scalars["kinetic_energy"] for state in states])
    kinetic = np.array([state.scalars["kinetic_energy"] for state in states])
    lowest = np.array([state.points[:, 2].min() for state in states])
    assert lowest.min() < -1.9  # it arrived,
    assert lowest[int(lowest.argmin()) :].max() > -1.5  # and left again
    # Energy that contact stores is not in the total, which may only be less; steps in time of second order err by less.
    assert total.max() < 0.01 * kinetic.max()


# Without it


PROGRAM = """
import hashlib, json, sys
from pathlib import Path
import fem_reference as fr
from fem_reference.runs.store import Run
case = fr.load_case(sys.argv[1])
run = fr.solve(case, store=Path(sys.argv[2]))
print("FOUND", json.dumps({
    "package": fr.__file__,
    "positions": hashlib.sha256(run.positions.tobytes()).hexdigest(),
    "counts": [run.outcome.cost[name] for name in ("unknowns", "newton_iterations", "factorisations")],
}))
"""


def solved(package: Path, case: Path, folder: Path) -> dict:
    environment = os.environ | {"PYTHONPATH": str(package.parent)}
    command = [sys.executable, "-P", "-c", PROGRAM, str(case), str(folder)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=300)
    (line,) = (line for line in done.stdout.splitlines() if line.startswith("FOUND"))
    found = json.loads(line.removeprefix("FOUND"))
    assert found.pop("package") == str(package / "__init__.py")
    return found


@pytest.mark.slow
@pytest.mark.usefixtures("fem_lab")
def test_a_scene_is_as_if_effects_that_it_does_not_name_did_not_exist(tmp_path: Path) -> None:
    case = small.write(tmp_path / "bar")
    scene = (case / "case.toml").read_text()
    (case / "case.toml").write_text(scene.replace("last = 20", "last = 5"))
    copy = tmp_path / "copy" / PACKAGE.name
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("*.pyc.*"))  # bytecode being written
    for folder in ("cases", "meshes", "validation"):
        (copy.parent / folder).symlink_to(PACKAGE.parent / folder)
    sources = "".join(path.read_text() for path in copy.rglob("*.py"))
    named = ("neo_hooke", "incompressible")
    for path in (copy / "effects").glob("*.py"):
        imported = f"effects.{path.stem} import" in sources  # what export translates, and what problems are made of
        if not imported and path.stem not in ("__init__", *named) and "(FieldEffect)" not in path.read_text():
            path.unlink()
    assert not (copy / "effects" / "inertia.py").exists()
    assert solved(copy, case, tmp_path / "a") == solved(PACKAGE, case, tmp_path / "b")
