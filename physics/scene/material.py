"""Material: the surface properties of a solid."""

from dataclasses import dataclass

from physics.scene.parameter_ranges import RANGES
from physics.scene.validation import number, positive


@dataclass(frozen=True)
class Material:
    """Surface properties.

    Args:
        friction: Coulomb's coefficient, static and kinetic, at least 0. A pair has the geometric
            mean of its two values, so a frictionless surface slides on everything.
        restitution: ratio of the normal speeds after and before an impact, 0 to 1. A pair has the
            larger of its two values.
        stiffness: N/m of one face in contact. None: it follows from the fidelity's step and contact
            resolution and from the masses of the pair.
        rolling_resistance: m. A contact resists rolling by a torque of at most this length times
            its normal force. A pair has the larger of its two values.
        spinning_resistance: m; the same for spinning about the normal.

    Raises:
        TypeError, ValueError: a field is not a number or out of range.
    """

    friction: float = 0.5
    restitution: float = 0.1
    stiffness: float | None = None
    rolling_resistance: float = 0.0
    spinning_resistance: float = 0.0

    def __post_init__(self) -> None:
        """Checks the numbers."""
        for name in ("friction", "restitution"):
            value = RANGES[name].number(f"Material.{name}", getattr(self, name))
            object.__setattr__(self, name, value)
        for name in ("rolling_resistance", "spinning_resistance"):
            object.__setattr__(self, name, number(f"Material.{name}", getattr(self, name), low=0.0))
        if self.stiffness is not None:
            object.__setattr__(self, "stiffness", positive("Material.stiffness", self.stiffness))
