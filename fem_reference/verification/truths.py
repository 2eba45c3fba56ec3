"""Access to ``validation/``: closed forms and published numbers, which know nothing of this package."""

import importlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from fem_reference.scenes.case import HOME

FOLDER = HOME / "validation"


def find(name: str) -> ModuleType:
    """The module ``validation/<name>.py``.

    >>> round(find("torsion").square_bar_stiffness(1.0, 1.0), 4)
    0.1406
    """
    if FOLDER.name not in sys.modules:
        _load_package()
    loaded = [str(Path(path).resolve()) for path in sys.modules[FOLDER.name].__path__]
    if str(FOLDER) not in loaded:
        raise ImportError(f'another package "{FOLDER.name}" is loaded, from {loaded}; the truths are in {FOLDER}')
    return importlib.import_module(f"{FOLDER.name}.{name}")


def _load_package() -> None:
    """Load the folder as a package, wherever Python looks for modules."""
    where = [str(FOLDER)]
    spec = importlib.util.spec_from_file_location(FOLDER.name, FOLDER / "__init__.py", submodule_search_locations=where)
    assert spec is not None  # a file that ends in .py always has one
    assert spec.loader is not None
    sys.modules[FOLDER.name] = package = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(package)
