"""One of each kind is added to a copy of the project, in one new file or folder: list, contract and verb find it."""

import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from fem_reference.foundations.subprocesses import environment
from fem_reference.solvers.fenicsx import processes

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not processes.installed(), reason="FEniCSx is not installed"),
]
PROJECT = Path(__file__).parents[2]
FOLDERS = ("fem_reference", "cases", "meshes", "validation", "tests", "examples")


class New(NamedTuple):
    """A new thing: its file, or all files of its folder, by path in the project, and commands with what they must print.

    A command is the words after ``python -m``; one that begins with ``!`` must fail.
    """

    files: dict[str, str | bytes]
    seen: dict[str, str]


def folder(source: str, target: str, changes: dict[str, str] | None = None) -> dict[str, str | bytes]:
    """The files of a folder of the project for a new one, its texts changed."""
    found: dict[str, str | bytes] = {}
    for path in sorted((PROJECT / source).iterdir()):
        if path.is_file():
            content: str | bytes = path.read_bytes()
            for old, new in (changes or {}).items():
                content = path.read_text(encoding="utf-8").replace(old, new)
            found[f"{target}/{path.name}"] = content
    return found


ENTRY = '''
"""A cube in a fluid."""

from fem_reference.assessment.catalogue import Entry, Lab
from fem_reference.effects import make
from fem_reference.problems import shapes
from fem_reference.problems.body import Body
from fem_reference.verification.parts import SYMMETRY, neo_hooke, ramp


def volume(lab: Lab, pressure: float) -> float:
    """V/V0 under a fluid on the top of a cube."""
    mesh = shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")
    fluid = [make("pressure", on=face, pressure=f"{pressure} MPa", ramp=ramp()) for face in ("x1", "y1", "z1")]
    body = Body(mesh, (*neo_hooke(0.01, 1.0), *fluid), SYMMETRY, (0.0, 1.0))
    return lab.solve(body, "P2/P1", first_step=0.5, residual=1e-12).last.scalars["volume_ratio"]


ENTRIES = (
    Entry(
        name="own_entry",
        group="own",
        title="A cube in a fluid: its volume",
        unit="1",
        measure=volume,
        given={"pressure": 0.1},
        negative_control="one percent more pressure",
        wrong={"pressure": 0.101},
        truth=1 - 0.1 / 1.0,
        within=1e-9,
        relative=False,
        because="the element has the exact answer, p = K (1 - J)",
        kind="closed form",
        source="by hand",
    ),
)
'''.lstrip()

TRUTH = '''
"""The area of a circle, derived from a polygon."""


def circle(radius: float) -> float:
    """Pi times the radius [mm] squared [mm2], by 22/7: 0.04 % too large."""
    return 22 / 7 * radius**2
'''.lstrip()

EFFECT = '''
"""A matrix that stiffens as it is stretched, without its resistance to volume change."""

from typing import Any, ClassVar

from fem_reference.effects import Energy, Moduli, State
from fem_reference.foundations.units import PositivePressure


class OwnEffect(Energy):
    """``mu/2 ((I - 3) + b (I - 3)^2)``, I the isochoric first invariant; ``mu`` [MPa], ``b`` without unit (Yeoh 1990)."""

    example: ClassVar[dict[str, Any]] = {"mu": "10 kPa", "b": 0.2}
    mu: PositivePressure
    b: float

    def moduli(self) -> Moduli:
        """The stiffness that it gives the body at rest."""
        return Moduli(shear=self.mu)

    def energy(self, state: State) -> Any:
        """Energy per rest volume [MPa]."""
        more = state.J ** (-2 / 3) * state.I1 - 3
        return self.mu / 2 * (more + self.b * more**2)
'''.lstrip()

METRIC = '''
"""Area of the surface of a run against that of the reference."""

import numpy as np

from fem_reference.foundations.mesh import triangle_areas
from fem_reference.metrics import Measure, MeasurementContext, Statistic, measures
from fem_reference.runs.store import Run

STATISTICS = {
    "deviation": Statistic(
        "%",
        "Area",
        headline="area by {}",
        curve="Change of area from rest",
        shown={"table": 15, "headline": 35, "curve": 15, "solvers": 15},
    )
}
OF, AGAINST = "surface", "reference"


@np.errstate(over="ignore", invalid="ignore")
def measure(run: Run, reference: Run, _context: MeasurementContext) -> tuple[Measure, ...]:
    """``deviation`` = A / A_reference - 1 [%] of the area A."""
    areas, wanted = (
        np.array([triangle_areas(points, each.surface.triangles).sum() for points in each.positions])
        for each in (run, reference)
    )
    return measures("own_metric", {"deviation": 100 * (areas / wanted - 1)})
'''.lstrip()

