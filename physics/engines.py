"""Which engine simulates a scene: what sixteen lanes of a vector hold.

- "worlds": a lane holds a world. For any scene; made for few bodies in many worlds. Memory and time
  grow with the number of all pairs of bodies.
- "bodies": a lane holds a pair of bodies that are near each other. For many bodies.
- "particles": a lane holds a pair of balls. For heaps of bodies that are made of balls.
"""

from physics.granular.support import supports
from physics.scene.fidelity import Fidelity
from physics.scene.scene import Scene
from physics.scene.validation import choice

ENGINES = ("auto", "worlds", "bodies", "particles")
# bodies from which pairs are found by a grid; below, all pairs have rows of their own
MANY = 33

_OF_BODIES = (("time_control", ("fixed", "swept")), ("integrator", ("midpoint", "euler")))


def choose_engine(
    scene: Scene, fidelity: Fidelity, engine: str = "auto", per_world_parameters: bool = False
) -> str:
    """The engine of a scene: the given one or, with "auto", the fastest that can simulate it.

    Raises:
        ValueError: no such engine, or it can't simulate the scene; the message says why.
    """
    choice("engine", engine, ENGINES)
    if engine == "worlds" or (engine == "auto" and len(scene.bodies) < MANY):
        return "worlds"
    if per_world_parameters:
        bodies = particles = "per_world_parameters must be False, got True"
    else:
        bodies, particles = _of_bodies(scene, fidelity), supports(scene, fidelity)
    if engine == "auto":
        return "worlds" if bodies else "bodies" if particles else "particles"
    reason = bodies if engine == "bodies" else particles
    if reason:
        raise ValueError(f"engine={engine!r} can't simulate this: {reason}; engine='worlds' can")
    return engine


def _of_bodies(scene: Scene, fidelity: Fidelity) -> str:
    """Why "bodies" can't simulate a scene at a fidelity; "" if it can."""
    if not scene.bodies:
        return "Scene.bodies must hold at least one body, got none"
    for name, right in _OF_BODIES:
        value = getattr(fidelity, name)
        if value not in right:
            return f"Fidelity.{name} must be {' or '.join(map(repr, right))}, got {value!r}"
    return ""
