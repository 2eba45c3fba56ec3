"""Shortest paths around several smooth obstacles: straight pieces and geodesics in turn, joined without kinks.

A taut string shows approximately where a path touches which obstacles. Newton's method then finds the first point, direction and
length of each geodesic for which all pieces join smoothly (Scholz et al. 2016, Multibody Syst. Dyn. 36, 195-219, DOI
10.1007/s11044-015-9451-1). A path is a local minimum of length near the straight path, and touches each obstacle at most once.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.geometry.obstacles import Quadric, SmoothSurface, Touch
from fem_reference.geometry.taut_strings import MOST, Flags, halved, longest, met, taut, touching

# The number of steps of a geodesic. The error at its end is about (length / radius)^5 / (120 _STEPS^4) times the radius, or
# 2e-7 of the radius for half a turn.
_STEPS = 60
# The maximum number of Newton iterations; their tolerance, as a fraction of the distance between the ends plus the lengths of the
# geodesics; and the finite-difference step.
_ITERATIONS, _SMALL, _STEP = 40, 1e-11, 1e-6
# The number of points at which a path is checked for crossing an obstacle, in addition to the deepest points of its chords.
_CHECKED = 200


@dataclass(frozen=True, eq=False)
class Winding:
    """n paths through K ``knots`` (n, K, 3) [mm], with unit ``tangents`` (n, K, 3) and arc lengths ``arcs`` (n, K) [mm].

    Each path passes the obstacles ``met`` (n, m) in this order, with the same number of knots on each. If it passes fewer than m
    obstacles, the remaining knots are at its end. ``failed`` (n,) is True where no valid path was found.
    """

    knots: Floats
    tangents: Floats
    arcs: Floats
    met: Ints
    failed: Flags

    @classmethod
    def straight(cls, count: int, starts: Floats, ends: Floats) -> "Winding":
        """Create straight paths that have enough knots for ``count`` obstacles."""
        away = np.linalg.norm(ends - starts, axis=1)
        along = (ends - starts) / np.where(away > 0, away, 1.0)[:, None]
        size = 2 + count * (_STEPS + 1)
        knots, tangents, arcs = (np.repeat(one[:, None], size, axis=1) for one in (ends, along, away))
        knots[:, 0], arcs[:, 0] = starts, 0.0
        return cls(knots, tangents, arcs, np.zeros((len(starts), count), np.int64), np.zeros(len(starts), bool))

    def put(self, pattern: tuple[int, ...], which: Ints, pieces: "_Pieces", same: Ints) -> None:
        """Store rows ``same`` of ``pieces``, which are geodesics on the obstacles in ``pattern``, as the paths ``which``."""
        size = _STEPS + 1
        steps = np.zeros((len(which), self.knots.shape[1] - 1))
        for i, (points, tangents) in enumerate(pieces.run()):
            on = slice(1 + i * size, 1 + (i + 1) * size)
            self.knots[which, on] = points[:, same].swapaxes(0, 1)
            self.tangents[which, on] = tangents[:, same].swapaxes(0, 1)
            steps[:, on.start : on.stop - 1] = pieces.sizes[i, same, None] / _STEPS
        for i in range(len(pattern) + 1):  # straight pieces
            gap = self.knots[which, i * size + 1] - self.knots[which, i * size]
            steps[:, i * size] = np.linalg.norm(gap, axis=1)
        self.tangents[which, 0] = self.tangents[which, 1]
        self.tangents[which, len(pattern) * size + 1 :] = self.tangents[which, len(pattern) * size, None]
        self.arcs[which] = np.cumsum(np.hstack([np.zeros((len(which), 1)), steps]), axis=1)
        self.met[which, : len(pattern)] = pattern

    @property
    def lengths(self) -> Floats:
        """Length (n,) [mm] of each path."""
        return self.arcs[:, -1]

    def directions(self) -> tuple[Floats, Floats]:
        """Return the unit vectors (n, 3) along the paths at their starts and at their ends."""
        return self.tangents[:, 0], self.tangents[:, -1]

    def touching(self) -> list[Touch]:
        """Return the contacts with the first, second, ... obstacle of each path."""
        size, found = _STEPS + 1, []
        for i in range(self.met.shape[1]):
            one, other = 1 + i * size, (i + 1) * size
            knots, tangents = self.knots, self.tangents
            found.append(Touch(self.met[:, i], knots[:, one], tangents[:, one], knots[:, other], tangents[:, other]))
        return found

    def at(self, which: Ints, shares: Floats) -> Floats:
        """Points (m, 3) of the paths ``which`` (m,) at the fractions ``shares`` (m,) of their lengths, by cubics between knots."""
        wanted = shares * self.lengths[which]
        low = np.clip((self.arcs[which] <= wanted[:, None]).sum(axis=1) - 1, 0, self.arcs.shape[1] - 2)
        span = self.arcs[which, low + 1] - self.arcs[which, low]
        u = ((wanted - self.arcs[which, low]) / np.where(span > 0, span, 1.0))[:, None]
        one, other = self.knots[which, low], self.knots[which, low + 1]
        first, last = (span[:, None] * self.tangents[which, low + i] for i in (0, 1))
        near, far = (1 + 2 * u) * (1 - u) ** 2, u**2 * (3 - 2 * u)
        return np.asarray(near * one + far * other + u * (1 - u) * ((1 - u) * first - u * last))


@dataclass(eq=False)
class _Pieces:
    """Geodesics on the m ``obstacles`` that n paths touch in this order. ``points`` (m, n, 3): their first points; ``along``
    (m, n, 3): their directions there; ``sizes`` (m, n) [mm]: their lengths.
    """

    obstacles: list[SmoothSurface]
    starts: Floats
    ends: Floats
    points: Floats
    along: Floats
    sizes: Floats

    def run(self) -> list[tuple[Floats, Floats]]:
        """Return the points and the unit tangents (steps + 1, n, 3) of each geodesic."""
        parts = zip(self.obstacles, self.points, self.along, self.sizes, strict=True)
        return [_geodesic(*part) for part in parts]

    def kinks(self) -> Floats:
        """Distances (n, 4 m) [mm] of straight pieces from the tangents at both ends of each geodesic, along normal and binormal."""
        runs, found = self.run(), []
        before = [self.starts, *(points[-1] for points, _ in runs)]
        after = [*(points[0] for points, _ in runs[1:]), self.ends]
        for obstacle, (points, tangents), one, other in zip(self.obstacles, runs, before, after, strict=False):
            for i, straight in ((0, points[0] - one), (-1, other - points[-1])):
                normal = _units(obstacle.level(points[i])[1])
                binormal = np.cross(normal, tangents[i])
                found += [np.vecdot(straight, normal), np.vecdot(straight, binormal)]
        return np.stack(found, axis=1)

    def rows(self, which: Ints) -> "_Pieces":
        """Return the geodesics of the paths ``which``."""
        parts = (values[:, which] for values in (self.points, self.along, self.sizes))
        return _Pieces(self.obstacles, self.starts[which], self.ends[which], *parts)

    def pressed(self) -> Flags:
        """Mask (m, n) of geodesics that tension presses onto the obstacle: the surface is convex along them at their midpoints."""
        middles = [(points[_STEPS // 2], tangents[_STEPS // 2]) for points, tangents in self.run()]
        return np.array([one.bending(*at) > 0 for one, at in zip(self.obstacles, middles, strict=True)])

    def moved(self, change: Floats) -> "_Pieces":
        """Change the geodesics by ``change`` (n, 4 m): the start, along and across [mm], the direction [rad], the length [mm]."""
        points, along, sizes = [], [], []
        for i, obstacle in enumerate(self.obstacles):
            ahead, aside, turn, longer = (change[:, 4 * i + k] for k in range(4))
            binormal = np.cross(_units(obstacle.level(self.points[i])[1]), self.along[i])
            point = self.points[i] + ahead[:, None] * self.along[i] + aside[:, None] * binormal
            for _ in range(3):  # back to the surface
                value, slope = obstacle.level(point)
                point = point - (value / np.vecdot(slope, slope))[:, None] * slope
            direction = np.cos(turn)[:, None] * self.along[i] + np.sin(turn)[:, None] * binormal
            points.append(point)
            along.append(_tangent(direction, obstacle.level(point)[1]))
            sizes.append(self.sizes[i] + longer)
        return _Pieces(self.obstacles, self.starts, self.ends, np.array(points), np.array(along), np.array(sizes))


@np.errstate(all="ignore")  # a path with NaN counts as failed
def around(obstacles: Sequence[SmoothSurface], starts: Floats, ends: Floats) -> Winding:
    """Find the shortest paths from ``starts`` (n, 3) to ``ends`` (n, 3) [mm] around ``obstacles``, which contain neither end."""
    string = taut(obstacles, starts, ends)
    turns = met(obstacles, string)
    found = Winding.straight(len(obstacles), starts, ends)
    todo = [(pattern, np.flatnonzero([one == pattern for one in turns])) for pattern in sorted(set(turns))]
    while todo:
        pattern, which = todo.pop()
        if not pattern:
            continue
        pieces, smooth = _solved(_guess([(j, obstacles[j]) for j in pattern], string[which]))
        short = (pieces.sizes <= 0) | ~pieces.pressed()  # (m, n): the path does not touch the obstacle
        for left_out in {tuple(column) for column in short.T.tolist()}:
            same = np.flatnonzero(np.all(np.array(left_out) == short.T, axis=1))
            if any(left_out):
                rest = tuple(j for j, out in zip(pattern, left_out, strict=True) if not out)
                todo.append((rest, which[same]))
            else:
                found.put(pattern, which[same], pieces, same)
                found.failed[which[same]] = ~smooth[same]
    found.failed[:] |= _wrong(obstacles, found, string) | (string.shape[1] > MOST)
    return found


def _wrong(obstacles: Sequence[SmoothSurface], found: Winding, string: Floats) -> Flags:
    """Mask (n,) of paths that cross an obstacle, or are more than 2 % longer than the string, whose chords cut curves short."""
    count = len(string)
    even = np.broadcast_to(np.linspace(0, 1, _CHECKED), (count, _CHECKED))
    shares = np.stack([*even.T, *(_deepest(one, found) for one in obstacles if isinstance(one, Quadric))], axis=1)
    points = found.at(np.repeat(np.arange(count), shares.shape[1]), shares.ravel())
    wrong = ~(found.lengths <= 1.02 * np.linalg.norm(np.diff(string, axis=1), axis=2).sum(axis=1))
    for obstacle in obstacles:
        value, slope = obstacle.level(points)
        away = value / np.maximum(np.linalg.norm(slope, axis=1), 1e-12)
        wrong |= ~(away >= -1e-4 * obstacle.bend).reshape(shares.shape).all(axis=1)
    return wrong


def _deepest(obstacle: Quadric, found: Winding) -> Floats:
    """Positions (n,), as fractions of the paths' lengths, at which their chords are deepest in an obstacle, even a small one."""
    begins, ends = found.knots[:, :-1], found.knots[:, 1:]
    at = obstacle.deepest(begins, ends)
    values = obstacle.level((begins + at[:, :, None] * (ends - begins)).reshape(-1, 3))[0].reshape(at.shape)
    rows, chords = np.arange(len(at)), values.argmin(axis=1)
    behind, ahead = found.arcs[rows, chords], found.arcs[rows, chords + 1]
    return np.asarray((behind + at[rows, chords] * (ahead - behind)) / found.lengths)


