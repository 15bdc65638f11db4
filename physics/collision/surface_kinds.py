"""Branches over the kinds of surface, written once.

A function that treats kinds of surface differently exists once per kind. Which one runs depends on
the half-pair; which ones are compiled depends on the features.
"""

import inspect
from typing import Any

from physics.compiler.jit import sequence, stage
from physics.scene.shapes import (
    BOX,
    CAPSULE,
    CYLINDER,
    GRID,
    PARTICLES,
    PLANE,
    SPHERE,
    TORUS,
)


def present_kinds(features):
    """The kinds of surface in a scene."""
    kinds = {
        PLANE: features.plane,
        BOX: features.box,
        SPHERE: features.sphere,
        CAPSULE: features.capsule,
        PARTICLES: features.particles,
        CYLINDER: features.cylinder,
        TORUS: features.torus,
        GRID: features.grid,
    }
    return [kind for kind, present in kinds.items() if present]


def by_surface_kind(features, make):
    """Sequence `call(kind, ...)` that calls the function of a kind of surface.

    Its source is generated, with the parameters of those functions. Call it
    well above the loop over lanes: one inlined layer directly around that loop made Push 2.5 times
    slower.

    Args:
        features: of the scene.
        make: make(kind) returns the function of a kind, or None where it is never called. All
            functions have the same parameters.
    """
    made = {kind: make(kind) for kind in present_kinds(features)}
    functions = {f"on_{kind}": function for kind, function in made.items() if function is not None}
    if not functions:
        return _nothing
    parameters = ", ".join(inspect.signature(next(iter(functions.values()))).parameters)
    *first, last = functions
    lines = [f"def enclose({', '.join(functions)}):", f"    def call(kind, {parameters}):"]
    for name in first:
        lines += [
            f"        if kind == {name.removeprefix('on_')}:",
            f"            return {name}({parameters})",
        ]
    lines += [f"        return {last}({parameters})", "    return call"]
    namespace: dict[str, Any] = {"__name__": __name__}
    exec("\n".join(lines), namespace)
    return sequence(namespace["enclose"](**functions))


@stage
def _nothing(*arguments):
    """For a scene in which nothing can touch."""
