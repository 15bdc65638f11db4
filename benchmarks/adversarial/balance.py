"""The energy balance of each world between resets.

With kinetic energy K of bodies and drives, potential energy U of gravity, energy V of the normal
springs of contacts, and work W of the servos,

    K + U + V  <=  (K + U + V at the start) + W,

for friction, damping and inelastic impacts only take energy. What exceeds it by more than 1e-3 of
the servos' work, in absolute values, or 1 mJ is a failure. 1 mJ lifts the cube of 0.1 kg by 1 mm;
in a world with a heavier body, as much is allowed as lifts that by 1 mm, so that a smaller gain of
a light body beside it is not seen.

While a spring contact lasts, the energy of the kick-drift-kick steps oscillates by up to
(omega h)^2 / 4 of V, and returns when it ends (omega h is Fidelity.contact_resolution, at most). As
much is allowed on top.

With the impulse law V counts at the start only, where bodies are at rest: later an instantaneous
collision may leave an overlap that holds no energy. This tests no less than what is returned.
"""

import numpy as np

from physics import World
from physics.scene.parameters import Parameters

Array = np.ndarray

FRACTION = 1e-3  # of the servos' work, step by step in absolute values
LEAST = 1e-3  # J
LIFT = 1e-3  # m, of the heaviest body


def elastic(world: World) -> Array:
    """[count] J of spring contacts."""
    return world.elastic_energy() if world.fidelity.law == "spring" else np.zeros(world.count)


def _of_solids(world: World) -> Array:
    """[count] J of bodies and drives."""
    total = world.kinetic_energy() + world.potential_energy()
    drives = world.drive_energy()
    for drive in range(drives.shape[1]):
        total += drives[:, drive]
    return np.asarray(total)


def energy(world: World) -> Array:
    """[count] J of bodies, drives and contacts."""
    return _of_solids(world) + elastic(world)


def start_energy(world: World) -> Array:
    """[count] J at the start of episodes."""
    stored = world.elastic_energy() if world.fidelity.law == "impulse" else 0.0
    return energy(world) + stored


def work(world: World) -> Array:
    """[count] J, of all servos since the state was set."""
    return np.asarray(world.drive_work().sum(axis=1))


def _least(world: World) -> Array:
    """[count] J that are always allowed."""
    per_world = world.features.per_world_parameters
    masses = (world.parameters if per_world else Parameters.of(world.scene, world.count)).mass
    heaviest = masses.max(axis=1)
    return np.maximum(LEAST, heaviest * np.linalg.norm(world.scene.gravity) * LIFT)


class Balance:
    """The balance of `count` worlds.

    Attributes:
        gain: [count] J, energy beyond that at the start and the servos' work, after the last step.
        allowed: [count] J, what the gain may be.
    """

    def __init__(self, world: World) -> None:
        """Begins in the present state of all worlds."""
        self.gain = np.zeros(world.count)
        self._least, self.allowed = _least(world), _least(world)
        self._start, self._work = start_energy(world), np.zeros(world.count)
        self._total = np.zeros(world.count)

    def update(self, world: World, began: Array) -> None:
        """After a step; the balance of worlds of the mask `began` starts again now."""
        stored, done = elastic(world), work(world)
        now = _of_solids(world) + stored
        self._total += np.abs(done - self._work)
        self._work = done
        if began.any():
            self._start[began], self._total[began] = start_energy(world)[began], 0.0
            self._least[began] = _least(world)[began]
        self.gain = now - self._start - done
        oscillates = 0.25 * world.fidelity.contact_resolution**2 * stored
        self.allowed = np.maximum(FRACTION * self._total, self._least) + oscillates
