"""Newton's vertex block descent (Chen et al. 2024): linear tetrahedra of stable neo-Hooke, penalty contact with meshes, one thread,
SI units. It cannot take fibres, springs, or a separate bulk modulus: a Poisson's ratio of at most ``poisson`` replaces it.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import newton
import numpy as np
import warp as wp
from bridge import DAMPING, DENSITY, STEP, Scene, main
from scipy.spatial.transform import Rotation


class Descent:
    """Particles at the vertices, kinematic if a bone holds them, and kinematic bodies with the meshes of bones."""

    lost, kind, substeps = (), newton.solvers.SolverVBD, 1

    def __init__(self, scene: Scene, iterations: int, poisson: float) -> None:
        wp.set_device("cpu")
        builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
        mesh = {"vertices": [wp.vec3(*point) for point in scene.points], "indices": scene.tets.ravel().tolist()}
        material = {"density": DENSITY, "k_mu": scene.mu, "k_lambda": scene.lame(poisson)[1], "k_damp": 0.0}
        place = {"pos": wp.vec3(), "rot": wp.quat_identity(), "scale": 1.0, "vel": wp.vec3(), "particle_radius": 1e-4}
        builder.add_soft_mesh(**mesh, **place, **material)
        for vertex in scene.held:
            builder.particle_flags[vertex], builder.particle_mass[vertex] = 0, 0.0
        self.bones, self.held = [bone.name for bone in scene.bones], scene.held
        for bone in scene.bones:
            mesh = newton.Mesh(bone.points, bone.triangles.ravel())
            builder.add_shape_mesh(builder.add_body(is_kinematic=True), mesh=mesh)
        builder.color()
        self.model = builder.finalize()
        self.model.soft_contact_ke, self.model.soft_contact_kd, self.model.soft_contact_mu = 1e3, 0.0, 0.0
        self.solver, self.pipeline = self.kind(self.model, iterations=iterations), newton.CollisionPipeline(self.model)
        self.now, self.next, self.contacts = self.model.state(), self.model.state(), self.pipeline.contacts()

    def step(self, held: np.ndarray, bones: dict[str, np.ndarray]) -> None:
        """Move bones and held vertices to their positions and advance by a part of a step."""
        turns = {name: Rotation.from_matrix(bones[name][:3, :3]).as_quat() for name in self.bones}
        for state in (self.now, self.next):
            points = state.particle_q.numpy()
            points[self.held] = held
            state.particle_q.assign(points)
            if turns:
                state.body_q.assign(np.array([[*bones[name][:3, 3], *turn] for name, turn in turns.items()]))
        self.now.particle_qd.assign(self.now.particle_qd.numpy() * DAMPING ** (1 / self.substeps))
        self.pipeline.collide(self.now, self.contacts)
        self.solver.step(self.now, self.next, None, self.contacts, STEP / self.substeps)
        self.now, self.next = self.next, self.now

    def positions(self) -> np.ndarray:
        """Positions of the vertices."""
        return self.now.particle_q.numpy().astype(float)


if __name__ == "__main__":
    main(Descent, "newton", iterations=int, poisson=float)
