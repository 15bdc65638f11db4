"""Which kernel advances the worlds of a scene: one made for it, or a general one.

A special kernel has what the scene needs and nothing else. A general kernel can do more, so one
serves nearly all scenes of a law. Both give the same bits; the general one is slower, and a special
one takes seconds to compile.
"""

import os
from collections.abc import Iterable
from typing import Any

import numpy as np

from physics.compiler.jit import LANES, columns, load_all
from physics.model.build import build, expand_per_world
from physics.model.features import Features, general
from physics.model.state import allocate
from physics.model.tables import Model
from physics.model.workspace import Workspace
from physics.scene.fidelity import Fidelity
from physics.scene.scene import Scene
from physics.scene.validation import choice
from physics.step.adaptive_steps import make_adaptive_advance
from physics.step.readout import WIDTH
from physics.step.time_layers import make_advance

KERNELS = ("auto", "general", "special")

# worlds from which on "auto" compiles a special kernel: they run for so long that it pays
MANY_WORLDS = 256


def find_advance(features: Features, fidelity: Fidelity) -> Any:
    """The kernel that advances worlds."""
    if fidelity.tolerance is None:
        return make_advance(features)
    return make_adaptive_advance(features, fidelity.tolerance)


def requested(kernel: str | None, default: str = "auto") -> str:
    """The kind of kernel that is asked for; if None, by RIGID_ENVS_KERNEL, else the default.

    Raises:
        TypeError, ValueError: not one of `KERNELS`.
    """
    if kernel is not None:
        return choice("kernel", kernel, KERNELS)
    return choice("RIGID_ENVS_KERNEL", os.environ.get("RIGID_ENVS_KERNEL", default), KERNELS)


def choose(kernel: str, needed: Features, base: Model, fidelity: Fidelity, count: int) -> Features:
    """The features of the kernel for `count` worlds: `needed`, or more.

    "auto" takes the special kernel for many worlds; for fewer, the special one if it has been
    compiled, else the general one.
    """
    more = general(needed)
    if kernel == "special" or more is None:
        return needed
    if kernel == "auto" and (count >= MANY_WORLDS or is_compiled(needed, base, fidelity)):
        return needed
    return more


def general_is_compiled(scene: Scene, fidelity: Fidelity, per_world_parameters: bool) -> bool:
    """Whether a general kernel that can advance a scene has been compiled."""
    base, needed = build(scene, fidelity, per_world_parameters)
    more = general(needed)
    return more is not None and is_compiled(more, base, fidelity)


def is_compiled(features: Features, base: Model, fidelity: Fidelity) -> bool:
    """Whether the kernel with these features has been compiled, now or by an earlier process."""
    advance = find_advance(features, fidelity)
    if advance.is_loaded():
        return True
    return bool(advance.is_compiled(*_arguments(features, base, fidelity)))


def prepare(features: Features, base: Model, fidelity: Fidelity) -> None:
    """Starts to compile the kernel with these features in a second process, if it has to be."""
    advance = find_advance(features, fidelity)
    if not advance.is_loaded():
        advance.prepare(*_arguments(features, base, fidelity))


def load_kernels(kernels: Iterable[tuple[Features, Model, Fidelity]]) -> None:
    """Makes sure that kernels are compiled, for features, the scene's model and its fidelity."""
    calls: dict[int, tuple[Any, tuple[Any, ...]]] = {}
    for features, base, fidelity in kernels:
        advance = find_advance(features, fidelity)
        if id(advance) not in calls:
            calls[id(advance)] = advance, _arguments(features, base, fidelity)
    load_all(list(calls.values()))


def _arguments(features: Features, base: Model, fidelity: Fidelity) -> tuple[Any, ...]:
    """Arguments of the types that the kernel gets, of one world."""
    model = expand_per_world(base, LANES) if features.per_world_parameters else base
    state, workspace = allocate(base, features, 1), Workspace.of(base, features)
    table, everyone = columns((len(base.dynamic), WIDTH), 1, float), np.ones(1, dtype=bool)
    return model, state, workspace, table, everyone, 0, 1, fidelity.substep, 1, 1
