"""Features: compile-time switches that the engine derives from a scene and a fidelity.

Counts, sizes and material values are not features. Scenes that differ only in these share their
kernels, so a parameter sweep compiles nothing. Scenes whose features differ share the stages that
don't depend on the difference.
"""

from collections.abc import Callable
from functools import wraps
from typing import Any, NamedTuple, TypeVar

# rotation of bodies: none; with equal principal moments of inertia; general; or by the model's
# table, whose column has one of the first three
NO_ROTATION, ISOTROPIC, GENERAL, BY_TABLE = range(4)
# values of `Fidelity.integrator`
MIDPOINT, EULER, RK4, ADAPTIVE = range(4)
# time control, in the order of `fidelity.TIME_CONTROLS`
FIXED, HALVED, BISECTION, ADVANCEMENT, SWEPT = range(5)


class Features(NamedTuple):
    """Compile-time switches. The machine code and the state omit features that are switched off.

    Attributes:
        integrator: MIDPOINT, EULER, RK4 or ADAPTIVE.
        impulse: impulse law instead of the spring law.
        dashpot: linear damping instead of Hunt-Crossley damping.
        friction: at least one pair has friction; adds the tangential law and its history.
        viscous: viscous friction, without history.
        slope: weight can press along a ground or static.
        lever: a ball can touch a body beside its centre, which makes the effective mass smaller.
        resistance: at least one pair has rolling or spinning resistance.
        rotation: NO_ROTATION, ISOTROPIC, GENERAL or BY_TABLE.
        plane, sphere, box, capsule, particles, cylinder, torus: kinds of surface that samples are
            tested against.
        grid: likewise, the distance grid of a mesh.
        axial: some samples turn about their solid's axis, see `collision.facing`.
        mesh: at least one solid is a mesh.
        drives: the scene has drives.
        gripper: at least two of the drives are the fingers of a gripper.
        fields: the scene has fields: springs to points, attractors, drag.
        surface_drag: at least one of them is a surface drag.
        wrench: `World.apply_wrench` has been used, or may be.
        joints: the scene has joints.
        compound: at least one surface is a part of a compound and has its own frame.
        per_world_parameters: masses, materials and sizes can differ between worlds.
        time_control: FIXED, HALVED, BISECTION, ADVANCEMENT or SWEPT.
        measures_work: the work of the servos is summed up, see `World.drive_work`.
        newton: impulses of all contacts are solved together.
    """

    integrator: int
    impulse: bool
    dashpot: bool
    friction: bool
    viscous: bool
    slope: bool
    lever: bool
    resistance: bool
    rotation: int
    plane: bool
    sphere: bool
    box: bool
    capsule: bool
    particles: bool
    cylinder: bool
    torus: bool
    grid: bool
    axial: bool
    mesh: bool
    drives: bool
    gripper: bool
    fields: bool
    surface_drag: bool
    wrench: bool
    joints: bool
    compound: bool
    per_world_parameters: bool
    time_control: int = FIXED
    measures_work: bool = False
    newton: bool = False

    @property
    def finds_impacts(self) -> bool:
        """Whether steps are cut at the times of impacts."""
        return self.time_control in (BISECTION, ADVANCEMENT, SWEPT)


# What general kernels can do, by what a scene has. Each of these leaves every bit of the result of
# a scene that doesn't need it. Left out are resistance and joints among contacts, which cost a
# fifth of the speed and more, and tori and particles, which take long to compile: docs/trade.md
_MOTION = ("drives", "gripper", "fields", "wrench")
_WITH_CONTACTS = (
    "friction", "lever", "plane", "sphere", "box", "capsule", "cylinder", "grid", "axial", "mesh",
    "compound",
)  # fmt: skip
_WITHOUT_CONTACTS = ("surface_drag", "joints")
_KINDS = ("plane", "sphere", "box", "capsule", "particles", "cylinder", "torus", "grid")


def general(needed: Features) -> Features | None:
    """The features of the general kernel for scenes that need these; None if there is none.

    Law, integrator, solver, damping, kind of friction, time control and per-world parameters are
    those needed, because they change results or the layout of the state; so is the rotation of
    Runge-Kutta steps. So there is one general kernel for each combination of them, and one for
    scenes in which nothing can touch.
    """
    touches = any(getattr(needed, name) for name in _KINDS)
    names = (*_MOTION, *(_WITH_CONTACTS if touches else _WITHOUT_CONTACTS))
    others = {*_KINDS, *_WITHOUT_CONTACTS, "resistance", "measures_work"} - {*names}
    if any(getattr(needed, name) for name in others):
        return None
    smooth = needed.impulse or needed.dashpot or needed.viscous
    # Runge-Kutta steps have one rule for all bodies; and time control looks ahead
    still = needed.rotation == NO_ROTATION
    keeps = needed.integrator in (RK4, ADAPTIVE) or (still and needed.time_control != FIXED)
    return needed._replace(
        **dict.fromkeys(names, True),
        slope=touches and not smooth,
        rotation=needed.rotation if keeps else BY_TABLE,
    )


Made = TypeVar("Made")


class _Reader:
    """Features that note which of them are read."""

    def __init__(self, features: Features) -> None:
        self.features = features
        self.read: dict[str, Any] = {}

    def __getattr__(self, name: str) -> Any:
        value = self.read[name] = getattr(self.features, name)
        return value


def cached_by_features(make: Callable[..., Made]) -> Callable[..., Made]:
    """Caches make(features, *others) by `others` and by those features that it reads.

    What `make` reads through the functions that it calls counts as well. Scenes whose features
    differ elsewhere get the same stage, and numba compiles it once for all of them. Not for an
    entry: it is called without a look at the types of its arguments, which depend on all features.
    """
    made: dict[tuple[Any, ...], list[tuple[dict[str, Any], Made]]] = {}

    @wraps(make)
    def cached(features: Any, *others: Any) -> Made:
        caller = features if isinstance(features, _Reader) else _Reader(features)
        actual, known = caller.features, made.setdefault(others, [])
        for read, stage in known:
            if all(getattr(actual, name) == value for name, value in read.items()):
                caller.read.update(read)
                return stage
        reader = _Reader(actual)
        stage = make(reader, *others)
        known.append((reader.read, stage))
        caller.read.update(reader.read)
        return stage

    return cached
