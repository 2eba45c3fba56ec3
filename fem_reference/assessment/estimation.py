"""Errors of the estimation techniques in the report DCSE/TR-2022-03 (chapter 3, section 7.1), as records."""

from dataclasses import dataclass


@dataclass(frozen=True)
class CurveError:
    """The error of a ``technique`` that draws a curve through ``known`` points of each fibre: the rms and the maximum
    (``greatest``) distance [mm] of the other points from the curve.
    """

    case: str
    technique: str
    known: int
    rms: float
    greatest: float


@dataclass(frozen=True)
class HeightError:
    """The error of Gaussians fitted to an attached area: to the height of every second vertex above the plane of the area.

    ``centres``: the number of Gaussians. ``choice``: the method by which their positions are chosen. ``rms``: the error [mm] at the
    other vertices. ``condition``: the condition number of the matrix.
    """

    case: str
    attachment: str
    choice: str
    centres: int
    rms: float
    condition: float


@dataclass(frozen=True)
class FitError:
    """The error of a fit to a muscle's surface, with the numbers of ``gaussians`` and of ``vertices``: the rms and the maximum
    (``greatest``) distance of the vertices [mm], and the ratio of the fitted volume to the muscle's (``volume``).
    """

    case: str
    vertices: int
    gaussians: int
    rms: float
    greatest: float
    volume: float

    @property
    def fewer(self) -> float:
        """The number of values that define the vertices, divided by the number of values that define the Gaussians."""
        return 3 * self.vertices / (4 * self.gaussians)


@dataclass(frozen=True)
class DecompositionError:
    """Fibres of a ``source`` compared with the fibres of another source (``against``).

    ``median`` and ``most``: the median and the 95th percentile of the angle between the fibres [degrees]. ``length``: the ratio of
    the mean lengths. ``outside``: the fraction of points outside the muscle. ``crossings``: the number of pairs of fibres that
    cross.
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
    """The error of representing a muscle by ``rods`` of one ``radius`` [mm] along its fibres. The rods together have the volume of
    the muscle, as in ``viper`` at rest. ``filled``: the fraction of the muscle that is filled. ``outside``: the fraction of the
    rods that lies outside the muscle. ``overlap``: the fraction of the rods' total volume that is lost because rods overlap.
    """

    case: str
    rods: int
    radius: float
    filled: float
    outside: float
    overlap: float


@dataclass(frozen=True)
class AnswerChange:
    """The change of the reference's result if fibres of ``source`` replace fibres of ``against``.

    ``changes``: by ``metric.statistic``, the maximum change over the frames; empty if a solution is missing, with the reason in
    ``status``. ``bars``: the error bars of the result.
    """

    case: str
    source: str
    against: str
    status: str
    changes: dict[str, float]
    bars: dict[str, float]


@dataclass(frozen=True)
class Estimation:
    """The errors of all techniques. ``missing``: the reason for each case that was left out; ``answers``: changes, if requested."""

    curves: tuple[CurveError, ...]
    heights: tuple[HeightError, ...]
    fits: tuple[FitError, ...]
    missing: dict[str, str]
    decompositions: tuple[DecompositionError, ...] = ()
    answers: tuple[AnswerChange, ...] = ()
    rods: tuple[RodError, ...] = ()
