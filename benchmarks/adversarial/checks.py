"""What is wrong after a step, world by world."""

from collections.abc import Mapping

import numpy as np

from benchmarks.adversarial.balance import Balance
from physics import World

Array = np.ndarray


def values_of(observation: Mapping[str, Array], reward: Array) -> dict[str, Array]:
    """Everything that a step returns and that must be finite."""
    return {**observation, "reward": reward}


def not_finite(values: Mapping[str, Array]) -> dict[int, str]:
    """What is wrong, by world."""
    found: dict[int, str] = {}
    for name, value in values.items():
        rows = value.reshape(len(value), -1)
        if not np.isfinite(rows).all():
            for world in np.flatnonzero(~np.isfinite(rows).all(axis=1)).tolist():
                found.setdefault(world, f"{name} is {value[world]}")
    return found


def below_ground(world: World) -> Array:
    """[count] bool: the centre of a body is below the ground."""
    return np.asarray((world.position[..., 2] < 0.0).any(axis=1))


def out_of_world(world: World) -> Array:
    """[count] bool: all of a body is below the ground."""
    reach = np.array([body.shape.reach for body in world.scene.bodies])
    sizes = world.parameters.size if world.features.per_world_parameters else 1.0
    return np.asarray((world.position[..., 2] < -reach * sizes).any(axis=1))


def sunk(world: World, mask: Array) -> dict[int, str]:
    """What is wrong in the worlds of a mask, of which a body has left the world."""
    lowest = world.position[..., 2].min(axis=1)
    return {
        w: f"the centre of a body is at a height of {lowest[w]:g} m"
        for w in np.flatnonzero(mask).tolist()
    }


def gained(balance: Balance, mask: Array) -> dict[int, str]:
    """What is wrong in the worlds of a mask, which have gained energy."""
    return {
        w: f"{1e3 * balance.gain[w]:.3g} mJ beyond the servos' work, "
        f"{1e3 * balance.allowed[w]:.3g} mJ are allowed"
        for w in np.flatnonzero(mask).tolist()
    }


def differences(values: Mapping[str, Array], few: Mapping[str, Array]) -> str:
    """Where all worlds differ from the first of them by themselves; "" if nowhere."""
    for name, value in values.items():
        count = len(few[name])
        if not np.array_equal(value[:count], few[name], equal_nan=True):
            return f"{name} differs between {len(value)} worlds and {count} of them by themselves"
    return ""
