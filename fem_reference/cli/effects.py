"""The verb ``effects``: the change of the result due to each effect of a case, and the time that the effect costs."""

import argparse

from fem_reference.assessment.omissions import facts
from fem_reference.cli import DONE, SOLVER_FAILED, out
from fem_reference.cli._cases import asked, publish
from fem_reference.cli._parser import share
from fem_reference.report import effects_page
from fem_reference.scenes import casefile
from fem_reference.studies import omissions
from fem_reference.studies.campaign import Workers

HELP = "leave out each effect of a case in turn, measure the change and the time saved, and write the page"


def add_options(parser: argparse.ArgumentParser) -> None:
    share(parser, "case", "--set", "--name", "--workers")


def run(options: argparse.Namespace) -> int:
    """Solve a case with each optional part left out, and write the page."""
    scene = casefile.read_muscle(options.case, dict(map(casefile.setting, options.set)))
    scene = scene.model_copy(update={"choice": "listed"})  # effects that "auto" would leave out are measured too
    found = omissions.study(scene, out(options) / "runs", Workers(options.workers))
    wanted = asked("effects", scene, options, "effects")
    publish(options, wanted, effects_page.page(found), facts(found), effects_page.text(found))
    return DONE if found.ablations[0].whole.status == "converged" else SOLVER_FAILED
