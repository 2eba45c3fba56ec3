"""Fixtures of the tests of pages."""

import pytest

from fem_reference.assessment.comparison import Comparison
from tests.report import comparisons


@pytest.fixture
def comparison(tmp_path, monkeypatch) -> Comparison:
    """A reference that moves, a candidate beside it, and one whose last frame is not a number."""
    return comparisons.small_comparison(tmp_path, monkeypatch)
