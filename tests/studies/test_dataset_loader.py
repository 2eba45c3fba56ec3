"""The loader of a data set: short, and numpy alone; ``test_dataset`` loads with it."""

import ast
from pathlib import Path

from fem_reference.studies import dataset_loader


def test_it_is_short_and_needs_numpy_alone() -> None:
    text = Path(dataset_loader.__file__).read_text(encoding="utf-8")
    assert len([line for line in text.splitlines() if line.strip()]) <= 20
    imported = {
        (node.module or "") if isinstance(node, ast.ImportFrom) else node.names[0].name
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Import | ast.ImportFrom)
    }
    assert imported == {"hashlib", "json", "pathlib", "numpy"}
