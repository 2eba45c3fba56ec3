"""The faults that ``faults.py`` plants are where it looks for them."""

from pathlib import Path

import faults
import pytest

import fem_reference

PACKAGE, TESTS = Path(fem_reference.__file__).parent, Path(__file__).parent


@pytest.mark.parametrize("fault", faults.FAULTS, ids=lambda fault: fault.name)
def test_a_fault_can_be_planted(fault: faults.Fault) -> None:
    assert (PACKAGE / fault.file).read_text(encoding="utf-8").count(fault.old) == 1
    assert fault.old != fault.new
    assert all((TESTS / f"{name}.py").is_file() for name in fault.tests.split())
