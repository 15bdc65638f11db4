"""Which scenes Newton's method solves: those of free bodies, in worlds side by side."""

from physics.scene.fidelity import Fidelity
from physics.scene.scene import Scene


def check_solver(scene: Scene, fidelity: Fidelity, engine: str) -> None:
    """Raises ValueError if Newton's method doesn't solve the contacts of a scene.

    `engine`: see `physics.engines`.
    """
    if fidelity.solver != "newton":
        return
    problem = "Fidelity.solver 'newton' solves for the contacts of free bodies with engine='worlds'"
    instead = "use solver='gauss_seidel' with contact_resolution=1.8"
    if engine != "worlds":
        raise ValueError(
            f"{problem}; got engine={engine!r} for {len(scene.bodies)} bodies: {instead}"
        )
    for name, coupled in (("joints", scene.joints), ("driven solids", scene.driven_bodies)):
        if coupled:
            raise ValueError(f"{problem}; the scene has {len(coupled)} {name}: {instead}")
    for solid in (*scene.bodies, *scene.statics):
        if solid.material.rolling_resistance or solid.material.spinning_resistance:
            raise ValueError(f"{problem}; the scene has rolling or spinning resistance: {instead}")
