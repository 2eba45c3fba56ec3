"""What was compiled once is found again, also in a process that has made other forms since."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

PROGRAM = """
import sys
from pathlib import Path
from fem_reference.solvers.fenicsx import dolfinx_door
from fem_reference.effects import make
from fem_reference.problems import shapes
from fem_reference.problems.body import Body
from fem_reference.solvers.fenicsx import BodySettings
from fem_reference.solvers.fenicsx.body import AssembledBody

for size in (1.0, 2.0):
    mesh = shapes.box((1, 1, 1), (size, size, size), "tetrahedron")
    AssembledBody(Body(mesh, (make("neo_hooke", mu=size),), (), (0.0, 1.0)), BodySettings(element="P1"))
    print("compiled", len(list(Path(sys.argv[1]).rglob("*.so"))), flush=True)

import numpy
import ufl
from dolfinx import fem
from fem_reference.solvers.fenicsx import compiling

cell, middle = numpy.zeros(1, numpy.int32), numpy.full((1, 3), 0.25)
for a, b, exponent in ((2, 3, 2), (5, 7, 2), (5, 7, 3)):
    for swapped in (False, True):
        domain = AssembledBody(Body(mesh, (make("neo_hooke", mu=1.0),), (), (0.0, 1.0)), BodySettings(element="P1")).mesh
        first, second = (fem.Constant(domain, float(value)) for value in (a, b))
        field = fem.Function(fem.functionspace(domain, ("Lagrange", 1)))
        field.x.array[:] = a + b
        x = ufl.variable(first * field)
        slope = ufl.diff(second * x**exponent if not swapped else x * second**exponent, x)
        value = compiling.expression(slope, middle).eval(domain, cell)[0, 0]
        print("value", value / (b**exponent if swapped else b * exponent * (a * (a + b)) ** (exponent - 1)), flush=True)
"""


ONE = """
import sys
import numpy
from fem_reference.solvers.fenicsx import dolfinx_door
from fem_reference.solvers.fenicsx import compiling
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

box = mesh.create_unit_interval(MPI.COMM_SELF, 2)
x = ufl.SpatialCoordinate(box)
sys.stdin.readline()
for power in range(int(sys.argv[1])):
    compiling.form(x[0] ** (power + 2) * ufl.dx)
    compiling.expression(x[0] ** (power + 2), numpy.array([[0.5]]))
print("done", flush=True)
"""


def started(program: str, folder: Path, *words: str) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-c", program, *words],
        env=os.environ | {"XDG_CACHE_HOME": str(folder)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.usefixtures("fem_lab")
def test_many_processes_compile_the_same_at_once(tmp_path: Path) -> None:
    several = [started(ONE, tmp_path, "2") for _ in range(3)]
    for one in several:
        one.stdin.write("go\n")
        one.stdin.flush()
    for one in several:
        out, errors = one.communicate(timeout=300)
        assert (out, one.returncode) == ("done\n", 0), errors[-2000:]
    # Each once: a form and an expression for each of the two powers.
    assert len(list(tmp_path.rglob("*.so"))) == len(list(tmp_path.rglob("*.c.cached"))) == 4
    assert not list(tmp_path.rglob("*.c.failed"))


@pytest.mark.usefixtures("fem_lab")
def test_what_says_that_it_is_compiled_and_is_not_stops_nobody(tmp_path: Path) -> None:
    for missing in ((), (".c", ".*.so", ".c.cached")):  # of one form or expression each
        for name, ending in zip(sorted(path.stem for path in tmp_path.rglob("*.c")), missing, strict=False):
            (path,) = tmp_path.rglob(f"{name}{ending}")
            path.unlink()
        out, errors = started(ONE, tmp_path, "2").communicate("go\n", timeout=300)
        assert out == "done\n", errors[-2000:]
    assert len(list(tmp_path.rglob("*.so"))) == len(list(tmp_path.rglob("*.c.cached"))) == 4


@pytest.mark.usefixtures("fem_lab")
def test_a_second_body_of_the_same_effects_compiles_nothing(tmp_path: Path) -> None:
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path)}
    command = [sys.executable, "-c", PROGRAM, str(tmp_path)]
    found = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=300)
    first, second = (int(line.split()[1]) for line in found.stdout.splitlines() if line.startswith("compiled"))
    assert second == first > 2
    # Of each formula the present constants and functions are read, those of other bodies and formulas never.
    values = [float(line.split()[1]) for line in found.stdout.splitlines() if line.startswith("value")]
    assert values == pytest.approx([1.0] * 6, rel=1e-14)
