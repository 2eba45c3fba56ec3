"""One of each kind is added to a copy of the project, in one new file or folder: list, contract and verb find it."""

import collections
import functools
import re
import shlex
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
    """A new thing: its file, or all files of its folder, by path in the project; files of tests, with the least number of tests in
    each that ask it; and commands with what they must print.

    A command is the words after ``python -m``; one that begins with ``!`` must fail.
    """

    files: dict[str, str | bytes]
    tested: dict[str, int]
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
        name="added_entry",
        group="added",
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
    return measures("added_metric", {"deviation": 100 * (areas / wanted - 1)})
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
    MuscleSolver(
        settings=Settings,
        solve=solve,
        example=_SETTINGS,
        depends_on=("order",),
        table=(TableRow("PBD", "added_solver", _SETTINGS),),
    ),
)
'''.lstrip()

EXAMPLE = '''
"""A half, by the public API."""

import fem_reference as fr

print("share of a pressure [MPa]:", fr.make_effect("neo_hooke", mu="5 kPa").mu * 100)
# Ends in 0.5 within 1e-12: the unit of pressure is 1 MPa.
'''.lstrip()

VERB = '''
"""The verb ``added-verb``: how many cases there are."""

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
        {"fem_reference/cli/added_verb.py": VERB},
        {"tests/cli/test_verbs.py": 3},
        {
            "fem_reference --help": "how many cases there are",
            "fem_reference added-verb --names --quiet": "hip_flexion",
            "!fem_reference added-verb --no-such-option": "--no-such-option",
        },
    ),
    "effect": New(
        {"fem_reference/effects/added_effect.py": EFFECT},
        {"tests/contracts/test_every_effect.py": 8, "tests/solvers/common/test_open_formats.py": 1},
        {},
    ),
    "metric": New(
        {"fem_reference/metrics/added_metric.py": METRIC},
        {"tests/metrics/test_init.py": 2, "tests/contracts/test_every_metric.py": 2},
        {
            "fem_reference list": "added_metric",
        },
    ),
    "solver": New(
        {"fem_reference/solvers/added_solver.py": SOLVER},
        {"tests/contracts/test_every_solver.py": 1, "tests/solvers/test_init.py": 1},
        {
            "fem_reference list": "added_solver",
        },
    ),
    "verification entry": New(
        {"fem_reference/verification/added_entry.py": ENTRY},
        {"tests/contracts/test_every_entry.py": 3},
        {
            "fem_reference verify added --quiet": "verdict: pass, 1 of 1 pass",
        },
    ),
    "mesh": New(
        folder("meshes/box", "meshes/added_mesh"),
        {"tests/contracts/test_every_mesh.py": 1},
        {},
    ),
    "case": New(
        folder("cases/rod", "cases/added_case", {"rod": "own rod"}),
        {"tests/contracts/test_every_case.py": 1},
        {
            "fem_reference list": "added_case",
            "fem_reference run added_case --solver listing --quiet": "pass: listing nodal_error",
        },
    ),
    "example": New(
        {"examples/added_example.py": EXAMPLE},
        {"tests/house/test_examples.py": 1},
        {},
    ),
    "truth": New(
        {"validation/added_truth.py": TRUTH},
        {"tests/verification/test_parts.py": 1},
        {},
    ),
}


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project with one more of each kind, each in one file or one folder."""
    target = tmp_path_factory.mktemp("copy")
    for name in FOLDERS:
        shutil.copytree(PROJECT / name, target / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(PROJECT / "pyproject.toml", target)
    for new in KINDS.values():
        assert len(new.files) == 1 or len({Path(name).parent for name in new.files}) == 1
        for name, content in new.files.items():
            path = target / name
            assert not path.exists()
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(content.encode() if isinstance(content, str) else content)
    return target


@functools.cache
def printed_by(words: str, copy: Path) -> tuple[int, str]:
    """Status and output of ``python -m`` with more words, in the copy; of words that several kinds have, once."""
    line = [sys.executable, "-m", *shlex.split(words)]
    here = environment(PYTHONPATH=str(copy))
    done = subprocess.run(line, cwd=copy, env=here, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


@pytest.mark.parametrize("kind", KINDS)
def test_one_new_file_or_folder_is_all_that_commands_need(kind: str, copy: Path) -> None:
    for command, printed in KINDS[kind].seen.items():
        status, output = printed_by(command.removeprefix("!"), copy)
        assert (status != 0) == command.startswith("!"), output
        assert printed in output, output


def test_one_new_file_or_folder_is_all_that_tests_need(copy: Path) -> None:
    files = [file for new in KINDS.values() for file in new.tested]
    asked = '-k "added_ or added-verb or zero or (solvers and test_init)"'
    status, output = printed_by(f"pytest -q -rA {' '.join(files)} {asked}", copy)
    assert status == 0, output
    passed = collections.Counter(re.findall(r"^PASSED (tests/[^:]+)::", output, re.MULTILINE))
    for kind, new in KINDS.items():
        for file, count in new.tested.items():
            assert passed[file] >= count, (kind, file, output)
