"""Data set for machine learning: a folder of solved and checked muscles with error bars, hashes, splits and metadata.

dataset.json               version, splits, the SHA-256 of every other file, and scenes that were left out, with the reason
datacite.json              metadata in DataCite's schema 4.6
load.py                    a loader that needs only numpy
scenes/NAME/case.toml      the case, which ``fem-reference run scenes/NAME`` solves, and muscle.ply; shipped cases lack both
           /frames.npz     the arrays of :func:`arrays`
           /bars.json      error bars of every statistic in each frame, and doubts, such as a small det F at an attachment's rim
"""

import hashlib
import json
import logging
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from pathlib import Path

import numpy as np

from fem_reference.assessment import error_bars
from fem_reference.assessment.comparison import compare
from fem_reference.assessment.judge import doubts
from fem_reference.assessment.second_check import RECORD
from fem_reference.effects.fibre_active import FibreActive
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, connected_parts, enclosed_volume
from fem_reference.foundations.version import __version__
from fem_reference.io import files, texts
from fem_reference.runs import states
from fem_reference.runs.contents import vector_names
from fem_reference.runs.results import Results
from fem_reference.runs.states import Arrays
from fem_reference.runs.store import Run
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import fenicsx
from fem_reference.studies import dataset_loader, random_muscles, refinement
from fem_reference.studies.campaign import Workers, spread
from fem_reference.studies.execution import Bench

log = logging.getLogger(__name__)

# The version must be raised with every change to scenes or stored arrays: equal version, seed and sizes mean equal scenes.
VERSION = "1.0.0"
SHIPPED = ("hip_flexion",)  # cases with the project's own geometry, without anatomy under another licence
INDEX = "dataset.json"
_TEST = 0.25  # the fraction of poses, and of shapes, in the test part
_SAME = 0.01  # shapes are the same if lengths from volume and principal moments differ by less than this fraction of the size


@dataclass(frozen=True)
class Sizes:
    """The sizes of a data set: the number of ``muscles``, drawn at random with a ``seed``; the number of ``poses`` of each muscle
    in addition to rest; and the names of ``shipped`` cases.
    """

    muscles: int
    poses: int
    seed: int = 1
    shipped: tuple[str, ...] = SHIPPED

    @property
    def facts(self) -> dict[str, object]:
        """The version, the seed and the sizes, by which :func:`build` recognises the data set in a folder."""
        drawn = {"muscles": self.muscles, "poses": self.poses, "seed": self.seed, "shipped": list(self.shipped)}
        return {"version": VERSION, **drawn}


def build(folder: Path, wanted: Sizes, store: Path, workers: Workers) -> dict[str, object]:
    """Make the data set in a ``folder``, with runs in ``store``, and return the index of the data set.

    An interrupted build continues from the stored runs. Raises InputError if the folder contains another data set or other files,
    or if no scene passes its checks.
    """
    place = folder / INDEX
    if place.exists() and (known := texts.read_json(place, "the index of a data set"))["wanted"] != wanted.facts:
        raise InputError(place, f"the data set {known['wanted']}", f"another folder for {wanted.facts}")
    if folder.exists() and any(folder.iterdir()) and not (folder / "scenes").is_dir():
        raise InputError(folder, "a folder with other files", "a new folder, or that of a data set")
    names = [*wanted.shipped, *(f"muscle_{i:04d}" for i in range(wanted.muscles))]
    files.make_folder(folder / "scenes")
    left = spread(partial(_scene, folder.absolute(), wanted, store.absolute()), names, workers)
    reasons = {name: why for name, why in zip(names, left, strict=True) if why}
    kept = [name for name in names if name not in reasons]
    if not kept:
        raise InputError(folder, f"no scene that passes: {reasons}", "at least one")
    # An interrupted build with other sizes may have left scenes behind.
    for other in {path.name for path in (folder / "scenes").iterdir()} - {*kept}:
        shutil.rmtree(folder / "scenes" / other)
    files.write_text(folder / "load.py", Path(dataset_loader.__file__).read_text(encoding="utf-8"))
    found = {name: states.read_arrays(folder / "scenes" / name / "frames.npz") for name in kept}
    count = sum(len(one["frames"]) for one in found.values())
    files.write_text(folder / "datacite.json", json.dumps(metadata(wanted, len(kept), count), indent=1))
    index = {"wanted": wanted.facts, "fem_reference": __version__, "scenes": len(kept), "frames": count}
    index |= {"left_out": reasons, "left_out_share": len(reasons) / len(names)}
    index |= {"splits": splits(found, wanted.seed), "sha256": hashes(folder)}
    files.write_text(place, json.dumps(index, indent=1))
    return index


