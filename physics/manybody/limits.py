"""Checks before the first step that the substep is short enough for a world of many bodies."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, cast

import numpy as np

from physics.analysis.step_limits import check_step
from physics.analysis.time_control_limits import check_time_control
from physics.manybody.kinds import Kinds
from physics.model.build import build
from physics.scene.drives import Drive
from physics.scene.fidelity import Fidelity
from physics.scene.scene import Scene
from physics.scene.solids import Body, touch_each_other

Array = np.ndarray

# the fields of a mechanism, and the mechanism as a scene of its own
Checked = tuple[list[int], Scene]

# solids that can touch a body at once, see `analysis.stability`
_NEIGHBOURS = 6
# kinds of the lightest and of the heaviest bodies that are checked where there are many
_MOST = 8


def check_crowd(
    scene: Scene, fidelity: Fidelity, of_solid: Array, mechanisms: tuple[Checked, ...] = ()
) -> None:
    """Raises an error if the substep is too long for a scene of many bodies.

    What limits a step are the kinds of bodies that touch each other, not their number. So each kind
    is checked on the statics, and, if a material gives a stiffness, between six of each kind that
    it can touch. Of many kinds those with the lightest bodies are checked, and those with the
    heaviest beside them. Servos and fields are checked in the mechanisms.

    Args:
        scene: what is in each world.
        fidelity: of the physics.
        of_solid: [solids] kind of each: bodies, drives, statics.
        mechanisms: see `Mechanisms.checked`.

    Raises:
        ValueError: see `analysis.step_limits.check_step`.
    """
    solids = (*scene.bodies, *scene.driven_bodies, *scene.statics)
    stiff = any(solid.material.stiffness is not None for solid in solids)
    for few in neighbourhoods(scene, of_solid, stiff):
        check_step(few, fidelity, *build(few, fidelity, own_spacing=True))
    for fields, mechanism in mechanisms if scene.fields or scene.drives else ():
        _check_mechanism(scene, fidelity, fields, mechanism)


def neighbourhoods(scene: Scene, of_solid: Array, crowded: bool) -> Iterator[Scene]:
    """Each kind of body on the statics; if `crowded` also between six of each that it can touch.

    Of many kinds only the lightest and the heaviest. `of_solid`: see `check_crowd`.
    """
    dynamic: list[Body | Drive] = [*scene.bodies, *scene.driven_bodies]
    found, first = np.unique(of_solid[: len(dynamic)], return_index=True)
    by_mass = sorted(first.tolist(), key=lambda n: cast(float, dynamic[n].mass))
    if len(found) > 2 * _MOST:
        by_mass = [*by_mass[:_MOST], *by_mass[-_MOST:]]
    known = {int(kind): n for n, kind in enumerate(of_solid[len(dynamic) :])}
    statics = [scene.statics[n] for n in sorted(known.values())]
    for n in by_mass:
        own = _named(dynamic[n], scene.solid_names[n])
        yield _scene_of([own], statics, scene)
        for m in by_mass if crowded else ():
            if touch_each_other(own, dynamic[m]):
                around = _named(dynamic[m], None)
                yield _scene_of([own, *([around] * _NEIGHBOURS)], statics, scene)


def check_impacts(scene: Scene, fidelity: Fidelity, kinds: Kinds) -> None:
    """Raises an error if times of impact can't be found, see `check_time_control`."""
    names = np.empty((len(kinds.model.half_pair), 2), dtype=object)
    for i, j in np.argwhere(kinds.pair >= 0):
        row = kinds.pair_kind[kinds.pair[i, j]]
        first, last = row["first_half_pair"], row["first_half_pair"] + row["half_pair_count"]
        # of two solids of one kind the first and the last
        pair = int(np.argmax(kinds.of_solid == i)), int(np.flatnonzero(kinds.of_solid == j)[-1])
        if i <= j:
            for side, solid in enumerate(("owner", "surface")):
                of_side = kinds.model.half_pair[solid][first:last]
                names[first:last, side] = [scene.solid_names[pair[n]] for n in of_side]
    check_time_control(scene, fidelity, kinds.model.half_pair, names, kinds.features)


def _check_mechanism(scene: Scene, fidelity: Fidelity, fields: list[int], part: Scene) -> None:
    """Checks servos and fields; contacts are checked by kind, so here no solids touch."""
    quiet = replace(
        part,
        bodies=[replace(body, density=None, mask=0) for body in part.bodies],
        drives=[replace(drive, mask=0) for drive in part.drives],
    )
    try:
        check_step(quiet, fidelity, *build(quiet, fidelity))
    except ValueError as error:
        message = str(error)
        for k, n in enumerate(fields):  # as they are numbered in the whole scene
            own = f"Scene.fields[{k}], {part.fields[k]!r},"
            message = message.replace(own, f"Scene.fields[{n}], {scene.fields[n]!r},")
        raise ValueError(message) from None


def _named(solid: Body | Drive, name: str | None) -> Body | Drive:
    if isinstance(solid, Body):
        return replace(solid, name=name, density=None)
    return replace(solid, name=name)


def _scene_of(dynamic: list[Body | Drive], statics: list[Any], scene: Scene) -> Scene:
    bodies = [solid for solid in dynamic if isinstance(solid, Body)]
    drives = [solid for solid in dynamic if isinstance(solid, Drive)]
    return Scene(bodies=bodies, drives=drives, statics=statics, gravity=scene.gravity)
