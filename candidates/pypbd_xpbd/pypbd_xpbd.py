"""PositionBasedDynamics by XPBD (Bender et al. 2017): linear tetrahedra of St. Venant-Kirchhoff, one thread. Units: cm, kg, s. It
drops every tetrahedron whose determinant is at most 1e-6 cm3, and states their number. It cannot take fibres, springs, or a
separate bulk modulus (a Poisson's ratio of at most ``poisson`` replaces it); contact, which is soft, is left out.
"""

import os
import sys
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"  # read when the library is loaded
import numpy as np
import pypbd

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from bridge import DAMPING, STEP, Scene, main

CM = 100.0  # centimetres in a metre
LEAST, XPBD = 1e-6, 3  # of the library: the least determinant, and the number of the method
GRAVITY = 9.81  # acceleration along -y in the library [cm/s^2], compensated here, as Python cannot change it


class Tetrahedra:
    """Particles at the vertices, without mass if a bone holds them."""

    def __init__(self, scene: Scene, substeps: int, poisson: float) -> None:
        (simulation := pypbd.Simulation.getCurrent()).initDefault()
        self.model, self.program = simulation.getModel(), simulation.getTimeStep()
        tets, (young, _, ratio) = scene.tets.astype(np.uint32).ravel(), scene.lame(poisson)
        body = self.model.addTetModel(CM * scene.points, tets, testMesh=False, generateCollisionObject=False)
        self.particles, self.held, self.substeps = self.model.getParticles(), scene.held, substeps
        masses = scene.masses
        masses[scene.held] = 0.0
        for vertex, mass in enumerate(masses):
            self.particles.setMass(vertex, float(mass))
        self.free = np.flatnonzero(masses).tolist()
        self.model.addSolidConstraints(body, XPBD, young / CM, ratio, young / CM, False, False)
        self.program.setValueUInt(pypbd.TimeStepController.NUM_SUB_STEPS, 1)
        self.program.setValueUInt(pypbd.TimeStepController.MAX_ITERATIONS, 1)
        pypbd.TimeManager.getCurrent().setTimeStepSize(STEP / substeps)
        dropped = int((6 * scene.volumes * CM**3 <= LEAST).sum())
        self.lost = (f"{dropped} of {len(scene.tets)} tetrahedra, which are too small",) if dropped else ()

    def step(self, held: np.ndarray, bones: dict[str, np.ndarray]) -> None:
        """Move the held vertices in sub-steps of one iteration each."""
        begin = np.array([self.particles.getPosition(vertex) for vertex in self.held])
        kept, up = DAMPING ** (1 / self.substeps), np.array([0, GRAVITY * STEP / self.substeps, 0])
        for step in range(1, self.substeps + 1):
            for vertex, point in zip(self.held, begin + step / self.substeps * (CM * held - begin), strict=True):
                self.particles.setPosition(int(vertex), point)
            for vertex in self.free:
                self.particles.setVelocity(vertex, self.particles.getVelocity(vertex) * kept + up)
            self.program.step(self.model)

    def positions(self) -> np.ndarray:
        """Positions of the vertices."""
        return np.array([self.particles.getPosition(vertex) for vertex in range(self.particles.size())]) / CM


if __name__ == "__main__":
    main(Tetrahedra, "pypbd", substeps=int, poisson=float)
