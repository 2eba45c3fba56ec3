"""pbatoolkit's vertex block descent (Chen et al. 2024): linear tetrahedra of stable neo-Hooke, one thread, SI units. It cannot take
fibres, springs, a separate bulk modulus (lambda of a Poisson's ratio of at most ``poisson`` replaces it, plus mu, as the lambda
of its energy is not Lame's), or bones that are not made of tetrahedra: contact is left out.
"""

import os
import sys
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"  # read when the library is loaded
import numpy as np
from pbatoolkit import pbat

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from bridge import DAMPING, DENSITY, STEP, Scene, main


def meshed(data, scene: Scene):
    """The ``data`` of an integrator with the mesh of the scene, without gravity, and with fixed vertices that follow bones."""
    faces = scene.boundary().astype(np.int64)
    return (
        data.with_volume_mesh(np.asfortranarray(scene.points.T), np.asfortranarray(scene.tets.T.astype(np.int64)))
        .with_surface_mesh(np.unique(faces), np.asfortranarray(faces.T))
        .with_bodies(np.zeros(len(scene.points), np.int64))
        .with_acceleration(np.zeros((3, len(scene.points)), order="F"))
        .with_dirichlet_vertices(scene.held.astype(np.int64))
    )


class Descent:
    """The integrator, whose fixed vertices are moved with their bones before each step."""

    lost, substeps = (), 1

    def __init__(self, scene: Scene, iterations: int, poisson: float) -> None:
        self.held, self.iterations = scene.held, iterations
        moduli = scene.mu, scene.lame(poisson)[1] + scene.mu
        self.integrator = self.made(scene, *(np.full(len(scene.tets), one) for one in moduli))

    def made(self, scene: Scene, mu: np.ndarray, lame: np.ndarray):
        """The integrator for ``mu`` and ``lame`` (e,) [Pa]."""
        data = meshed(pbat.sim.vbd.Data(), scene).with_material(np.full(len(mu), DENSITY), mu, lame)
        begin = pbat.sim.vbd.InitializationStrategy.Inertia
        return pbat.sim.vbd.Integrator(data.with_initialization_strategy(begin).construct(validate=True))

    def step(self, held: np.ndarray, bones: dict[str, np.ndarray]) -> None:
        """Move the held vertices to their positions and advance by a step."""
        points = np.array(self.integrator.x, order="F")
        points[:, self.held] = held.T
        self.integrator.x, self.integrator.v = points, np.array(self.integrator.v, order="F") * DAMPING
        self.integrator.step(STEP, self.iterations, self.substeps)

    def positions(self) -> np.ndarray:
        """Positions of the vertices."""
        return np.array(self.integrator.x).T


if __name__ == "__main__":
    main(Descent, "pbatoolkit", iterations=int, poisson=float)
