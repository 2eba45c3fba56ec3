"""The design as tests: one ordered list of imports, one door per heavy package, sizes of files and functions."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "fem_reference"

# A module imports only what stands before it (or in the same entry).
ORDER = [
    "errors",
    "units",
    "mesh",
    "motion",
    "records",
    "formula",
    "jets",
    "limits",
    "effects",
    "children",
    "formats",
    "files",
    "states",
    "runs",
    "bones",
    "scene",
    "field",
    "casefile",
    "geometry",
    "contact",
    "continuum",
    "results",
    "scene_fibres",
    "problem",
    "exchange",
    "deformable",
    "stepping",
    "soundness",
    "solvers",
    "metrics",
    "study",
    "judge",
    "ranking",
    "claims",
    "comparison",
    "regression",
    "standings",
    "catalogue",
    "report",
    "execution",
    "refinement",
    "true_errors",
    "families",
    "field_execution",
    "overview",
    "field_verbs",
    "truths",
    "verification",
    "benchmark",
    "cli",
    "__main__",
]
# These see runs and never who made them.
BLIND_TO_SOLVERS = ["metrics", "study", "judge", "ranking", "claims", "comparison", "regression", "standings", "report"]
DOORS = {
    "dolfinx": ["solvers/fenicsx/"],
    "dolfinx_solver": ["solvers/fenicsx/"],
    "ufl": ["solvers/fenicsx/"],
    "basix": ["solvers/fenicsx/"],
    "petsc4py": ["solvers/fenicsx/"],
    "mpi4py": ["solvers/fenicsx/"],
    "gmsh": ["geometry/tetrahedra.py"],
    "pytetwild": ["geometry/tetrahedra.py"],
    "igl": ["geometry/"],
    "skfem": ["geometry/fibres.py", "solvers/scikit_fem/"],
    "numba": [
        f"solvers/{name}_kernels.py" for name in ("compiled", "pbd", "program", "collision", "xpbd", "arap", "spring")
    ],
    "pyvista": ["report/pictures.py"],
    "vtk": ["files.py", "report/pictures.py"],
    "vtkmodules": ["files.py", "report/pictures.py"],
    "meshio": ["files.py"],
    "matplotlib": ["report/"],
    "jinja2": ["report/"],
    "pint": ["units.py"],
}


def sources() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def imports(path: Path) -> set[str]:
    """Every module that a file imports, anywhere in it."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= (
                {node.module}
                if node.module != "fem_reference"
                else {f"fem_reference.{alias.name}" for alias in node.names}
            )
    return found


def entry(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def own(path: Path) -> set[str]:
    names = {name.split(".")[1] for name in imports(path) if name.startswith("fem_reference.")}
    return names - {"__version__"}


def test_the_list_names_every_module() -> None:
    assert {entry(path) for path in sources()} - {"__init__"} == set(ORDER)


@pytest.mark.parametrize("path", sources(), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_go_one_way(path: Path) -> None:
    if entry(path) == "__init__":
        assert own(path) == set()
        return
    place = ORDER.index(entry(path))
    late = {name for name in own(path) if ORDER.index(name) > place}
    assert not late


def test_nothing_that_judges_knows_solvers() -> None:
    for path in sources():
        if entry(path) in BLIND_TO_SOLVERS:
            assert not own(path) & {"solvers", "execution", "cli"}, path


@pytest.mark.parametrize("path", sources(), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_heavy_packages_have_one_door(path: Path) -> None:
    name = str(path.relative_to(PACKAGE))
    for module in imports(path):
        doors = DOORS.get(module.split(".")[0])
        assert doors is None or any(name.startswith(door) for door in doors), module


def test_truths_import_numpy_and_scipy_only() -> None:
    for path in (ROOT / "validation").rglob("*.py"):
        heads = {module.split(".")[0] for module in imports(path)}
        assert heads <= {"numpy", "scipy", "math", "dataclasses", "collections", "typing", "validation"}, path


def test_only_the_command_line_prints_and_exits() -> None:
    for path in sources():
        calls = {
            node.func.id
            for node in ast.walk(ast.parse(path.read_text()))
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
        }
        assert entry(path) == "cli" or not calls & {"print", "exit", "quit"}, path


@pytest.mark.parametrize("path", sources(), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_files_and_functions_stay_small(path: Path) -> None:
    text = path.read_text()
    assert len(text.splitlines()) <= 310
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            assert node.end_lineno - node.lineno < 60, node.name
            parameters = [arg.arg for arg in (*node.args.args, *node.args.kwonlyargs) if arg.arg not in ("self", "cls")]
            assert len(parameters) <= 6, node.name


def test_importing_the_package_loads_nothing_heavy() -> None:
    import subprocess
    import sys

    code = "import sys, fem_reference.cli; print(*({'dolfinx', 'gmsh', 'pyvista', 'vtk', 'meshio', 'numba'} & set(sys.modules)))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert loaded == []
