"""Version of the package (stated on pages, in files and in stored runs), and versions of other packages."""

import importlib.metadata
from collections.abc import Iterable
from contextlib import suppress

__version__ = "0.1.0"


def versions(packages: Iterable[str]) -> dict[str, str]:
    """Versions of those ``packages`` that are installed, by name."""
    found = dict[str, str]()
    for package in packages:
        with suppress(importlib.metadata.PackageNotFoundError):
            found[package] = importlib.metadata.version(package)
    return found
