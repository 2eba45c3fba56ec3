"""Effects written by users: files outside the package, in the folders listed in the environment variable FEM_REFERENCE_EFFECTS."""

import os
from functools import cache
from pathlib import Path
from types import ModuleType

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record

SETTING = "FEM_REFERENCE_EFFECTS"
_PACKAGE = Path(__file__).resolve().parent.parent


def folders() -> list[str]:
    """Folders listed in the environment variable, separated as in PATH."""
    return [str(Path(folder).absolute()) for folder in os.environ.get(SETTING, "").split(os.pathsep) if folder]


@cache
def only_record(module: ModuleType, places: tuple[str, ...], kinds: tuple[type[Record], ...]) -> type[Record]:
    """Return the only class in ``module`` that is a subclass of one of ``kinds``. Raises InputError if there is not exactly one
    such class, or if modules with this name are in several of the folders ``places``.
    """
    name = module.__name__.rpartition(".")[2]
    found = [place for place in places if (Path(place) / f"{name}.py").is_file()]
    if len(found) > 1:
        raise InputError(SETTING, f'"{name}" in {" and in ".join(found)}', "effects with different names")
    own = [one for one in vars(module).values() if isinstance(one, type) and one.__module__ == module.__name__]
    records = [one for one in own if issubclass(one, kinds)]
    if len(records) != 1:
        raise InputError(str(module.__file__), f"{len(records)} effects", "one class that is an effect")
    return records[0]


def source(module: ModuleType) -> bytes:
    """Content of the file of a ``module`` outside the package; empty for a module of the package, which is hashed elsewhere."""
    file = Path(str(module.__file__)).resolve()
    return b"" if file.is_relative_to(_PACKAGE) else file.read_bytes()
