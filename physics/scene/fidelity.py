"""Fidelity: the settings that trade speed for accuracy, and their presets."""

import math
from dataclasses import dataclass, replace
from typing import cast

from physics.scene import saving
from physics.scene.validation import choice, integer, number, positive

LAWS = ("spring", "impulse")
SOLVERS = ("gauss_seidel", "newton")
GEOMETRIES = ("shape", "particle")
DAMPINGS = ("hunt_crossley", "dashpot")
FRICTIONS = ("coulomb", "viscous")
INTEGRATORS = ("midpoint", "euler", "rk4", "adaptive")

_TOLERANCE = 1e-6  # 1/s, of the adaptive integrator
TIME_CONTROLS = ("fixed", "adaptive", "bisection", "advancement", "swept")
FIND_IMPACTS = ("bisection", "advancement", "swept")


@dataclass(frozen=True)
class Fidelity:
    """How accurately a scene is simulated.

    Args:
        law: contact law. "spring": forces follow from penetrations (discrete element method).
            "impulse": a sequential-impulse solver computes the impulses that keep solids from
            approaching each other. Impulses support taller towers and larger mass ratios, and
            instantaneous collisions are exact. For single bodies springs cost a quarter as much,
            and they resolve the course of an impact in time.
        geometry: "shape": samples of each solid against the exact surface of the other.
            "particle": spheres cover each body, and two bodies touch sphere against sphere; faces
            are not exactly flat. Compounds need "shape".
        damping: damping of the spring law. "hunt_crossley": the force is continuous at first
            contact, and restitution does not depend on when within a substep contact begins.
            "dashpot": linear damping, for comparison. The impulse law accepts the default only.
        friction: "coulomb": static and sliding friction; each contact has a spring. "viscous":
            force proportional to the slip velocity, up to the same limit; it costs least but cannot
            hold a body at rest. The impulse law accepts "coulomb" only.
        substep: s, longest step of the integrator.
        collision_substeps: substeps per collision step. The broadphase runs once per collision
            step, and again within it if a body moves farther than the skin allows.
        contact_resolution: omega h, the phase in rad that the oscillation of a contact advances per
            substep. The contact stiffness is mass (contact_resolution / substep)^2, with the
            reduced mass of the pair. A smaller value resolves an impact with more substeps, but
            contacts are softer and penetrate deeper. At most 0.7 with springs; above that a box at
            rest would chatter. At most 2 with impulses; 1.8 is recommended, because towers buckle
            at small values. At most 100 with solver="newton"; 50 is recommended.
        spacing: largest distance of samples, as a fraction of the smallest width among the solid
            and all bodies.
        rounding: radius of a box's edges, as a fraction of the box's smallest half width.
        skin: separation at which a sample becomes a broadphase candidate, as a fraction of the
            smallest width of the two solids; statics and grounds don't count.
        integrator: "midpoint": kick-drift-kick, and the midpoint rule for the rotation; second
            order. "euler": semi-implicit Euler; first order. "rk4": the classical Runge-Kutta
            method of fourth order. "adaptive": the Runge-Kutta pair of Dormand and Prince, with
            steps that keep to a tolerance, for each world by itself. The last two evaluate forces
            at trial states, so they are for scenes in which nothing can touch and without drives.
        tolerance: 1/s, error per second of the adaptive integrator: of positions in m, of rotations
            in rad, of velocities in m/s and of angular velocities in rad/s. 1e-6 if None. Others
            take none.
        time_control: how a substep is divided where solids are fast. "fixed": it isn't; a body that
            moves further per substep than a wall is thick can pass through it. "adaptive": a
            world's substep is halved until no two solids can overlap by more than `courant` allows.
            The others need law="impulse" and geometry="shape". They stop a world at the time of a
            collision, resolve it, and continue with the rest of the substep. "bisection": if solids
            overlap at the end of the substep, bisection finds when that began; it misses what has
            passed by then. "advancement": every pair that approaches is advanced by no more than it
            can move without touching; nothing is missed. "swept": the same, only for pairs that are
            faster than `courant` allows; nothing is missed either.
        courant: motion of two solids relative to each other per substep that "adaptive" and "swept"
            accept, as a fraction of the half width of the thinner one. 0.01 to 1.
        impact_tolerance: m, separation or overlap at which "bisection", "advancement" and "swept"
            count two solids as touching. Below the skin of every pair of solids.
        solver: of the impulse law. "gauss_seidel": one sweep per substep corrects contacts one
            after another. "newton": all contacts of a world are solved together. They can then be
            nearly rigid, so tall towers and large mass ratios stand at steps of up to 20 ms; a
            substep costs about half as much again. For worlds of at most 32 bodies, without joints,
            drives, or rolling and spinning resistance.

    Raises:
        TypeError, ValueError: a field is of the wrong type, out of range or not supported by the
            law.
    """

    law: str = "spring"
    geometry: str = "shape"
    damping: str = "hunt_crossley"
    friction: str = "coulomb"
    substep: float = 2e-3
    collision_substeps: int = 5
    contact_resolution: float = 0.5
    spacing: float = 0.5
    rounding: float = 0.025
    skin: float = 0.1
    integrator: str = "midpoint"
    tolerance: float | None = None
    time_control: str = "fixed"
    courant: float = 0.5
    impact_tolerance: float = 1e-6
    solver: str = "gauss_seidel"

    def __post_init__(self) -> None:
        """Checks every field."""
        # a law isn't looked up: the presets themselves are built before there are any
        if isinstance(self.law, str) and self.law not in LAWS and self.law in PRESETS:
            raise ValueError(f"{self.law!r} is a preset: physics.PRESETS[{self.law!r}]")
        choice("Fidelity.law", self.law, LAWS)
        choice("Fidelity.geometry", self.geometry, GEOMETRIES)
        choice("Fidelity.damping", self.damping, DAMPINGS)
        choice("Fidelity.friction", self.friction, FRICTIONS)
        choice("Fidelity.time_control", self.time_control, TIME_CONTROLS)
        choice("Fidelity.solver", self.solver, SOLVERS)
        if self.solver != "gauss_seidel" and self.law != "impulse":
            raise ValueError(
                f"Fidelity.solver {self.solver!r} requires law='impulse'; with law={self.law!r} "
                "omit solver: springs need none"
            )
        self._check_time_control()
        for name, only in (("damping", "hunt_crossley"), ("friction", "coulomb")):
            if self.law == "impulse" and getattr(self, name) != only:
                raise ValueError(
                    f"Fidelity.{name} {getattr(self, name)!r} requires law='spring'; with "
                    f"law='impulse' omit {name}"
                )
        choice("Fidelity.integrator", self.integrator, INTEGRATORS)
        self._check_tolerance()
        object.__setattr__(self, "substep", positive("Fidelity.substep", self.substep))
        substeps = integer("Fidelity.collision_substeps", self.collision_substeps, low=1)
        object.__setattr__(self, "collision_substeps", substeps)
        newton = self.solver == "newton"
        most = 0.7 if self.law == "spring" else 100.0 if newton else 2.0
        limits = {
            "contact_resolution": (1e-4, most),
            "spacing": (0.01, 1.0),
            "rounding": (1e-3, 0.5),
            "skin": (0.01, 1.0),
            "courant": (0.01, 1.0),
            "impact_tolerance": (1e-9, math.inf),
        }
        for name, (low, high) in limits.items():
            setting = f"solver={self.solver!r}" if newton else f"law={self.law!r}"
            if self.law == "impulse" and not newton:
                setting += " and solver='gauss_seidel'"
            with_law = f" with {setting}" if name == "contact_resolution" else ""
            value = number(f"Fidelity.{name}{with_law}", getattr(self, name), low=low, high=high)
            object.__setattr__(self, name, value)

    def _check_tolerance(self) -> None:
        """Sets the default tolerance of the adaptive integrator; others have none."""
        if self.integrator != "adaptive":
            if self.tolerance is not None:
                raise ValueError(
                    f"Fidelity.tolerance {self.tolerance!r} requires integrator='adaptive'; with "
                    f"integrator={self.integrator!r} omit tolerance, Fidelity.substep sets the step"
                )
            return
        value = _TOLERANCE if self.tolerance is None else self.tolerance
        value = number("Fidelity.tolerance", value, low=1e-12, high=1.0)
        object.__setattr__(self, "tolerance", value)

    def _check_time_control(self) -> None:
        """Raises an error if times of impact are asked of a law or geometry that has none."""
        if self.time_control != "fixed" and self.integrator != "midpoint":
            raise ValueError(
                f"Fidelity.time_control {self.time_control!r} requires integrator='midpoint', got "
                f"{self.integrator!r}: it divides that integrator's steps"
            )
        if self.time_control not in FIND_IMPACTS:
            return
        for name, only, why in (
            ("law", "impulse", "springs resolve a collision over many steps, at no single time"),
            ("geometry", "shape", "distances between particles aren't bounded along a path"),
        ):
            if getattr(self, name) != only:
                raise ValueError(
                    f"Fidelity.time_control {self.time_control!r} requires {name}={only!r}, got "
                    f"{getattr(self, name)!r}: {why}; or use time_control='fixed' with a shorter "
                    "substep"
                )

    def to_json(self) -> str:
        """The fidelity as JSON text, from which `from_json` builds an equal one."""
        return saving.write(self, "fidelity")

    @classmethod
    def from_json(cls, text: str) -> "Fidelity":
        """The fidelity of a text of `to_json`.

        Raises:
            TypeError, ValueError: no such text, or a bad value in it; the message names its place.
        """
        return cast(Fidelity, saving.read(text, "fidelity", (cls,)))


PRESETS: dict[str, Fidelity] = {
    # the longest substep that divides a frame of 40 ms into two collision steps and at which towers
    # of three cubes stand; at 3.3 ms and 4 ms they buckle
    "fast": Fidelity(substep=0.02 / 7, collision_substeps=7),
    "balanced": Fidelity(),
    "accurate": Fidelity(substep=0.25e-3, contact_resolution=0.2, spacing=0.25),
    "solid": Fidelity(law="impulse", contact_resolution=1.8),
}
# all contacts of a world at once, so stiff that next to nothing sinks: for what stands and carries
NEWTON = replace(PRESETS["solid"], solver="newton", contact_resolution=50.0)


def resolve(fidelity: "str | Fidelity") -> Fidelity:
    """The preset with this name; a Fidelity is returned unchanged.

    Raises:
        TypeError: neither a string nor a Fidelity.
        ValueError: no preset has this name.
    """
    if isinstance(fidelity, Fidelity):
        return fidelity
    if isinstance(fidelity, str):
        return PRESETS[choice("fidelity", fidelity, PRESETS)]
    raise TypeError(f"fidelity must be one of {list(PRESETS)} or a Fidelity, got {fidelity!r}")
