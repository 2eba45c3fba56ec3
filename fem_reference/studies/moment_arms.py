"""Hip moment arms of the reference's fibres, on coarse meshes of the report's anatomy, compared with published ones."""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem_reference.assessment import experiments
from fem_reference.assessment.moment_arms import ArmRange, ArmsBeside, fitted_arms, poses, range_of
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.metrics import context_of
from fem_reference.metrics.fibre_length import both_lengths
from fem_reference.runs.store import Run
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import Keyframe, MuscleCase
from fem_reference.studies.campaign import each
from fem_reference.studies.execution import Bench

LARGER = 1.25  # a second run with tetrahedra larger by this factor shows the dependence of moment arms on the mesh
_EVERY, _RAD = 10, 100  # differences of frame numbers: between successive frames, and over a rotation by 1 rad
NEMETH, BLEMKER = "nemeth_1985", "blemker_delp_2005"
# Ranges of flexion [rad]: that of the shipped cases, and about -10 to 90 degrees; a run that fails to converge ends earlier.
SHIPPED, WIDE = (0.0, 1.0), (-0.2, 1.6)
_FARTHEST = 1.0  # the flexion [rad] that a run must reach


@dataclass(frozen=True)
class ArmStudy:
    """A ``case``, the size of its tetrahedra [mm], the minimum and maximum ``flexion`` [rad], the name of its ``muscle`` in
    published files, the ``sense`` of positive moment arms, and the ``experiments`` with which the moment arms are compared.
    """

    case: str
    tet_size: float
    flexion: tuple[float, float]
    muscle: str
    sense: str
    experiments: tuple[str, ...]


STUDIES = (
    ArmStudy("gluteus_maximus", 11.2, SHIPPED, "gluteus_maximus", "extension", (NEMETH, BLEMKER)),
    ArmStudy("gluteus_maximus_anatomical", 14.0, WIDE, "gluteus_maximus", "extension", (NEMETH, BLEMKER)),
    ArmStudy("gluteus_maximus_tract", 14.0, SHIPPED, "gluteus_maximus", "extension", (NEMETH, BLEMKER)),
    ArmStudy("iliacus_anatomical", 7.0, WIDE, "iliacus", "flexion", (BLEMKER,)),
    ArmStudy("iliacus_in_situ", 7.0, WIDE, "iliacus", "flexion", (BLEMKER,)),
)


def beside(store: Path) -> tuple[tuple[ArmsBeside, ...], dict[str, str]]:
    """The moment arms of all ``STUDIES`` compared with their experiments, and the reasons why cases are missing, by case."""
    found, missing = each({one.case: one for one in STUDIES}, lambda one: list(of_case(one, store)))
    return tuple(one for several in found.values() for one in several), missing


def of_case(wanted: ArmStudy, store: Path) -> Iterator[ArmsBeside]:
    """Compare the moment arms of a case with each of its experiments, up to the last angle that the reference reaches. Raises
    InputError if this angle is below 1 rad.
    """
    scene = casefile.read_muscle(wanted.case)
    (angles, arms), (others, larger) = (_arms(wanted, size * wanted.tet_size, store) for size in (1.0, LARGER))
    common = min(len(angles), len(others))  # both runs begin at the same angle
    coarser = larger.mean(axis=1)[:common] - arms.mean(axis=1)[:common]
    reached = f"{angles[0]:g} to {angles[-1]:g} degrees"
    setting, records = f"{wanted.tet_size:g} mm tetrahedra, not refined, {reached}", experiments.experiments()
    for name in wanted.experiments:
        yield ArmsBeside(
            *(wanted.case, wanted.muscle, wanted.sense, name, setting),
            found=range_of(angles, arms),
            middle=arms.mean(axis=1),
            published=published(scene, name, wanted.muscle).at(angles),
            coarser=float(np.abs(coarser).max()),
            kind=records[name].kind,
        )


