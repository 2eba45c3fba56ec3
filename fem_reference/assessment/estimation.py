"""Errors of the report's estimation techniques (chapter 3, section 7.1), as records."""

from dataclasses import dataclass


@dataclass(frozen=True)
class CurveError:
    """A ``technique`` through ``known`` points of each fibre: distances [mm] of other points from its curve, rms and maximum."""

    case: str
    technique: str
    known: int
    rms: float
    greatest: float


@dataclass(frozen=True)
class HeightError:
    """A fit by Gaussians to the heights, above its plane, of every second vertex of an attached area: the number of ``centres``,
    the ``choice`` of their positions, the rms error [mm] at the other vertices, and the ``condition`` number of the matrix.
    """

    case: str
    attachment: str
    choice: str
    centres: int
    rms: float
    condition: float


@dataclass(frozen=True)
class FitError:
    """A muscle's surface of ``vertices`` fitted by ``gaussians``: rms and maximum distance of vertices [mm], ratio of volumes."""

    case: str
    vertices: int
    gaussians: int
    rms: float
    greatest: float
    volume: float

    @property
    def fewer(self) -> float:
        """The ratio of the count of numbers that define the vertices to the count that define the Gaussians."""
        return 3 * self.vertices / (4 * self.gaussians)


@dataclass(frozen=True)
class DecompositionError:
    """Fibres of a ``source`` compared with the fibres of ``against``: the angle between them [degrees], median and 95th percentile,
    the ratio of their mean lengths, the fraction of points ``outside`` the muscle, and the number of pairs of fibres that cross.
    """

    case: str
    source: str
    against: str
    median: float
    most: float
    length: float
    outside: float
    crossings: int


@dataclass(frozen=True)
class RodError:
    """A muscle as ``rods`` of one ``radius`` [mm] along its fibres, with the muscle's volume in total, as in ``viper`` at rest: the
    fraction of the muscle that is ``filled``, and the fractions of the rods that are ``outside`` it or ``overlap``.
    """

    case: str
    rods: int
    radius: float
    filled: float
    outside: float
    overlap: float


@dataclass(frozen=True)
class AnswerChange:
    """The change of the reference's result with fibres of a ``source`` instead of ``against``: the maximum change over the frames
    by ``metric.statistic``, empty if a solution is missing (``status``); ``bars``: the error bars of the result.
    """

    case: str
    source: str
    against: str
    status: str
    changes: dict[str, float]
    bars: dict[str, float]


@dataclass(frozen=True)
class Estimation:
    """The errors of all techniques; ``missing``: by case, the reason for its omission; ``answers``, if requested."""

    curves: tuple[CurveError, ...]
    heights: tuple[HeightError, ...]
    fits: tuple[FitError, ...]
    missing: dict[str, str]
    decompositions: tuple[DecompositionError, ...] = ()
    answers: tuple[AnswerChange, ...] = ()
    rods: tuple[RodError, ...] = ()
