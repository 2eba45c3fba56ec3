"""Drake's deformable bodies (Han et al. 2023): linear tetrahedra of stable neo-Hooke, implicit steps, one thread, SI units. As it
linearises attachments, it needs ``substeps``. It cannot take fibres, springs, contact (left out) or a separate bulk modulus.
"""

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import meshio
import numpy as np
from bridge import DAMPING, DENSITY, STEP, Scene, main
from pydrake import geometry, math
from pydrake.multibody import fem, plant, tree
from pydrake.multibody.math import SpatialVelocity
from pydrake.systems import analysis, framework


class Deformable:
    """A deformable body whose held vertices are fixed to rigid bodies, which are heavy and move like the bones."""

    lost = ()

    def __init__(self, scene: Scene, substeps: int, poisson: float) -> None:
        builder, config, rest = framework.DiagramBuilder(), fem.DeformableBodyConfig(), math.RigidTransform()
        config.set_youngs_modulus(scene.lame(poisson)[0])
        config.set_poissons_ratio(scene.lame(poisson)[2])
        config.set_mass_density(DENSITY)
        config.set_material_model(fem.MaterialModel.kNeoHookean)
        self.plant, _ = plant.AddMultibodyPlantSceneGraph(builder, STEP / substeps)
        self.plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
        self.model, shape = self.plant.mutable_deformable_model(), geometry.GeometryInstance
        with tempfile.NamedTemporaryFile(suffix=".vtk") as file:
            meshio.Mesh(scene.points, {"tetra": scene.tets}).write(file.name, file_format="vtk42", binary=False)
            self.body = self.model.RegisterDeformableBody(shape(rest, geometry.Mesh(file.name), "muscle"), config, 1.0)
        heavy = tree.SpatialInertia.SolidCubeWithDensity(1e6, 1.0)
        self.bones = {name: self.plant.AddRigidBody(name, heavy) for name in sorted(set(scene.holders))}
        for point, name in zip(map(math.RigidTransform, scene.points[scene.held]), scene.holders, strict=True):
            self.model.AddFixedConstraint(self.body, self.bones[name], rest, geometry.Sphere(1e-6), point)
        self.plant.Finalize()
        self.simulator = analysis.Simulator(builder.Build())
        self.now = self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())

    def step(self, held: np.ndarray, bones: dict[str, np.ndarray]) -> None:
        """Move the rigid bodies to the poses of the bones in a step."""
        for name, body in self.bones.items():
            begin, end = self.plant.GetFreeBodyPose(self.now, body), math.RigidTransform(bones[name])
            turn = (end.rotation() @ begin.rotation().inverse()).ToAngleAxis()
            speed = SpatialVelocity(turn.angle() * turn.axis() / STEP, (end.translation() - begin.translation()) / STEP)
            self.plant.SetFreeBodySpatialVelocity(self.now, body, speed)
        self.model.SetVelocities(self.now, self.body, DAMPING * self.model.GetVelocities(self.now, self.body))
        self.simulator.AdvanceTo(self.now.get_time() + STEP)

    def positions(self) -> np.ndarray:
        """Positions of the vertices."""
        return self.model.GetPositions(self.now, self.body).T


if __name__ == "__main__":
    main(Deformable, "drake", substeps=int, poisson=float)
