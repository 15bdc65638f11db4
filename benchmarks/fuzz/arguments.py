"""Constructors with garbage: every error must be a TypeError or ValueError that names the field.

Or another field of the same class, where both disagree; or a MemoryError that says what is free.
"""

import re
from collections.abc import Callable
from typing import Any

import numpy as np

from physics import (
    Attractor,
    BallJoint,
    Body,
    Box,
    Capsule,
    Compound,
    Cylinder,
    Distance,
    Drag,
    Drive,
    Fidelity,
    Gripper,
    Ground,
    Hinge,
    Material,
    Motor,
    Part,
    Particles,
    PointSpring,
    Scene,
    Slider,
    Sphere,
    Static,
    SurfaceDrag,
    Torus,
    Weld,
    World,
)

GARBAGE: tuple[Any, ...] = (
    float("nan"), float("inf"), -float("inf"), -1.0, -1, 0, 0.0, 1e308, -1e308, 5e-324, 10**400,
    -(10**400), 2**63, True, False, None, "", "x", "nan", b"x", [], [1.0], [1.0, 2.0, 3.0],
    [float("nan")] * 3, [1.0] * 4, [0.0] * 4, ["a", "b", "c"], [None] * 3, [10**400] * 3, {}, set(),
    object(), 1j, np.float32("nan"), np.array([1.0, 2.0, 3.0]), np.array(3.0), np.array([]),
    np.array(["x"]), int, print, [[1.0], [2.0, 3.0]], ((),), Sphere, Sphere(1.0), Material(),
)  # fmt: skip
_CUBE = Box((1.0, 1.0, 1.0))
_PAIR = Scene([Body(_CUBE, mass=1.0, position=(0, 0, 3.0 * i)) for i in range(2)], [Ground()])


def _world_of(**scene: Any) -> World:
    return World(Scene(**{"bodies": _PAIR.bodies, **scene}))


# constructor, and arguments that it accepts
CONSTRUCTORS: tuple[tuple[Callable[..., Any], dict[str, Any]], ...] = (
    (Sphere, {"radius": 1.0}),
    (Box, {"half_extents": (1.0, 1.0, 1.0)}),
    (Capsule, {"radius": 1.0, "half_length": 1.0}),
    (Cylinder, {"radius": 1.0, "half_length": 1.0}),
    (Torus, {"major_radius": 2.0, "minor_radius": 1.0}),
    (Particles, {"positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "radius": 0.5}),
    (Part, {"shape": _CUBE, "position": (0, 0, 0), "orientation": (0, 0, 0, 1)}),
    (Compound, {"parts": [(_CUBE, (0, 0, 0))]}),
    (Material, {"friction": 0.5, "restitution": 0.5, "stiffness": 1.0, "rolling_resistance": 0.0,
                "spinning_resistance": 0.0}),
    (Body, {"shape": _CUBE, "mass": 1.0, "position": (0, 0, 0), "orientation": (0, 0, 0, 1),
            "linear_velocity": (0, 0, 0), "angular_velocity": (0, 0, 0), "material": Material(),
            "name": "a", "group": 1, "mask": 1}),
    (Static, {"shape": _CUBE, "position": (0, 0, 0), "orientation": (0, 0, 0, 1),
              "material": Material(), "name": "a", "group": 1, "mask": 1}),
    (Ground, {"material": Material(), "height": 0.0, "name": "a", "group": 1, "mask": 1}),
    (Drive, {"shape": _CUBE, "mass": 1.0, "force_limit": 1.0, "position": (0, 0, 0),
             "orientation": (0, 0, 0, 1), "frequency": 1.0, "damping_ratio": 1.0,
             "material": Material(), "name": "a", "group": 1, "mask": 1}),
    (Gripper, {"shape": _CUBE, "mass": 1.0, "force_limit": 1.0, "grip_limit": 1.0,
               "position": (0, 0, 0), "distance": 1.0, "orientation": (0, 0, 0, 1),
               "frequency": 1.0, "damping_ratio": 1.0, "material": Material(), "name": "a",
               "group": 1, "mask": 1}),
    (PointSpring, {"body": 0, "stiffness": 1.0, "damping": 0.0, "rest_length": 0.0,
                   "point": (0, 0, 0), "to": (0, 0, 0), "to_point": (0, 0, 0)}),
    (Attractor, {"position": (0, 0, 0), "strength": 1.0, "exponent": 2.0, "per_particle": False}),
    (Drag, {"linear": 1.0, "quadratic": 0.0, "body": 0}),
    (SurfaceDrag, {"density": 1.0, "coefficient": 1.0, "friction": 0.0, "flow": (0, 0, 0),
                   "body": 0, "points": 10}),
    (Motor, {"force_limit": 1.0, "velocity": 0.0, "position": 0.0, "frequency": 1.0}),
    (BallJoint, {"a": 0, "b": 1, "anchor": (0, 0, 0), "collide": False, "name": "a"}),
    (Hinge, {"a": 0, "b": 1, "anchor": (0, 0, 0), "axis": (0, 0, 1), "limits": (-1.0, 1.0),
             "motor": Motor(1.0), "collide": False, "name": "a"}),
    (Slider, {"a": 0, "b": 1, "axis": (0, 0, 1), "anchor": (0, 0, 0), "limits": (-1.0, 1.0),
              "motor": Motor(1.0), "collide": False, "name": "a"}),
    (Weld, {"a": 0, "b": 1, "anchor": (0, 0, 0), "collide": False, "name": "a"}),
    (Distance, {"a": 0, "b": 1, "length": 3.0, "anchor": (0, 0, 0), "to_anchor": (0, 0, 3.0),
                "collide": False, "name": "a"}),
    (Scene, {"bodies": _PAIR.bodies, "statics": (), "drives": (), "gravity": (0, 0, -9.81),
             "fields": (), "joints": ()}),
    (Fidelity, {"law": "spring", "geometry": "shape", "damping": "hunt_crossley",
                "friction": "coulomb", "substep": 1e-3, "collision_substeps": 5,
                "contact_resolution": 0.5, "spacing": 0.5, "rounding": 0.025, "skin": 0.1,
                "integrator": "midpoint", "tolerance": None, "time_control": "fixed",
                "courant": 0.5, "impact_tolerance": 1e-6, "solver": "gauss_seidel"}),
    (World, {"scene": _PAIR, "fidelity": "balanced", "count": 1, "threads": 1,
             "allow_unstable": False, "per_world_parameters": False, "measure_work": False}),
)  # fmt: skip


def findings() -> tuple[int, list[str]]:
    """Number of calls, and what is wrong with the errors of some of them."""
    calls, wrong = 0, []
    for constructor, valid in CONSTRUCTORS:
        name = getattr(constructor, "__name__", str(constructor))
        for field in valid:
            for value in GARBAGE:
                calls += 1
                given = f"{name}({field}={str(value)[:40]})"
                try:
                    constructor(**{**valid, field: value})
                except (TypeError, ValueError) as error:
                    named = re.search(rf"\b{field}\b", str(error))
                    if not named and f"{name}." not in str(error):
                        wrong.append(f"{given}: does not name the field: {error}"[:300])
                except MemoryError as error:  # says what is needed and what is free
                    if "memory are free" not in str(error):
                        wrong.append(f"{given}: {error}"[:300])
                except Exception as error:
                    wrong.append(f"{given}: {type(error).__name__}: {error}"[:300])
    return calls, wrong