def _arms(wanted: ArmStudy, tet_size: float, store: Path) -> tuple[Floats, Floats]:
    """Angles (a,) [deg], and moment arms (a, k) [mm] that are positive in the wanted sense, on tetrahedra of ``tet_size`` [mm]."""
    bench = Bench(coarse(casefile.read_muscle(wanted.case), tet_size, wanted.flexion), store)
    run = bench.reference()
    if run.outcome.status == "denied" or run.numbers[-1] / _RAD + 2 * wanted.flexion[0] < _FARTHEST:
        raise InputError(wanted.case, run.outcome.message, f"a reference that reaches a flexion of {_FARTHEST:g} rad")
    angles, arms = flexion_arms(run, bench)
    return angles, arms if wanted.sense == "flexion" else -arms


def coarse(scene: MuscleCase, tet_size: float, flexion: tuple[float, float]) -> MuscleCase:
    """The case on unrefined tetrahedra of ``tet_size`` [mm], without candidates. The hip moves from rest to the minimum ``flexion``
    [rad], which is at most 0, and then to the maximum.
    """
    back, on = (round(_RAD * angle) for angle in flexion)
    turned = {0: 0.0, -back: back / _RAD, on - 2 * back: on / _RAD}  # frame numbers and flexion
    keys = tuple(Keyframe.model_validate({"frame": at, "angle": f"{-angle} rad"}) for at, angle in turned.items())
    bones = tuple(
        bone.model_copy(update={"motion": bone.motion.model_copy(update={"keyframes": keys})}) if bone.motion else bone
        for bone in scene.bone
    )
    muscle = scene.muscle.model_copy(update={"tet_size": tet_size, "refinements": 0})
    frames = scene.frames.model_copy(update={"last": on - 2 * back, "every": _EVERY})
    changes = {"muscle": muscle, "frames": frames, "bone": bones, "expect": (), "candidate": ()}
    return scene.model_copy(update=changes | {"negative_control": None, "quick": {}})


def flexion_arms(run: Run, bench: Bench[MuscleCase]) -> tuple[Floats, Floats]:
    """Flexion angles (a,) [deg] and flexion moment arms (a, k) [mm]. The axis of the joint points to the left, so flexion is the
    negative joint angle.
    """
    context = context_of(bench.setup(), run)
    if len(context.joints) != 1:
        raise InputError(bench.scene.name, f"{len(context.joints)} joints", "one joint")
    flexion = -np.degrees(context.joints[0].angles(run.numbers))
    at = poses(flexion)
    return at, fitted_arms(flexion, both_lengths(run, run, context)[0], at)


def published(scene: MuscleCase, experiment: str, muscle: str) -> ArmRange:
    """Read the published curve or range of moment arms of a ``muscle`` from its file in the data folder."""
    record = experiments.experiments()[experiment]
    path = scene.file(f"data:{record.file}", experiment)
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file, strict=True))
    try:
        if not rows:
            raise ValueError("no row")
        if experiment != NEMETH:
            return _envelope(rows, muscle)
        columns = ("hip_flexion_deg", "extension_moment_arm_mm")
        angles, arms = (np.array([float(row[key]) for row in rows]) for key in columns)
        return ArmRange(angles, arms, arms)
    except (KeyError, ValueError) as error:
        raise InputError(str(path), repr(error), "numeric columns of angles and moment arms") from None


def _envelope(rows: list[dict[str, str]], muscle: str) -> ArmRange:
    """The range [mm] of moment arms in the ``rows`` of a file, which are in cm. Its angles are those of the lower and of the upper
    bound, as far as both bounds cover them.
    """
    sides = {}
    for bound in ("lower", "upper"):
        side = [row for row in rows if (row["muscle"], row["bound"]) == (muscle, bound)]
        sides[bound] = np.array(sorted((float(row["angle_deg"]), 10 * float(row["moment_arm_cm"])) for row in side)).T
    (low_at, low), (high_at, high) = sides["lower"], sides["upper"]
    angles = np.unique(np.concatenate([low_at, high_at]))
    angles = angles[(angles >= max(low_at[0], high_at[0])) & (angles <= min(low_at[-1], high_at[-1]))]
    return ArmRange(angles, np.interp(angles, low_at, low), np.interp(angles, high_at, high))
