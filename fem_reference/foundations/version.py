"""The version of the package, which pages, files and stored runs state, and the versions of other packages."""

import importlib.metadata
from collections.abc import Iterable
from contextlib import suppress

__version__ = "0.1.0"


def versions(packages: Iterable[str]) -> dict[str, str]:
    """The versions of all installed ``packages``."""
    found = dict[str, str]()
    for package in packages:
        with suppress(importlib.metadata.PackageNotFoundError):
            found[package] = importlib.metadata.version(package)
    return found
