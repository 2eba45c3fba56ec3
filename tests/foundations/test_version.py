"""Versions of packages: those of what is installed, and nothing of what is not."""

import numpy as np

from fem_reference.foundations.version import versions


def test_a_package_that_is_not_there_has_no_version() -> None:
    assert versions(("numpy", "no_such_package_anywhere")) == {"numpy": np.__version__}
