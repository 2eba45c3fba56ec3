"""The calls that the package offers to Python, from a case to a page, and for a body."""

import json
import os
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
import small

import fem_reference as fr
from fem_reference.solvers.fenicsx import processes


@pytest.mark.slow
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


@pytest.mark.slow
def test_a_function_is_a_solver(tmp_path) -> None:
    """It runs in another process, with its settings; another function, or another setting, is another run."""
    case = fr.load_case(small.write(tmp_path / "bar"), {"frames.every": 10})
    store, process = tmp_path / "runs", os.getpid()

    def moved(scene: Path, out: Path, *, far: float) -> None:
        assert os.getpid() != process
        rest = meshio.read(scene / "muscle.ply")
        for frame in json.loads((scene / "scene.json").read_text())["frames"]:
            meshio.Mesh(rest.points + [0, 0, far * frame], rest.cells).write(out / f"{frame}.ply")

    def failing(scene: Path, out: Path) -> None:
        raise ArithmeticError(f"{scene.name} has no {out.name}")

    run = fr.solve(case, moved, store=store, far=0.5)
    assert (run.name, run.outcome.status) == ("moved", "converged")
    assert run.positions[-1] - run.positions[0] == pytest.approx(np.broadcast_to([0, 0, 10.0], run.positions[0].shape))
    assert fr.solve(case, moved, store=store, far=0.5).folder == run.folder
    assert fr.solve(case, moved, store=store, far=0.25).folder != run.folder
    failed = fr.solve(case, failing, store=store)
    assert failed.outcome.status == "crashed"
    assert "ArithmeticError: scene has no out" in failed.outcome.message
    with pytest.raises(fr.InputError, match="the name of a solver, a function, or None"):
        fr.solve(case, 3, store=store)


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
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


def test_a_case_is_read_with_other_values(tmp_path: Path) -> None:
    folder = small.write(tmp_path / "bar")
    case = fr.load_case(folder, {"frames.last": 10, "effect[0].mu": "11 kPa"})
    assert case.numbers == (0, 5, 10)
    assert case.effects[0].mu == pytest.approx(0.011)
    assert case.key != fr.load_case(folder / "case.toml").key
    with pytest.raises(fr.InputError, match="want last = first"):
        fr.load_case(folder, {"frames.last": 7})
