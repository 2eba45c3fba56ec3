"""The package as Python has it: a case from file to page in a few lines, and a body from scratch."""

import subprocess
import sys

import pages
import pytest

import fem_reference as fr
from fem_reference.foundations.subprocesses import command, environment
from fem_reference.solvers.fenicsx import processes

pytestmark = pytest.mark.slow

STRETCHED_BLOCK = pages.snippet("docs/python.md", "pulled")


def test_every_public_name_is_there_and_said_what_it_is() -> None:
    assert set(dir(fr)) == {*fr.__all__, "__version__"}
    for name in fr.__all__:
        assert getattr(fr, name).__doc__, name
    with pytest.raises(AttributeError, match="no attribute 'load_cases'"):
        fr.load_cases  # noqa: B018


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
