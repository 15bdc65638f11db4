"""Settings of MuJoCo, which can be named without it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class MujocoOptions:
    """What MuJoCo's users trade for speed; all but the step and the cone are its defaults.

    Args:
        timestep: s.
        integrator: "Euler", "RK4", "implicit" or "implicitfast".
        cone: "elliptic", which is Coulomb's, or "pyramidal".
        solver: "Newton", "CG" or "PGS".
        iterations: of the solver, at most.
        impratio: how much stiffer friction is than the normal force.
        noslip: iterations of the solver that removes slip.
        solref: time constant in s and damping ratio of a contact; negative: stiffness and damping.
        solimp: impedance of a contact at its surface and at its depth, and that depth in m.
    """

    timestep: float = 2e-3
    integrator: str = "Euler"
    cone: str = "elliptic"
    solver: str = "Newton"
    iterations: int = 100
    impratio: float = 1.0
    noslip: int = 0
    solref: tuple[float, float] = (0.02, 1.0)
    solimp: tuple[float, float, float] = (0.9, 0.95, 0.001)