def hashes(folder: Path) -> dict[str, str]:
    """The SHA-256 of every file of the data set by name, except the index, hidden (half-written) files and caches."""
    paths = (one for one in sorted(folder.rglob("*")) if one.is_file() and one.name != INDEX)
    names = ((one.relative_to(folder), one) for one in paths)
    shown = {str(name): one for name, one in names if not any(part.startswith((".", "__")) for part in name.parts)}
    return {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in shown.items()}


def _scene(folder: Path, wanted: Sizes, store: Path, name: str) -> str:
    """Make the scene ``name`` of a data set and return "". If the scene is left out, remove its folder and return the reason."""
    place = folder / "scenes" / name
    try:
        if name in wanted.shipped:
            case = casefile.read_muscle(name, {"reference.store_state": True})
            if case.needed_data:
                raise InputError(name, "anatomy with its own licence", "a case with the project's own geometry")
            files.make_folder(place)
        else:
            case = random_muscles.write(place, wanted.seed, int(name.split("_")[1]), wanted.poses)
        with fenicsx.shared():
            bench = Bench(case, store, 1)
            run = bench.reference()
            bars = refinement.bars(bench, run, model=False)
        why = unfit(bench, run, bars)
        if not why and bars is not None and run.folder is not None:
            with files.whole(place / "frames.npz") as part:
                np.savez_compressed(part, allow_pickle=False, **arrays(bench, run))
            table = {"frames": run.numbers, "bars": bars.bars, "doubts": doubts(run)}
            files.write_text(place / "bars.json", json.dumps(texts.plain(table), allow_nan=False))
    except InputError as error:
        why = str(error)
    if why:
        log.info("%s is left out: %s", name, why)
        shutil.rmtree(place, ignore_errors=True)
    return why


def unfit(bench: Bench[MuscleCase], run: Run, bars: error_bars.ErrorBars | None) -> str:
    """The reason why a ``run`` is unfit as training data; empty if the run passes all checks."""
    case = bench.scene
    checks = run.origin.get(RECORD, {}).get("checks", [])
    if run.outcome.status != "converged" or run.numbers != case.numbers:
        return f"{run.outcome.status}: {run.outcome.message}"
    if not checks or not all(one["met"] for one in checks):
        return "no second check that passes"
    known = None if bars is None else bars.find("deviation", "surface_deviation", "rms")
    if bars is None or known is None or not np.isfinite(known.values).all():
        return "no error bar"
    result = compare(case, bench.setup(), run, (), bars)
    own = [one for one in result.verdicts if one.expectation.of == "reference"]
    # A small det F at the singular rim of an attachment does not make a run unfit, as error bars include its effect.
    others = {key: values for key, values in run.scalars.items() if not key.startswith("min_det_F")}
    said = [f"{one.expectation.metric} {one.word}" for one in own if one.word != "pass"]
    return "; ".join([*doubts(replace(run, scalars=others)), *said]) or ("" if own else "it has no expectations")


def arrays(bench: Bench[MuscleCase], run: Run) -> Arrays:
    """Arrays of a ``run`` by name.

    Motion: ``frames`` (f,), ``bones`` (b,), ``poses`` (f, b, 4, 4), ``activation`` (f,). At rest [mm]: the surface's ``points``
    (n, 3) and ``triangles``, the mesh's ``tet_points`` (k, 3) and ``tets`` (t, 4), ``fibre_points`` (m, 3) and ``fibre_offsets``;
    ``fibre`` (t, 3) is the fibre direction in each tetrahedron. In each frame [mm]: ``positions`` (f, n, 3), ``fibre_positions``
    (f, m, 3) and ``tet_positions`` (f, k, 3). Cauchy ``stress`` (f, t, 3, 3) [MPa] is evaluated at the centroids of tetrahedra.
    ``forces`` and ``moments`` (f, b, 3) [N, N mm] act on bones, and are NaN if unknown. ``surface_bar`` (f,) [mm] is the error bar
    of the surface's rms deviation.
    """
    assert run.fibres is not None
    assert run.fibre_positions is not None
    bones, bars = bench.setup().bones, refinement.stored(run)
    active = [one for one in bench.scene.effects if isinstance(one, FibreActive)]
    bar = None if bars is None else bars.find("deviation", "surface_deviation", "rms")
    lost = np.full((len(run.numbers), 3), np.nan)
    known = vector_names(run.scalars, "force_on_")
    return {
        "frames": np.array(run.numbers),
        "bones": np.array([bone.name for bone in bones]),
        "poses": np.array([[bone.pose(number) for bone in bones] for number in run.numbers]),
        "activation": np.array([sum(one.amount(number) for one in active) for number in run.numbers], float),
        "points": run.surface.points,
        "triangles": run.surface.triangles,
        "fibre_points": run.fibres.points,
        "fibre_offsets": run.fibres.offsets,
        "positions": run.positions,
        "fibre_positions": run.fibre_positions,
        "forces": np.stack([run.force(one.name) if one.name in known else lost for one in bones], axis=1),
        "moments": np.stack([run.moment(one.name) if one.name in known else lost for one in bones], axis=1),
        "surface_bar": lost[:, 0] if bar is None else bar.values,
    } | _inside(run, bench.scene)


