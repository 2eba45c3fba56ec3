"""The command line as a parser."""

import argparse
from collections.abc import Callable
from pathlib import Path

from fem_reference import __version__
from fem_reference.cli import benchmark, check, export, recommend, scalar, study, verbs


def parser() -> argparse.ArgumentParser:
    """The parser of the whole command line; each verb is what its option ``verb`` calls."""
    whole = argparse.ArgumentParser(
        prog="fem-reference", description="Finite element reference and validation for muscle deformation."
    )
    whole.add_argument("--version", action="version", version=f"fem-reference {__version__}")
    kinds = whole.add_subparsers(metavar="VERB", required=True)

    def add(
        name: str, verb: Callable[[argparse.Namespace], int], text: str, *, case: bool = True
    ) -> argparse.ArgumentParser:
        sub = kinds.add_parser(name, help=text, description=text)
        if case:
            sub.add_argument("case", metavar="CASE", help="a shipped case (see list), a case folder or a case.toml")
            change = "change a key of the case, such as muscle.tet_size='8 mm'; may be repeated"
            sub.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help=change)
        sub.add_argument("--out", type=Path, metavar="DIR", help="where pages and stored runs go (default: reports)")
        sub.add_argument("--json", type=Path, metavar="FILE", help="write what is printed as JSON")
        sub.add_argument("--quiet", action="store_true", help="show no progress")
        sub.set_defaults(verb=verb, ranks=None, error_bar=False)
        return sub

    demo = add(
        "demo", verbs.demo, f"the main job: the case {verbs.MAIN_JOB}, its reference against its candidates", case=False
    )
    run = add("run", verbs.run, "solve a case and judge what it expects of the reference")
    run.add_argument("--solver", metavar="NAME", help="another solver than the case's own reference")
    unit = "unit of length of the frames in DIR (default: that of its candidate.toml, else mm)"
    comparison = add("compare", verbs.compare, "measure candidates against the reference and write the page")
    comparison.add_argument(
        "--candidate",
        action="append",
        metavar="NAME|DIR",
        help="a candidate of the case or a folder of frames; may be repeated",
    )
    comparison.add_argument("--unit", help=unit)
    checking = add("check", check.check, "judge a candidate by its own past and by the reference, for a pipeline")
    check.add_options(checking, unit)
    for judging in (run, comparison, checking):
        known = "how well the reference is known: solve it on larger tetrahedra too, and with stiffer contact where bones press"
        judging.add_argument("--error-bar", action="store_true", help=known)
    for solving in (demo, run, comparison, checking):
        ranks = "MPI processes of the reference (default: 1, or 2 for large bodies where cores are free)"
        solving.add_argument("--ranks", type=int, metavar="N", help=ranks)
    page = add("page", verbs.page, "write a page over several cases", case=False)
    _add_page_options(page, unit)
    speed = "time the solvers of Table 5.1 in processor time, beside the machine's own speed, or the reference by phase"
    benchmark.add_options(add("benchmark", benchmark.benchmark, speed, case=False))
    costs = "what accuracy costs in time: reference and candidates over ladders of settings, and the page"
    study.add_options(add("study", study.study, costs, case=False))
    advice = "which solver and setting to take for an error or a time, out of what studies measured"
    recommend.add_options(add("recommend", recommend.advise, advice))
    catalogue = add("verify", verbs.verify, "measure problems whose answers are known and write the page", case=False)
    known = "an entry, a family or a shell pattern of them (default: all)"
    catalogue.add_argument("names", metavar="NAME", nargs="*", help=known)
    control = "measure this entry with its one thing wrong, named or not: it must fail; may be repeated"
    catalogue.add_argument("--negative-control", action="append", default=[], metavar="NAME", help=control)
    add("list", verbs.list_all, "what there is: cases, solvers, metrics, stored runs", case=False)
    exporting = add("export", export.export, "write all that a solver needs which is not ours, in open formats")
    export.add_options(exporting)
    add("show", verbs.show, "what a case is made of; with --out also its meshes for ParaView")
    return whole


def _add_page_options(page: argparse.ArgumentParser, unit: str) -> None:
    names = sorted([*scalar.PAGES, verbs.TABLE, verbs.CLAIMS])
    page.add_argument("name", metavar="NAME", choices=names, help=f"one of {', '.join(names)}")
    some = f"for {verbs.TABLE} and {verbs.CLAIMS}: this case, not all of them; may be repeated"
    page.add_argument("--case", action="append", default=[], metavar="CASE", help=some)
    foreign = f"for {verbs.TABLE}: frames that your solver made of a case; may be repeated"
    page.add_argument("--candidate", action="append", default=[], metavar="CASE=DIR", help=foreign)
    page.add_argument("--unit", help=unit)
