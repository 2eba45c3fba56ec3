"""Names of the modules in given folders; each module is one file or one folder."""

import pkgutil
from collections.abc import Iterable
from functools import cache
from pathlib import Path


def names(places: Iterable[str]) -> tuple[str, ...]:
    """Sorted names of the modules in the folders ``places``; a folder is listed again if a file in it has been added or removed."""
    return _listed(tuple((place, Path(place).stat().st_mtime_ns) for place in places if Path(place).is_dir()))


@cache
def _listed(places: tuple[tuple[str, int], ...]) -> tuple[str, ...]:
    """Sorted names of the modules in folders, each given as a path and the time of its last change."""
    return tuple(sorted(module.name for module in pkgutil.iter_modules([place for place, _ in places])))
