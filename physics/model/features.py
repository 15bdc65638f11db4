"""Features: compile-time switches that the engine derives from a scene and a fidelity.

Counts, sizes and material values are not features. Scenes that differ only in these share their
kernels, so a parameter sweep compiles nothing.
"""

from typing import NamedTuple

# rotation of bodies: none; with equal principal moments of inertia; general
NO_ROTATION, ISOTROPIC, GENERAL = range(3)


class Features(NamedTuple):
    """Compile-time switches. The machine code and the state omit features that are switched off.

    Attributes:
        impulse: impulse law instead of the spring law.
        dashpot: linear damping instead of Hunt-Crossley damping.
        friction: at least one pair has friction; adds the tangential law and its history.
        viscous: viscous friction, without history.
        resistance: at least one pair has rolling or spinning resistance.
        rotation: NO_ROTATION, ISOTROPIC or GENERAL.
        plane, sphere, box, capsule, particles: kinds of surface that samples are tested against.
        drives: the scene has drives.
        gripper: at least two of the drives are the fingers of a gripper.
        compound: at least one surface is a part of a compound and has its own frame.
        per_world_parameters: masses, materials and sizes can differ between worlds.
    """

    impulse: bool
    dashpot: bool
    friction: bool
    viscous: bool
    resistance: bool
    rotation: int
    plane: bool
    sphere: bool
    box: bool
    capsule: bool
    particles: bool
    drives: bool
    gripper: bool
    compound: bool
    per_world_parameters: bool
