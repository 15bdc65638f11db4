"""The maps: a parameter, the scene that it makes, and when a run counts as drifted."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from physics import Fidelity, Scene, World
from physics.reference.scenes import (
    CUBE,
    block_on_ground,
    heavy_top,
    small_top,
    sphere_on_ground,
    tower,
)

WIDTH = 2.0 * CUBE.half_extents[2]  # m
SLAB, SLIDING = (0.05, 0.05, 0.004), 1.0  # m, half extents; m/s
# of a body's width: how far it may move from where it belongs
FAR = 0.1
# of e, and of the kinetic energy
WRONG = 0.05


@dataclass(frozen=True)
class Map:
    """Runs over a parameter and the substep.

    Attributes:
        name: of the parameter, with its unit.
        values: of the parameter.
        scene: that a value makes.
        drifted: whether a world that didn't diverge isn't where it belongs, after `time`.
        time: s.
        limit: substep in s beyond which theory expects trouble, if it isn't the engine's own.
    """

    name: str
    values: tuple[float, ...]
    scene: Callable[[float], Scene]
    drifted: Callable[[World, float], bool]
    time: float = 1.0
    limit: Callable[[float, Fidelity], float] | None = None


def _moved(world: World, _: float) -> bool:
    """Whether a body isn't where the scene puts it."""
    at = np.array([body.position for body in world.scene.bodies])
    width = min(body.shape.width for body in world.scene.bodies)
    return bool(np.abs(world.position[0] - at).max() > FAR * width)


def _rebound(e: Callable[[float], float], speed: Callable[[float], float]) -> Callable[..., bool]:
    """Whether a ball that hit the ground without gravity has another speed than e says."""

    def drifted(world: World, value: float) -> bool:
        ratio = world.linear_velocity[0, 0, 2] / speed(value)
        return bool(abs(ratio - e(value)) > WRONG)

    return drifted


def _stiff(stiffness: float) -> Scene:
    """A cube lands at 0.1 m/s while it turns, so that its contacts are excited."""
    return block_on_ground(
        stiffness=stiffness, linear_velocity=(0, 0, -0.1), angular_velocity=(0.5, 0.3, 0)
    )  # fmt: skip


def _hit(speed: float, restitution: float = 0.5) -> Scene:
    """A ball of 4 cm at a height of 5 cm, downwards."""
    radius = 0.5 * WIDTH
    return sphere_on_ground(
        radius, 0.0, restitution, gravity=0.0, position=(0, 0, radius + 0.05),
        linear_velocity=(0, 0, -speed),
    )  # fmt: skip


def _slides(friction: float) -> Scene:
    """A slab slides; it is so flat that no friction tips it over."""
    return block_on_ground(SLAB, friction, linear_velocity=(SLIDING, 0.0, 0.0))


def _stopped_elsewhere(world: World, friction: float) -> bool:
    """Whether the slab isn't where Coulomb's friction stops it."""
    time, pull = float(world.time[0]), 9.81 * friction
    stop = min(time, SLIDING / pull) if pull > 0.0 else time
    exact = SLIDING * stop - 0.5 * pull * stop**2
    lifted = world.position[0, 0, 2] - SLAB[2]
    return bool(max(abs(lifted), abs(world.position[0, 0, 0] - exact)) > FAR * 2.0 * SLAB[2])


def _passes_through(speed: float, fidelity: Fidelity) -> float:
    """Substep in which a ball moves by its radius: a longer one can take it past the surface."""
    del fidelity
    return 0.5 * WIDTH / speed


def _logarithmic(low: float, high: float, count: int) -> tuple[float, ...]:
    return tuple(float(f"{v:.3g}") for v in np.geomspace(low, high, count))


MAPS = (
    Map("stiffness, N/m", _logarithmic(1e2, 1e7, 16), _stiff, _moved),
    Map("mass ratio, upper to lower", _logarithmic(1.0, 1e4, 13), heavy_top, _moved),
    Map("size ratio, lower to upper", _logarithmic(1.0, 16.0, 9), small_top, _moved),
    Map(
        "speed of a ball, m/s", _logarithmic(0.1, 1e3, 17), _hit,
        _rebound(lambda _: 0.5, lambda v: v), 0.6, _passes_through,
    ),
    Map(
        "cubes in a tower", (1, 2, 3, 4, 5, 6, 8, 10, 14, 20), lambda n: tower(int(n)), _moved,
        3.0,
    ),
    Map("friction", (0.0, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 1.0, 2.0, 5.0, 10.0), _slides,
        _stopped_elsewhere),
    Map(
        "restitution", tuple(np.round(np.linspace(0.0, 1.0, 11), 2)),
        lambda e: _hit(1.0, e), _rebound(lambda e: e, lambda _: 1.0), 0.6,
    ),
)  # fmt: skip


def at(base: Fidelity, substep: float) -> Fidelity:
    """A fidelity with another substep."""
    return replace(base, substep=substep)
