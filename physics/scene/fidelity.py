"""Fidelity: the knobs of the trade of speed for accuracy, and its presets."""

from dataclasses import dataclass

from physics.scene.validation import choice, integer, number, positive

LAWS = ("spring", "impulse")
GEOMETRIES = ("shape", "particle")
DAMPINGS = ("hunt_crossley", "dashpot")
FRICTIONS = ("coulomb", "viscous")


@dataclass(frozen=True)
class Fidelity:
    """How finely a scene is simulated.

    Args:
        law: contact law. "spring": the discrete element method, forces from overlaps; "impulse":
            what it takes for solids not to approach, found by rounds over the contacts. Impulses
            carry taller towers and larger mass ratios, and instantaneous collisions are exact;
            springs cost a quarter for single bodies, and tell how an impact runs.
        geometry: "shape": samples of one body against the exact surface of the other, both ways;
            "particle": spheres against spheres, any shape, never quite a flat face.
        damping: of the spring law alone. "overlap": continuous at first touch, restitution
            independent of where in a step the touch falls; "dashpot": linear, for comparison.
        friction: "coulomb": static and sliding, with memory; "viscous": in proportion to the slip
            up to the same limit, which holds nothing still but costs least. Of the spring law.
        substep: s, the longest step of the integrator.
        collision_substeps: substeps to a collision step; candidates are looked for once in one,
            and again within it where a body outruns the skin.
        contact_resolution: omega h of a contact, in rad a substep: the stiffness follows from it as
            mass (contact_resolution / substep)^2. Smaller is softer: it resolves an impact better
            and sinks deeper. At most 0.7 with springs: beyond, a box at rest would chatter. At most
            2 with impulses, whose towers buckle if it is small: 1.8 is right for them.
        spacing: of samples, as a fraction of the smallest width of the solid or of any body.
        rounding: of a box's edges, as a fraction of its smallest half width.
        skin: m at which a sample becomes a candidate, as a fraction of a body's smallest width.
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

    def __post_init__(self) -> None:
        """Checks every field."""
        choice("Fidelity.law", self.law, LAWS)
        choice("Fidelity.geometry", self.geometry, GEOMETRIES)
        choice("Fidelity.damping", self.damping, DAMPINGS)
        choice("Fidelity.friction", self.friction, FRICTIONS)
        for name, only in (("damping", "hunt_crossley"), ("friction", "coulomb")):
            if self.law == "impulse" and getattr(self, name) != only:
                raise ValueError(
                    f"Fidelity.{name} {getattr(self, name)!r} belongs to law='spring'; with "
                    f"law='impulse' leave {name} out"
                )
        object.__setattr__(self, "substep", positive("Fidelity.substep", self.substep))
        together = integer("Fidelity.collision_substeps", self.collision_substeps, low=1)
        object.__setattr__(self, "collision_substeps", together)
        limits = {
            "contact_resolution": (1e-4, 0.7 if self.law == "spring" else 2.0),
            "spacing": (0.01, 1.0),
            "rounding": (1e-3, 0.5),
            "skin": (0.01, 1.0),
        }
        for name, (low, high) in limits.items():
            with_law = f" with law={self.law!r}" if name == "contact_resolution" else ""
            value = number(f"Fidelity.{name}{with_law}", getattr(self, name), low=low, high=high)
            object.__setattr__(self, name, value)


PRESETS: dict[str, Fidelity] = {
    # of the steps that cut a frame of 40 ms into two collision steps, the longest at which towers
    # of three stand: at 3.3 and 4 ms they buckle
    "fast": Fidelity(substep=0.02 / 7, collision_substeps=7),
    "balanced": Fidelity(),
    "accurate": Fidelity(substep=0.25e-3, contact_resolution=0.2, spacing=0.25),
    "solid": Fidelity(law="impulse", contact_resolution=1.8),
}


def resolve(fidelity: "str | Fidelity") -> Fidelity:
    """The fidelity of a preset's name, or the fidelity itself."""
    if isinstance(fidelity, Fidelity):
        return fidelity
    if isinstance(fidelity, str):
        return PRESETS[choice("fidelity", fidelity, PRESETS)]
    raise TypeError(f"fidelity must be one of {list(PRESETS)} or a Fidelity, got {fidelity!r}")