SOLVER = '''
"""Position based dynamics under another name."""

from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Outcome, Sink
from fem_reference.solvers import pbd
from fem_reference.solvers.common.protocol import MuscleSolver, TableRow

Settings = pbd.PbdSettings
_SETTINGS = {"sub_iterations": 2, "solver_iterations": 1, "damping": 0.1, "stretch": 1.0, "volume": 1.0, "bending": 0.5}


def solve(setup: Setup, settings: Settings, sink: Sink) -> Outcome:
    """Every frame, as position based dynamics has it."""
    return pbd.solve(setup, settings, sink)


SOLVES = (
    MuscleSolver(settings=Settings, solve=solve, example=_SETTINGS, table=(TableRow("PBD", "own_solver", _SETTINGS),)),
)
'''.lstrip()

EXAMPLE = '''
"""A half, by the public API."""

import fem_reference as fr

print("share of a pressure [MPa]:", fr.make_effect("neo_hooke", mu="5 kPa").mu * 100)
# Ends in 0.5 within 1e-12: the unit of pressure is 1 MPa.
'''.lstrip()

VERB = '''
"""The verb ``own_verb``: how many cases there are."""

import argparse

from fem_reference.cli import DONE, write_output
from fem_reference.scenes import casefile

HELP = "how many cases there are"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The option to name them."""
    parser.add_argument("--names", action="store_true", help="name them too")


def run(options: argparse.Namespace) -> int:
    """Count them."""
    found = casefile.cases()
    write_output({"cases": len(found)}, " ".join(found) if options.names else f"{len(found)} cases", options)
    return DONE
'''.lstrip()

KINDS = {
    "verb": New(
        {"fem_reference/cli/own_verb.py": VERB},
        {
            "fem_reference --help": "how many cases there are",
            "fem_reference own_verb": " cases",
            "fem_reference own_verb --names --quiet": "hip_flexion",
            "!fem_reference own_verb --no-such-option": "--no-such-option",
            "pytest -q tests/cli/test_verbs.py -k own_verb": "3 passed",
        },
    ),
    "effect": New(
        {"fem_reference/effects/own_effect.py": EFFECT},
        {
            "pytest -q tests/contracts/test_every_effect.py -k own_effect": "8 passed",
            "pytest -q tests/export/test_open_formats.py -k own_effect": "1 passed",
        },
    ),
    "metric": New(
        {"fem_reference/metrics/own_metric.py": METRIC},
        {
            "fem_reference list": "own_metric",
            "pytest -q tests/metrics/test_init.py -k own_metric": "2 passed",
            "pytest -q tests/contracts/test_every_metric.py -k zero": "2 passed",
        },
    ),
    "solver": New(
        {"fem_reference/solvers/own_solver.py": SOLVER},
        {
            "fem_reference list": "own_solver",
            "pytest -q tests/contracts/test_every_solver.py -k own_solver": "passed",
            "pytest -q tests/solvers/test_init.py": "passed",
        },
    ),
    "verification entry": New(
        {"fem_reference/verification/own_entry.py": ENTRY},
        {
            "fem_reference verify own --quiet": "verdict: pass, 1 of 1 pass",
            "!fem_reference verify --negative-control own_entry --quiet": "fail (negative control)",
            "pytest -q tests/contracts/test_every_entry.py -k own_entry": "3 passed",
        },
    ),
    "mesh": New(
        folder("meshes/box", "meshes/own_mesh"),
        {"pytest -q tests/contracts/test_every_mesh.py -k own_mesh": "passed"},
    ),
    "case": New(
        folder("cases/rod", "cases/own_case", {"rod": "own rod"}),
        {
            "fem_reference list": "own_case",
            "fem_reference run own_case --solver listing --quiet": "pass: listing nodal_error",
            "pytest -q tests/contracts/test_every_case.py -k own_case": "passed",
        },
    ),
    "example": New(
        {"examples/own_example.py": EXAMPLE},
        {"pytest -q tests/house/test_examples.py -k own_example": "1 passed"},
    ),
    "truth": New(
        {"validation/own_truth.py": TRUTH},
        {"pytest -q tests/verification/test_truths.py -k own_truth": "1 passed"},
    ),
}


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of the project."""
    for name in FOLDERS:
        shutil.copytree(PROJECT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(PROJECT / "pyproject.toml", tmp_path)
    return tmp_path


@pytest.mark.parametrize("kind", KINDS)
def test_one_new_file_or_folder_is_all_that_it_takes(kind: str, copy: Path) -> None:
    new = KINDS[kind]
    assert len(new.files) == 1 or len({Path(name).parent for name in new.files}) == 1
    for name, content in new.files.items():
        path = copy / name
        assert not path.exists()
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    here = environment(PYTHONPATH=str(copy))
    for command, printed in new.seen.items():
        words = [sys.executable, "-m", *command.removeprefix("!").split()]
        done = subprocess.run(words, cwd=copy, env=here, capture_output=True, text=True, check=False)
        output = done.stdout + done.stderr
        assert (done.returncode != 0) == command.startswith("!"), output
        assert printed in output, output
