"""Features: what a scene at a fidelity needs compiled in. Derived, never written by hand.

Counts, sizes and material numbers stay out, so that kernels are few and a sweep compiles nothing.
"""

from typing import NamedTuple

# how bodies turn: not at all; with the same moment about every axis; in general
NO_ROTATION, ISOTROPIC, GENERAL = range(3)


class Features(NamedTuple):
    """Compile-time switches; each absent one is absent from the machine code and the state.

    Attributes:
        impulse: the impulse law in place of the spring law.
        dashpot: linear damping in place of the one continuous in overlap.
        friction: any pair has friction: tangential law and history.
        viscous: friction without history.
        resistance: any pair resists rolling or spinning.
        rotation: NO_ROTATION, ISOTROPIC or GENERAL.
        plane, sphere, box, capsule, particles: kinds of surface that samples are tested against.
        drives: there are driven tools.
        gripper: some of them are the fingers of grippers.
        compound: some surfaces are those of a compound's parts, with frames of their own.
        varied: worlds have masses, materials and sizes of their own.
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
