"""Which scenes Newton's method solves: those of a few free bodies."""

from physics.scene.fidelity import Fidelity
from physics.scene.scene import Scene


def check_solver(scene: Scene, fidelity: Fidelity, crowd: bool) -> None:
    """Raises ValueError if Newton's method doesn't solve the contacts of a scene.

    `crowd`: whether its worlds are worlds of many bodies.
    """
    if fidelity.solver != "newton":
        return
    problem = (
        "Fidelity.solver 'newton' solves for the contacts of at most 32 free bodies; the scene has "
    )
    instead = ": use solver='gauss_seidel' with contact_resolution=1.8"
    if crowd:
        raise ValueError(f"{problem}{len(scene.bodies)} bodies{instead}")
    for name, coupled in (("joints", scene.joints), ("driven solids", scene.driven_bodies)):
        if coupled:
            raise ValueError(f"{problem}{len(coupled)} {name}{instead}")
    for solid in (*scene.bodies, *scene.statics):
        if solid.material.rolling_resistance or solid.material.spinning_resistance:
            raise ValueError(f"{problem}rolling or spinning resistance{instead}")