def _guess(met: list[tuple[int, SmoothSurface]], string: Floats) -> _Pieces:
    """Geodesics near those parts of strings that touch the obstacles."""
    fine, points, along, sizes = halved(string), [], [], []
    for _, obstacle in met:
        flags = touching(obstacle, fine)
        first, last = longest(flags)
        rows = np.arange(len(fine))
        points.append(fine[rows, first])
        along.append(fine[rows, np.minimum(first + 1, fine.shape[1] - 1)] - fine[rows, np.maximum(first - 1, 0)])
        travelled = np.cumsum(np.linalg.norm(np.diff(fine, axis=1, prepend=fine[:, :1]), axis=2), axis=1)
        sizes.append(travelled[rows, last] - travelled[rows, first])
    found = (np.array(values) for values in (points, along, sizes))
    pieces = _Pieces([one for _, one in met], fine[:, 0], fine[:, -1], *found)
    return pieces.moved(np.zeros((len(fine), 4 * len(met))))  # moves the geodesics onto the surfaces


def _solved(pieces: _Pieces) -> tuple[_Pieces, Flags]:
    """Remove the kinks by Newton's method; returns the geodesics and a mask (n,), True where it succeeded."""
    near = _SMALL * (np.linalg.norm(pieces.ends - pieces.starts, axis=1) + np.abs(pieces.sizes).sum(axis=0))
    most = np.array([[one.bend / 2, one.bend / 2, 0.5, one.bend] for one in pieces.obstacles]).ravel()
    todo, part, kinks = np.arange(len(near)), pieces, pieces.kinks()
    for _ in range(_ITERATIONS):
        left = ~(np.abs(kinks).max(axis=1) <= near[todo])  # also True for NaN
        if not left.any():
            return pieces, np.ones(len(near), dtype=bool)
        part, kinks, todo = part.rows(np.flatnonzero(left)), kinks[left], todo[left]
        count, size = kinks.shape
        every = part.rows(np.tile(np.arange(count), size)).moved(_STEP * np.repeat(np.eye(size), count, axis=0))
        slopes = (every.kinks().reshape(size, count, size) - kinks).transpose(1, 2, 0) / _STEP
        slopes[~np.isfinite(slopes).all(axis=(1, 2))] = 0  # these paths remain unchanged and fail
        change = -np.squeeze(np.linalg.pinv(slopes, rcond=1e-10) @ kinks[:, :, None], axis=2)
        change /= np.maximum(np.abs(change / most).max(axis=1), 1.0)[:, None]
        part, kinks = _better(part, change, np.linalg.norm(kinks, axis=1))
        pieces.points[:, todo], pieces.along[:, todo], pieces.sizes[:, todo] = part.points, part.along, part.sizes
    return pieces, ~np.isin(np.arange(len(near)), todo)


