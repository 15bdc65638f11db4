"""The fidelities that `tune` tries: families of one choice each, from long to short steps."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from physics.scene.drives import Drive
from physics.scene.fidelity import FIND_IMPACTS, NEWTON, PRESETS, Fidelity
from physics.scene.scene import Scene
from physics.scene.solids import Body, Ground, touch_each_other
from physics.tuning.motion import FRAME

# substeps per frame of 40 ms: 1, then two or three values per octave up to 62.5 us
COUNTS = (1, 2, 3, 4, 6, 8, 10, 14, 20, 28, 40, 56, 80, 112, 160, 224, 320, 448, 640)
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
_COLLISION_STEP = 0.01  # s, at most, between two regular broadphases, as in the presets


class Family(NamedTuple):
    """Fidelities that differ only in how long their steps are.

    Attributes:
        name: what they have in common.
        members: from the longest step to the shortest, which is from cheap to expensive.
    """

    name: str
    members: tuple[Fidelity, ...]


def can_touch(scene: Scene) -> bool:
    """Whether any two solids of a scene can touch, one of which moves."""
    moving = [*scene.bodies, *scene.driven_bodies]
    solids = [*moving, *scene.statics]
    return any(
        touch_each_other(a, b)
        for i, a in enumerate(moving)
        for b in solids[i + 1 :]
    )  # fmt: skip


def safe_speed(scene: Scene, fidelity: Fidelity) -> tuple[float, float]:
    """m/s above which a body may pass through a solid in a substep, and the thinnest width in m.

    Half a width per substep: the next sample lies where the surface pushes back to the side that
    the body came from. Infinite where nothing can touch or impacts are found within a step.
    """
    if fidelity.time_control in FIND_IMPACTS:
        return math.inf, math.inf
    moving: list[Body | Drive] = [*scene.bodies, *scene.driven_bodies]
    # alike solids count once; the ground has no other side
    others = [solid for solid in scene.statics if not isinstance(solid, Ground)]
    kinds = {(s.shape, s.group, s.mask): s for s in moving}
    twice = [s for s in moving if s is not kinds[s.shape, s.group, s.mask]]
    second = {(s.shape, s.group, s.mask): s for s in (*twice, *others)}
    thin = min(
        (
            min(a.shape.width, b.shape.width)
            for a in kinds.values()
            for b in (*kinds.values(), *second.values())
            if a is not b and touch_each_other(a, b)
        ),
        default=math.inf,
    )
    return 0.5 * thin / fidelity.substep, thin


def with_substep(fidelity: Fidelity, substep: float) -> Fidelity:
    """A fidelity with another substep, and collision steps of at most 10 ms."""
    substeps = max(1, math.floor(_COLLISION_STEP / substep * (1.0 + 1e-9)))
    return replace(fidelity, substep=substep, collision_substeps=substeps)


def families(scene: Scene) -> Iterator[Family]:
    """Every family that can simulate a scene."""
    spring, impulse = PRESETS["balanced"], PRESETS["solid"]
    if can_touch(scene):
        bases = {
            "springs": spring,
            "springs, spacing 1": replace(spring, spacing=1.0),
            "springs, spacing 0.25": replace(spring, spacing=0.25),
            "springs, 0.2 rad per step": replace(spring, contact_resolution=0.2),
            "springs, linear dashpot": replace(spring, damping="dashpot"),
            "springs, viscous friction": replace(spring, friction="viscous"),
            "impulses": impulse,
            "impulses, spacing 1": replace(impulse, spacing=1.0),
            "impulses, 1 rad per step": replace(impulse, contact_resolution=1.0),
            "impulses, swept": replace(impulse, time_control="swept"),
            "impulses, Newton": NEWTON,
        }
    else:
        bases = {
            "midpoint": spring,
            "Euler": replace(spring, integrator="euler"),
            "RK4": replace(spring, integrator="rk4"),
        }
    for name, base in bases.items():
        yield Family(name, tuple(with_substep(base, FRAME / n) for n in COUNTS))
    if not can_touch(scene):
        members = (
            Fidelity(integrator="adaptive", tolerance=tolerance, substep=FRAME)
            for tolerance in TOLERANCES
        )
        yield Family("adaptive", tuple(members))
