"""The modules in folders, one file or folder each, that a package offers."""

import pkgutil
from collections.abc import Iterable
from functools import cache
from pathlib import Path


def names(places: Iterable[str]) -> tuple[str, ...]:
    """The names of the modules in the folders ``places``, sorted; a folder is listed again after a file is added or removed."""
    return _listed(tuple((place, Path(place).stat().st_mtime_ns) for place in places if Path(place).is_dir()))


@cache
def _listed(places: tuple[tuple[str, int], ...]) -> tuple[str, ...]:
    """The names of the modules in folders, each given with the time of its last change."""
    return tuple(sorted(module.name for module in pkgutil.iter_modules([place for place, _ in places])))