def _inside(run: Run, case: MuscleCase) -> Arrays:
    """The arrays that describe the tetrahedra at rest and in each frame."""
    assert run.folder is not None  # it is in the store
    mesh, fibre = states.read_rest(run.folder)
    results = Results(mesh, case.effects, states.StoredStates(run.folder, run.numbers), fibre)
    tets, middle = np.arange(len(mesh.tets)), np.full((len(mesh.tets), 4), 0.25)
    moved, stress = np.tile(mesh.points, (len(run.numbers), 1, 1)), []
    for row, number in enumerate(run.numbers):
        stress.append(results.evaluate_in(tets, middle, number, ["cauchy_stress"])["cauchy_stress"])
        moved[row, mesh.tets] = mesh.points[mesh.tets] + results.states[number].displacement[:, :4]
    return {
        "tet_points": mesh.points,
        "tets": mesh.tets,
        "fibre": np.zeros((0, 3)) if fibre is None else fibre,
        "tet_positions": moved,
        "stress": np.array(stress, np.float32),
    }


def splits(found: dict[str, Arrays], seed: int) -> dict[str, dict[str, dict[str, list[int]]]]:
    """Indices of frames by scene, for the parts ``train`` and ``test`` of two splits.

    ``pose``: frames of a scene with equal poses and activation are in the same part, and rest is in ``train``. ``shape``: all
    scenes with the same shape of muscle are in the same part.
    """
    rng, names = np.random.default_rng(seed), list(found)
    parts: dict[str, dict[str, dict[str, list[int]]]] = {key: {"train": {}, "test": {}} for key in ("pose", "shape")}
    for name in names:
        groups = _same_poses(found[name])
        test = set(rng.permutation(np.arange(1, groups.max() + 1))[: round(_TEST * groups.max())].tolist())
        for part, inside in (("train", False), ("test", True)):
            parts["pose"][part][name] = [row for row, group in enumerate(groups) if (group in test) is inside]
    groups = _same_shapes([found[name]["points"] for name in names], [found[name]["triangles"] for name in names])
    count = len(set(groups.tolist()))
    test = set(rng.permutation(np.unique(groups))[: round(_TEST * count)].tolist())
    for name, group in zip(names, groups, strict=True):
        parts["shape"]["test" if group in test else "train"][name] = list(range(len(found[name]["frames"])))
    return parts


def _same_poses(one: Arrays) -> Ints:
    """The group (f,) of each frame, 0 for the first frame. Frames of a group have equal poses of all bones and equal activation."""
    count = len(one["frames"])
    at = np.concatenate([one["poses"].reshape(count, -1), one["activation"].reshape(count, 1)], axis=1).round(6)
    seen: dict[bytes, int] = {}
    return np.array([seen.setdefault((row + 0.0).tobytes(), len(seen)) for row in at])


def _same_shapes(points: Sequence[Floats], triangles: Sequence[Ints]) -> Ints:
    """The group of each surface. Surfaces of a group have equal volumes and principal moments, in any position and orientation."""
    measures = []
    for at, faces in zip(points, triangles, strict=True):
        spread_out = np.linalg.eigvalsh(np.cov((at[faces].mean(axis=1)).T))
        measures.append([enclosed_volume(at, faces) ** (1 / 3), *np.sqrt(np.maximum(spread_out, 0))])
    size = np.array(measures)
    near = [
        (i, j) for i, j in combinations(range(len(size)), 2) if (np.abs(size[i] - size[j]) < _SAME * size[i, 0]).all()
    ]
    pairs = np.array(near, int).reshape(-1, 2)
    return connected_parts(pairs[:, 0], pairs[:, 1], len(size))


def metadata(wanted: Sizes, scenes: int, frames: int) -> dict[str, object]:
    """Metadata of a data set in DataCite's schema 4.6, without a DOI, which the publisher adds."""
    found: dict[str, object] = texts.read_json(Path(__file__).with_name("datacite.json"), "metadata")
    about = f"{frames} states of {scenes} muscles {found.pop('about')}"
    own = {"alternateIdentifier": json.dumps(wanted.facts), "alternateIdentifierType": "version, seed and sizes"}
    found |= {"version": VERSION, "alternateIdentifiers": [own]}
    return found | {"descriptions": [{"description": about, "descriptionType": "Abstract"}]}
