"""The package as Python has it: a case from file to page in a few lines, and a body from scratch."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import small

import fem_reference as fr
from fem_reference.foundations.subprocesses import command, environment
from fem_reference.solvers.fenicsx import processes

pytestmark = pytest.mark.slow

README = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")
(STRETCHED_BLOCK,) = (block for block in re.findall(r"```python\n(.*?)```", README, re.DOTALL) if "Prescribed" in block)


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
    assert f"{volume.values[volume.worst]:.4g} %" in shown
    with pytest.raises(KeyError):
        result["pbd", "surface_deviation", "deepest"]
    assert fr.write_report(result, tmp_path / "page").read_text().startswith("<!DOCTYPE html>")
    assert "candidate.toml" in fr.export_case(case, tmp_path / "export")


@pytest.mark.skipif(not processes.installed(), reason="FEniCSx is not installed")
def test_the_script_of_the_readme_stretches_a_block_in_25_lines(tmp_path) -> None:
    assert len(STRETCHED_BLOCK.strip().splitlines()) <= 25
    script = tmp_path / "block.py"
    script.write_text(STRETCHED_BLOCK)
    done = subprocess.run(command(str(script)), env=environment(), capture_output=True, text=True, check=True)
    # Incompressible neo-Hooke: the nominal stress is mu (l - 1 / l^2); a bulk modulus of 10^4 mu leaves 1e-4 of it.
    force = float(done.stdout.strip("[]\n ").split()[2])
    assert force == pytest.approx(0.01 * (1.2 - 1.2**-2) * 100, rel=3e-4)


def test_importing_the_package_does_nothing() -> None:
    code = "import sys, fem_reference; print(*(name for name in sys.modules if name.startswith('fem_reference.')))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
