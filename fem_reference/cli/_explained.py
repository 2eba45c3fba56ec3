"""Pages of the documentation that explain messages."""

import re

# Patterns of messages, each with the page that explains them; the first match counts.
PAGES = (
    ("FEniCSx is not installed", "getting_started.md"),
    ("--solver-command", "your_own_solver.md#your-solver-as-a-command"),
    ("--candidate", "your_own_solver.md"),
    (r"candidate\.toml", "your_own_solver.md"),
    (r"\.toml: (muscle\[\d+\]\.)?effect", "effects.md"),
    (r"\.toml: (muscle\[\d+\]\.)?region", "effects.md#regions"),
    (r"case\.toml: ", "scene_keys.md"),
    (": crashed, ", "your_own_solver.md#your-solver-as-a-command"),
    ("verdict: not judged", "measures.md#verdicts"),
    ("verdict: doubtful pass", "measures.md#verdicts"),
    ("verdict: inconclusive", "error_bars.md"),
    (": denied, ", "verification.md#the-second-check"),
)


def page_of(message: str) -> str:
    """The page that explains a ``message``: a path in the checkout, with the anchor of a heading; empty if no page explains it.

    >>> page_of('case.toml: effect[0].mu: got "1 mm", want a pressure')
    'docs/effects.md'
    """
    return next((f"docs/{name}" for words, name in PAGES if re.search(words, message)), "")
