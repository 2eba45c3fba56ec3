"""Fixtures of tests that solve bodies."""

from collections.abc import Iterator

import pytest

from fem_reference.solvers.fenicsx.processes import installed
from fem_reference.solvers.fenicsx.session import Session, opened


@pytest.fixture(scope="module")
def session() -> Iterator[Session]:
    """The process that all tests share; it starts anew where a test ended it."""
    if not installed():
        pytest.skip("FEniCSx is not installed")
    with opened() as own:
        yield own
