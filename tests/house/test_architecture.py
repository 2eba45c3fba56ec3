"""The design as tests: fourteen packages in one order of imports, one door per heavy package, sizes of files and functions."""

import ast
import subprocess
import sys

import counts
import pytest
from counts import ORDER, PACKAGE, ROOT

# These see runs and never who made them.
BLIND_TO_SOLVERS = ["metrics", "assessment", "report"]
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
    "skfem": ["geometry/fibres.py", "geometry/quadratic.py", "solvers/scikit_fem/"],
    "numba": [
        f"solvers/{name}_kernels.py" for name in ("compiled", "pbd", "program", "collision", "xpbd", "arap", "spring")
    ],
    "pyvista": ["io/", "report/pictures.py"],
    "vtk": [],
    "vtkmodules": ["io/formats/_vtk_xml.py"],  # blocks of LZ4, which pyvista has no name for
    "meshio": ["io/"],
    "matplotlib": ["report/"],
    "jinja2": ["report/"],
    "pint": ["foundations/units.py"],
}
TRUTHS_MAY = {"numpy", "scipy", "math", "dataclasses", "collections", "typing", "validation"}
LINES, FUNCTION, ARGUMENTS = 300, 40, 6


def imports(tree: ast.AST) -> set[str]:
    """Every module that is imported, anywhere."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module == "fem_reference":
            found |= {f"fem_reference.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module or "")
    return found


def own(tree: ast.AST) -> set[str]:
    """Which of our packages are imported."""
    return {name.split(".")[1] for name in imports(tree) if name.startswith("fem_reference.")} - {"__version__"}


def test_packages_import_in_one_order_and_heavy_ones_have_one_door() -> None:
    found = {path.name for path in PACKAGE.iterdir() if path.name != "__pycache__"}
    assert found == {*ORDER, "__init__.py", "__init__.pyi", "__main__.py", "py.typed"}
    wrong = []
    for name, _, _, tree in counts.modules():
        place = name.split("/")[0]
        later = ORDER[ORDER.index(place) + 1 :] if place in ORDER else []
        wrong += [f"{name} imports {other}, which stands after it" for other in own(tree) & set(later)]
        if place in BLIND_TO_SOLVERS:
            wrong += [f"{name} knows solvers" for other in own(tree) & {"solvers"}]
        for module in imports(tree):
            doors = DOORS.get(module.split(".")[0])
            if doors is not None and not any(name.startswith(door) for door in doors):
                wrong.append(f"{name} imports {module}, whose door is {doors}")
    for path in (ROOT / "validation").rglob("*.py"):
        strange = {module.split(".")[0] for module in imports(ast.parse(path.read_text(encoding="utf-8")))} - TRUTHS_MAY
        wrong += [f"{path.name}, a truth, imports {module}" for module in strange]
    assert not wrong


def test_files_and_functions_stay_small_and_only_the_command_line_prints() -> None:
    wrong = []
    for name, lines, _, tree in counts.modules():
        if lines > LINES:
            wrong.append(f"{name} has {lines} lines")
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                parameters = {arg.arg for arg in (*node.args.args, *node.args.kwonlyargs)} - {"self", "cls"}
                if len(parameters) > ARGUMENTS or (node.end_lineno or 0) - node.lineno >= FUNCTION:
                    wrong.append(f"{name}: {node.name} is too long, or has too many arguments")
            called = node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else ""
            if called in ("print", "exit", "quit") and not name.startswith("cli/"):
                wrong.append(f"{name} calls {called}")
    assert not wrong


@pytest.mark.parametrize("count", counts.COUNTS, ids=lambda count: count.title.replace(" ", "_"))
def test_the_house_keeps_to_its_counts(count: counts.Count) -> None:
    places = list(count.places(counts.modules()))
    assert len(places) <= count.most, places


def test_importing_the_package_loads_nothing_heavy() -> None:
    code = "import sys, fem_reference.cli; print(*({'dolfinx', 'gmsh', 'pyvista', 'vtk', 'meshio', 'numba'} & set(sys.modules)))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert loaded == []
    code = "import sys, fem_reference.solvers as s; assert s.names('solve'); print('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"
