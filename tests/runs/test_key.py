"""Keys of runs: of the scene, the solver, its settings and the source files that it reaches."""

import ast
import shutil

import numpy as np
import pytest

from fem_reference.foundations import version
from fem_reference.runs import key


@pytest.mark.slow
def test_the_key_changes_with_every_file_that_the_solver_reaches(tmp_path) -> None:
    copy = tmp_path / "fem_reference"
    shutil.copytree(key.PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    (copy / "solvers" / "far.py").write_text("VALUE = 1\n")
    text = (copy / "solvers" / "pbd.py").read_text()
    several_lines = "import numpy as np\nfrom fem_reference.solvers import (\n    far,\n)\n"
    (copy / "solvers" / "pbd.py").write_text(text.replace("import numpy as np\n", several_lines, 1))

    def hashed(solver: str) -> str:
        return key.code_hash.__wrapped__(solver, copy)

    before = {solver: hashed(solver) for solver in ("pbd", "fenicsx")}
    reached = {
        "pbd": {"solvers/pbd.py", "solvers/pbd_kernels.py", "solvers/far.py", "solvers/collision_kernels.py"},
        "fenicsx": {"solvers/fenicsx/worker.py", "solvers/fenicsx/cells.c", "solvers/common/load_steps.py"},
    }
    both = {
        "problems/muscle.py",
        "solvers/common/state_checks.py",
        "effects/neo_hooke.py",
        "runs/store.py",
        "solvers/__init__.py",
        "geometry/skins.py",
    }
    neither = {"metrics/volume.py", "cli/run.py", "assessment/judge.py", "solvers/listing.py"}
    for name in sorted(set.union(both, neither, *reached.values())):
        text = (copy / name).read_bytes()
        (copy / name).write_bytes(text + b"\n")
        for solver, own in reached.items():
            assert (hashed(solver) != before[solver]) == (name in own | both), (solver, name)
        (copy / name).write_bytes(text)


def test_no_import_is_overlooked() -> None:
    """Of any file of the package, beside all that its whole syntax tree has, wherever it stands in the file."""
    for path in key.PACKAGE.rglob("*.py"):
        nodes = [node for node in ast.walk(ast.parse(path.read_bytes())) if isinstance(node, ast.ImportFrom)]
        own = [node for node in nodes if node.level == 0 and f"{node.module}.".startswith("fem_reference.")]
        names = {f"{node.module}.{alias.name}".removeprefix("fem_reference.") for node in own for alias in node.names}
        assert names <= set(key.imported(path, key.PACKAGE)), path


@pytest.mark.slow
def test_a_key_differs_with_each_of_its_parts() -> None:
    """Of all that determines a run: its scene, its solver and the settings, in whatever order they stand."""
    settings = {"damping": 0.05, "stretch": 1.0}
    first = key.key("scene", "pbd", settings)
    assert len(first) == 16
    assert key.key("scene", "pbd", dict(reversed(settings.items()))) == first
    others = [("other", "pbd", settings), ("scene", "xpbd", settings), ("scene", "pbd", settings | {"stretch": 0.5})]
    assert len({first, *(key.key(*parts) for parts in others)}) == 4


def test_provenance_names_the_machine_how_it_was_used_and_the_packages() -> None:
    found = key.made_with("one run at a time")
    assert found["machine"] == f"{key.machine()}, one run at a time"
    assert found["fem_reference"] == version.__version__
    assert found["numpy"] == np.__version__
    assert key.made_with()["machine"] == key.machine()
