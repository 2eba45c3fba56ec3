"""The verb ``list``: what there is."""

import argparse
from pathlib import Path

from fem_reference import metrics, solvers
from fem_reference.cli._printing import DONE, out, write_output
from fem_reference.runs import store
from fem_reference.scenes import casefile

HELP = "what there is: cases, solvers, metrics, stored runs"


def add_options(parser: argparse.ArgumentParser) -> None:
    """It has no options of its own, and writes nothing into ``--out``."""
    parser.set_defaults(writes=False)


def run(options: argparse.Namespace) -> int:
    """Say what there is."""
    scenes = {name: casefile.read(name).title for name in casefile.cases()}
    stored = [_stored(path.parent) for path in sorted((out(options) / "runs").rglob("run.json"))]
    facts = {"cases": scenes, "solvers": solvers.names(), "metrics": metrics.names(), "runs": stored}
    width = max(map(len, scenes))
    lines = ["cases:", *(f"  {name:{width}}  {title}" for name, title in scenes.items())]
    lines += [f"solvers: {', '.join(facts['solvers'])}", f"metrics: {', '.join(facts['metrics'])}"]
    lines += ["stored runs:", *(f"  {path}" for path in stored)] if stored else []
    write_output(facts, "\n".join(lines), options)
    return DONE


def _stored(folder: Path) -> str:
    """A stored run, with its status where it did not converge."""
    status = store.status(folder)
    return str(folder) if status == "converged" else f"{folder} ({status})"
