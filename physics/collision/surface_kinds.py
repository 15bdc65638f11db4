"""Branches over the kinds of surface, written once.

A kernel that treats kinds of surface differently exists once per kind. Which one runs depends on
the half-pair; which ones are compiled depends on the features.
"""

from physics.jit import stage
from physics.scene.shapes import BOX, CAPSULE, PARTICLES, PLANE, SPHERE


def present_kinds(features):
    """The kinds of surface in a scene, most frequent first."""
    kinds = {
        PLANE: features.plane,
        BOX: features.box,
        SPHERE: features.sphere,
        CAPSULE: features.capsule,
        PARTICLES: features.particles,
    }
    return [kind for kind, present in kinds.items() if present]


def by_surface_kind(features, make):
    """Stage `call(kind, *arguments)` that calls the function of a kind of surface.

    Args:
        features: of the scene.
        make: make(kind) gives the function of a kind, or None where it is never called.
    """
    functions = [(kind, make(kind)) for kind in present_kinds(features)]
    functions = [(kind, function) for kind, function in functions if function is not None]
    call = _last(functions[-1][1] if functions else _nothing)
    for kind, function in reversed(functions[:-1]):
        call = _branch(kind, function, call)
    return call


@stage
def _nothing(*arguments):
    """For a scene in which nothing can touch."""


def _last(function):
    @stage
    def call(kind, *arguments):
        return function(*arguments)

    return call


def _branch(this, function, otherwise):
    @stage
    def call(kind, *arguments):
        if kind == this:
            return function(*arguments)
        return otherwise(kind, *arguments)

    return call
