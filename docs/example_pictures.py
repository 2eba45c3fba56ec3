"""Pictures of the examples, kept in ``docs/_static/examples``: the last figure of a notebook, or what a script compared in the end.

``python docs/example_pictures.py`` executes them all and draws (two minutes). ``FILE`` has a hash of each source, by which the
tests know a picture that is older than its example.
"""

import base64
import hashlib
import io
import json
import re
import runpy
import sys
import tempfile
from contextlib import chdir
from pathlib import Path

from PIL import Image

from fem_reference.assessment.comparison import Comparison
from fem_reference.report import gallery

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
KEPT = Path(__file__).parent / "_static/examples"
FILE = KEPT / "sources.json"


def sources() -> dict[str, str]:
    """By the name of each example that has a picture a hash of its source."""
    names = list(EXAMPLES.glob("*.ipynb"))
    names += [path for path in EXAMPLES.glob("*.py") if " = fr.compare(case" in path.read_text(encoding="utf-8")]
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest()[:16] for path in sorted(names)}


def picture(name: str) -> Path:
    """The file of the picture of an example."""
    return KEPT / f"{name.replace('.', '_')}.webp"


def title(name: str) -> str:
    """The heading of a notebook, or the first line of a script."""
    text = (EXAMPLES / name).read_text(encoding="utf-8")
    if not name.endswith("ipynb"):
        return re.split(r"(?<=\?)|[:,.]", text.splitlines()[0].strip('"'))[0]
    return str(json.loads(text)["cells"][0]["source"][0]).strip("# \n")


def _of_notebook(path: Path) -> Image.Image:
    """Its last figure."""
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    NotebookClient(notebook, timeout=600, kernel_name="python3").execute()
    drawn = [
        out.data["image/png"]
        for cell in notebook.cells
        for out in cell.get("outputs", ())
        if "image/png" in out.get("data", ())
    ]
    return Image.open(io.BytesIO(base64.b64decode(drawn[-1])))


def _of_script(path: Path) -> Image.Image:
    """The last candidate of its comparison at its worst frame, coloured by the distance from the reference."""
    found = next(one for one in runpy.run_path(str(path), run_name="__main__").values() if isinstance(one, Comparison))
    shots = gallery.shots(found)
    return Image.open(io.BytesIO(gallery.draw(found.setup, found.reference.surface, shots)[-1][0]))


def main() -> None:
    """Execute and draw all of them."""
    KEPT.mkdir(exist_ok=True)
    sys.path.insert(0, str(EXAMPLES))
    known = sources()
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        for name in known:
            for script in ("own_scene.py", "own_solver.py"):
                Path(script).write_bytes((EXAMPLES / script).read_bytes())
            drawn = (_of_notebook if name.endswith("ipynb") else _of_script)(EXAMPLES / name)
            drawn.convert("RGB").save(picture(name), "WEBP", quality=80, method=6)
    FILE.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
