"""The package as Python has it: a case from file to page in a few lines, and a body from scratch."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pages
import pytest
import small

import fem_reference as fr
from fem_reference.foundations.mesh import Polylines
from fem_reference.foundations.subprocesses import command, environment
from fem_reference.solvers.fenicsx import processes

pytestmark = pytest.mark.slow

STRETCHED_BLOCK = pages.snippet("docs/python.md", "Prescribed")


def test_every_public_name_is_there_and_said_what_it_is() -> None:
    assert set(dir(fr)) == {*fr.__all__, "__version__"}
    for name in fr.__all__:
        assert getattr(fr, name).__doc__, name
    with pytest.raises(AttributeError, match="no attribute 'load_cases'"):
        fr.load_cases  # noqa: B018


def test_a_case_goes_from_its_file_to_a_page(tmp_path) -> None:
    case = fr.load_case(small.write(tmp_path / "bar"), {"frames.every": 10})
    lines: list[str] = []
    reference = fr.solve(case, "pbd", store=tmp_path / "runs", progress=lines.append)
    assert reference.outcome.status == "converged"
    assert any("pbd" in line for line in lines)
    count = len(lines)
    assert fr.solve(case, "pbd", store=tmp_path / "runs", progress=lines.append).folder == reference.folder
    assert "solved before" in lines[count]
    assert case.title in case._repr_html_()
    assert "converged: 20 iterations" in reference._repr_html_()
    mine = fr.read_run(reference.folder, case)
    assert np.abs(mine.positions - reference.positions).max() == 0
    with pytest.raises(fr.InputError, match="a reference that carries the fibres"):
        fr.compare(case, mine, [reference])


def small_fibres() -> Polylines:
    return Polylines(np.array([[5.0, 5, 1], [5, 5, 39]]), np.array([0, 2]))


def test_a_scalar_case_uses_the_same_calls(tmp_path) -> None:
    # -psi'' = 2 with psi = 0 at both ends is x (1 - x); linear elements are exact at their nodes.
    table = {
        "title": "A rod",
        "proves": "that it is short",
        "domain": {"interval": {"start": 0.0, "end": 1.0, "count": 11}},
        "effect": [{"name": "diffusion", "coefficient": 1.0}, {"name": "source", "strength": 2, "where": "everywhere"}],
        "boundary": [{"on": "left", "value": 0}, {"on": "right", "value": 0}],
        "element": {"order": 1, "form": "galerkin"},
        "exact": "x*(1 - x)",
        "reference": {"solver": "scikit_fem"},
        "expect": [
            {"of": "candidates", "metric": "nodal_error", "truth": 0.0, "within": 1e-12}
            | {"kind": "closed form", "because": "elements of order 1 are exact at nodes"}
        ],
    }
    case = fr.make_case(table, name="rod")
    assert "exact solution" in case._repr_html_()
    reference = fr.solve(case, store=tmp_path / "runs")
    again = fr.solve(case, store=tmp_path / "runs")
    assert again.folder == reference.folder
    assert np.array_equal(again.vertex_values, reference.vertex_values)
    assert reference.vertex_values[0, 5] == pytest.approx(0.25, rel=1e-13)
    result = fr.compare(case, reference, [replace(again, name="again")])
    assert result.word == "pass"
    assert result["again", "maximum", "value"].values == pytest.approx([0.25])
    assert result["again", "difference", "max"].values.tolist() == [0]
    # The error of the interpolant of a parabola on intervals h: h^2 sqrt(1 / 30).
    assert result["reference", "l2_error", "norm"].values == pytest.approx([0.01 / np.sqrt(30)], rel=1e-9)
    assert "<svg " in fr.write_report(result, tmp_path / "page").read_text()
    for call in (lambda: fr.error_bars(case, reference), lambda: fr.export_case(case, tmp_path / "export")):
        with pytest.raises(fr.InputError, match='case: got "rod", a scalar case, want the case of a muscle'):
            call()


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.skipif(not processes.installed(), reason="FEniCSx is not installed")
def test_a_reference_is_compared_exported_and_written(tmp_path) -> None:
    case = fr.load_case(small.write(tmp_path / "bar"), {"frames.every": 10})
    reference, pbd = (fr.solve(case, solver, store=tmp_path / "runs") for solver in (None, "pbd"))
    result = fr.compare(case, reference, [pbd])
    assert result["pbd", "surface_deviation", "max"].values[-1] > 0
    assert result["reference", "volume", "deviation"].unit == "%"
    shown = result._repr_html_()
    assert shown.count("<tr>") == 1 + 4
    volume = result["pbd", "volume", "deviation"]
    assert f"{volume.worst.value:.4g} %" in shown
    with pytest.raises(KeyError):
        result["pbd", "surface_deviation", "deepest"]
    assert fr.write_report(result, tmp_path / "page").read_text().startswith("<!DOCTYPE html>")
    assert "candidate.toml" in fr.export_case(case, tmp_path / "export")


@pytest.mark.skipif(not processes.installed(), reason="FEniCSx is not installed")
def test_the_script_of_the_pages_stretches_a_block_in_25_lines(tmp_path) -> None:
    assert len(STRETCHED_BLOCK.strip().splitlines()) <= 25
    script = tmp_path / "block.py"
    script.write_text(STRETCHED_BLOCK)
    done = subprocess.run(command(str(script)), env=environment(), capture_output=True, text=True, check=True)
    # Incompressible neo-Hooke: the nominal stress is mu (l - 1 / l^2); a bulk modulus of 10^4 mu leaves 1e-4 of it.
    status, numbers = done.stdout.split("[")
    assert status.strip() == "converged"
    force = float(numbers.strip("]\n ").split()[2])
    assert force == pytest.approx(0.01 * (1.2 - 1.2**-2) * 100, rel=3e-4)


def test_importing_the_package_does_nothing() -> None:
    code = "import sys, fem_reference; print(*(name for name in sys.modules if name.startswith('fem_reference.')))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_what_cannot_be_compared_is_refused_by_name(tmp_path) -> None:
    case = fr.load_case(small.write(tmp_path / "bar"), {"frames.every": 10})
    run = fr.solve(case, "pbd", store=str(tmp_path / "runs"))  # a store may be text
    reference = replace(run, name="reference", fibres=small_fibres(), fibre_positions=np.zeros((3, 2, 3)))
    with pytest.raises(fr.InputError, match='candidates: got the name "pbd" twice'):
        fr.compare(case, reference, [run, run])
    other = replace(run, positions=run.positions[:, :5])
    with pytest.raises(fr.InputError, match=r'candidate "pbd": got 5 vertices, want the \d+ vertices of the reference'):
        fr.compare(case, reference, [other])


def test_runs_of_another_case_are_refused(tmp_path) -> None:
    folder = small.write(tmp_path / "bar")
    case = fr.load_case(folder, {"frames.every": 10})
    other = fr.load_case(folder, {"frames.every": 10, "bone[1].motion.keyframes[1].angle": "0.3 rad"})
    run = fr.solve(case, "pbd", store=tmp_path / "runs")
    of_other = replace(fr.solve(other, "pbd", store=tmp_path / "runs"), name="other")
    inside = {"name": "reference", "fibres": small_fibres(), "fibre_positions": np.zeros((3, 2, 3))}
    reference, strange = replace(run, **inside), replace(of_other, **inside)
    assert fr.compare(case, reference, [run]).word
    with pytest.raises(
        fr.InputError, match=r'candidate "other": got a run of another case \("bar"\), want one of "bar" with all'
    ):
        fr.compare(case, reference, [of_other])
    with pytest.raises(fr.InputError, match='reference "reference": got a run of another case'):
        fr.compare(case, strange, [run])
    with pytest.raises(fr.InputError, match='reference "reference": got a run of another case'):
        fr.error_bars(case, strange)
    # What somebody else's program wrote says of no case; it is checked when it is read.
    assert fr.compare(case, reference, [replace(of_other, origin={})]).word


def test_calls_with_what_they_do_not_want_are_refused(tmp_path) -> None:
    case = fr.load_case(small.write(tmp_path / "bar"), {"frames.every": 10})
    run = fr.solve(case, "pbd", store=tmp_path / "runs")
    (tmp_path / "file").write_text("")
    calls = {
        'settings nonsense: got no solver, want the name of the solver that they are of, such as solver="fenicsx"': (
            lambda: fr.solve(case, nonsense=3)
        ),
        "solver: got int 3, want the name of a solver": lambda: fr.solve(case, 3),
        "case: got str 'bar', want a Case": lambda: fr.solve("bar"),
        "progress: got int 3, want a function of a line": lambda: fr.solve(case, "pbd", progress=3),
        "store: got int 3, want a path": lambda: fr.solve(case, "pbd", store=3),
        "store: got .*, while .*file is a file, want a folder": lambda: fr.solve(
            case, "pbd", store=tmp_path / "file" / "x"
        ),
        "case: got int 3, want a path": lambda: fr.load_case(3),
        "changes: got list": lambda: fr.load_case("hip_flexion", ["frames.last"]),
        r'motion: got .*, want either "axis" and "centre" \(a rotation\) or "direction"': (
            lambda: fr.load_case(tmp_path / "bar", {"bone[1].motion.axis": None})
        ),
        "changes: got dict": lambda: fr.load_case("hip_flexion", {3: 4}),
        "reference: got NoneType None, want a Run": lambda: fr.compare(case, None),
        "candidates: got Run": lambda: fr.compare(case, run, run),
        "candidate: got int 3": lambda: fr.compare(case, run, [3]),
        "error_bars: got int 3, want ErrorBars": lambda: fr.compare(case, run, [], error_bars=3),
        "form: got 'abaqus', want one of open, febio": lambda: fr.export_case(case, tmp_path / "new", "abaqus"),
        "comparison: got Run": lambda: fr.write_report(run, tmp_path / "new"),
        "comparison: got int 3": lambda: fr.export_runs(3, tmp_path / "new"),
        "body: got Run": lambda: fr.solve_body(run),
        'effect: got "3", want one of': lambda: fr.make_effect(3),
    }
    for message, call in calls.items():
        with pytest.raises(fr.InputError, match=message):
            call()


def test_a_body_with_a_path_or_setting_that_cannot_be_is_refused_before_it_is_solved() -> None:
    block = fr.box((1, 1, 1), (10.0, 10.0, 10.0), "tetrahedron")
    wrong = fr.Prescribed("top", "z1", (2,), lambda points, _: points[:, 0])
    body = fr.Body(block, (fr.make_effect("neo_hooke", mu=0.01),), (wrong,), frames=(0.0, 1.0))
    with pytest.raises(
        fr.InputError, match=r'prescribed "top": path at frame 0: got displacements \(4,\) of points \(4, 3\)'
    ):
        fr.solve_body(body, element="P1")
    still = fr.Prescribed("top", "z1", (2,), lambda points, _: 0 * points)
    with pytest.raises(
        fr.InputError, match=r"settings\.elemnt: got an unknown key, want element, or another one of element"
    ):
        fr.solve_body(replace(body, prescribed=(still,)), elemnt="P2")
