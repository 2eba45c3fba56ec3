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
"""


@pytest.mark.usefixtures("fem_lab")
def test_a_second_body_of_the_same_effects_compiles_nothing(tmp_path: Path) -> None:
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path)}
    command = [sys.executable, "-c", PROGRAM, str(tmp_path)]
    found = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=300)
    first, second = (int(line.split()[1]) for line in found.stdout.splitlines() if line.startswith("compiled"))
    assert second == first > 2
