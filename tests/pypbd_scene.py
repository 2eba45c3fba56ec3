"""What pypbd makes of a scene of particles: JSON on stdin, JSON on stdout.

It keeps one state for the whole process and takes all cores that it is given, hence a process of its own.

"rest" (n, 3) and "points" (n, 3) [m]: the particles at rest, and where they start. "masses" (n,) [kg], 0 for what is attached.
"constraints": kind, vertices and stiffness of each. "steps" of so many "seconds" with so many "sweeps", under its gravity of
9.81 m/s2 along -y; or, with 0 steps, one projection of each constraint.
"""

import json
import sys

ADD = {
    "distance": "addDistanceConstraint",
    "distance_xpbd": "addDistanceConstraint_XPBD",
    "dihedral": "addDihedralConstraint",
    "volume": "addVolumeConstraint",
}


def run(scene):
    """Positions in the end, and the order in which the constraints come in a time step."""
    import pypbd

    simulation = pypbd.Simulation.getCurrent()
    simulation.initDefault()
    model, program = simulation.getModel(), simulation.getTimeStep()
    fill(model, scene)
    pypbd.TimeManager.getCurrent().setTimeStepSize(scene["seconds"])
    program.setValueUInt(pypbd.TimeStepController.NUM_SUB_STEPS, 1)
    program.setValueUInt(pypbd.TimeStepController.MAX_ITERATIONS, scene["sweeps"])
    for _ in range(scene["steps"]):
        program.step(model)
    if scene["steps"] == 0:
        for constraint in model.getConstraints():
            constraint.initConstraintBeforeProjection(model)
            constraint.updateConstraint(model)
            constraint.solvePositionConstraint(model, 0)
    particles = model.getParticles()
    model.initConstraintGroups()
    return {
        "points": [particles.getPosition(i).tolist() for i in range(particles.size())],
        "order": [int(number) for group in model.getConstraintGroups() for number in group],
    }


def fill(model, scene):
    """Put the scene's particles and constraints into ``model``; constraints take their rest values from "rest"."""
    particles = model.getParticles()
    for i, (place, mass) in enumerate(zip(scene["rest"], scene["masses"], strict=True)):
        particles.addVertex(place)
        particles.setMass(i, mass)
    for kind, vertices, stiffness in scene["constraints"]:
        assert getattr(model, ADD[kind])(*vertices, stiffness)
    for i, place in enumerate(scene["points"]):
        particles.setPosition(i, place)


if __name__ == "__main__":
    json.dump(run(json.load(sys.stdin)), sys.stdout)