def _better(pieces: _Pieces, change: Floats, before: Floats) -> tuple[_Pieces, Floats]:
    """Apply ``change`` (n, 4 m), halved while the kinks would exceed ``before`` (n,) [mm]; returns the geodesics and the kinks."""
    for _ in range(5):
        tried = pieces.moved(change)
        kinks = tried.kinks()
        worse = np.linalg.norm(kinks, axis=1) > before
        if not worse.any():
            break
        change = np.where(worse[:, None], change / 2, change)
    return tried, kinks


def _geodesic(obstacle: SmoothSurface, points: Floats, along: Floats, sizes: Floats) -> tuple[Floats, Floats]:
    """Points and unit tangents (steps + 1, n, 3) of geodesics of length ``sizes`` (n,) from ``points``, in directions ``along``."""
    step, path = (sizes / _STEPS)[:, None], [(points, along)]
    half, bent = step / 2, obstacle.curving
    for _ in range(_STEPS):
        x, t = path[-1]
        a = bent(x, t)
        middle, end = x + half * t, x + step * t
        b = bent(middle, t + half * a)
        c = bent(middle + half**2 * a, t + half * b)
        d = bent(end + step * half * b, t + step * c)
        place, tangent = end + step**2 / 6 * (a + b + c), t + step / 6 * (a + 2 * (b + c) + d)
        value, slope = obstacle.level(place)
        path.append((place - (value / np.vecdot(slope, slope))[:, None] * slope, _tangent(tangent, slope)))
    return np.array([x for x, _ in path]), np.array([t for _, t in path])


def _tangent(directions: Floats, slopes: Floats) -> Floats:
    """Unit vectors (n, 3) along the components of ``directions`` that are perpendicular to ``slopes``."""
    normals = _units(slopes)
    return _units(directions - np.vecdot(directions, normals)[:, None] * normals)


def _units(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.sqrt(np.vecdot(vectors, vectors))[..., None])
