"""Kinds of solids and of pairs: what pairs of a scene have in common.

Bodies that agree in shape, mass, material and filter are of one kind. The pairs of two kinds touch
in the same way, with the same coefficients: those of a scene that has one solid of each. So each
kind of pair is built once, as a scene of two solids, however many bodies there are.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from physics.manybody.tables import PAIR_KIND
from physics.model.build import build, couplings
from physics.model.features import GENERAL, Features
from physics.model.tables import Model
from physics.scene.drives import Drive
from physics.scene.fidelity import Fidelity
from physics.scene.flush_statics import join_flush
from physics.scene.scene import Scene
from physics.scene.solids import Body, Ground, Static, touch_each_other
from physics.scene.validation import ZERO

Array = np.ndarray
Solid = Body | Drive | Static | Ground


class Kinds(NamedTuple):
    """The kinds of a scene's solids and pairs.

    Attributes:
        of_solid: [solids] kind of each: of the bodies, the drives, then of the statics.
        pair: [kinds, kinds] row of `pair_kind`; -1 where solids can't touch. Symmetric.
        pair_kind: of PAIR_KIND.
        model: tables of all kinds of pairs, one after the other; of each two solids, 0 and 1.
        features: what any of them needs.
    """

    of_solid: Array
    pair: Array
    pair_kind: Array
    model: Model
    features: Features


def find_kinds(scene: Scene, fidelity: Fidelity) -> Kinds:
    """The kinds of a scene's solids."""
    solids: list[Solid] = [*scene.bodies, *scene.driven_bodies, *join_flush(scene.statics)]
    known: dict[Any, int] = {}
    of_solid = np.array([known.setdefault(_identity(solid), len(known)) for solid in solids])
    examples = [solids[int(np.argmax(of_solid == kind))] for kind in range(len(known))]
    pair = np.full((len(known), len(known)), -1)
    counts = np.bincount(of_solid)
    rows: list[tuple[int, ...]] = []
    built: list[tuple[Model, Features]] = []
    sizes = np.zeros(3, dtype=int)  # half-pairs, samples, parts so far
    for i, a in enumerate(examples):
        if isinstance(a, Static | Ground):
            break
        for j in range(i, len(examples)):
            b = examples[j]
            if not touch_each_other(a, b) or (i == j and counts[i] < 2):
                continue
            model, features = build(_scene_of_two(scene, a, b), fidelity, own_spacing=True)
            if not len(model.half_pair):
                continue
            pair[i, j] = pair[j, i] = len(rows)
            half_pairs, _, parts = (int(n) for n in sizes)
            slots = int(model.half_pair["slot_count"].sum())
            counted = len(model.half_pair), slots, parts, len(model.compound_part)
            rows.append((half_pairs, *counted, 2 * len(rows)))
            built.append((model, features))
            sizes += (len(model.half_pair), model.sample.shape[1], len(model.compound_part))
    if not built:
        body = scene.bodies[0]
        model, features = build(_scene_of_two(scene, body, body), fidelity)
        empty = np.zeros(0, PAIR_KIND)
        model = model._replace(half_pair=model.half_pair[:0])
        return Kinds(of_solid, pair, empty, model, _united([features], scene))
    return Kinds(
        of_solid,
        pair,
        np.array(rows, dtype=PAIR_KIND),
        _joined([model for model, _ in built]),
        _united([features for _, features in built], scene),
    )


def _identity(solid: Solid) -> Any:
    """What solids of one kind have in common."""
    if isinstance(solid, Ground):
        return "ground", solid.height, solid.material, solid.group, solid.mask
    shared = (solid.shape, solid.material, solid.group, solid.mask)
    if isinstance(solid, Static):
        return "static", *shared
    return "body" if isinstance(solid, Body) else "drive", solid.mass, *shared


def _scene_of_two(scene: Scene, a: Solid, b: Solid) -> Scene:
    """One solid of each kind, at rest."""
    bodies, drives, statics = [], [], []
    for solid in (a, b):
        if isinstance(solid, Body):
            still = {"linear_velocity": ZERO, "angular_velocity": ZERO, "name": None}
            bodies.append(replace(solid, density=None, **still))  # type: ignore[arg-type]
        elif isinstance(solid, Drive):
            drives.append(replace(solid, name=None))
        else:
            statics.append(replace(solid, name=None))
    return Scene(bodies=bodies, drives=drives, statics=statics, gravity=scene.gravity)


def _joined(models: list[Model]) -> Model:
    """The tables of several models one after the other, with indices into the joined tables.

    Indices between the half-pairs of a pair, and of their slots, stay those of the pair alone.
    """
    samples = points = values = grids = faces = 0
    tables = []
    for model in models:
        half_pair, part = model.half_pair.copy(), model.compound_part.copy()
        grid = model.grid.copy()
        half_pair["first_sample"] += samples
        half_pair["first_partner"] += samples
        half_pair["grid"] += np.where(half_pair["grid"] >= 0, grids, 0)
        part["first_hidden_face"] += faces
        grid["first"] += values
        grid["first_point"] += values
        tables.append((half_pair, part, grid))
        samples += model.sample.shape[1]
        points += model.surface_point.shape[1]
        values += len(model.grid_value)
        grids += len(model.grid)
        faces += len(model.hidden_face)
    half_pairs, parts, rows = (np.concatenate(column) for column in zip(*tables, strict=True))
    first = models[0]
    dynamic = np.zeros(2 * len(models), first.dynamic.dtype)  # zero where a solid is static
    for n, model in enumerate(models):
        dynamic[2 * n : 2 * n + len(model.dynamic)] = model.dynamic
    return first._replace(
        dynamic=dynamic,
        half_pair=half_pairs,
        compound_part=parts,
        hidden_face=np.concatenate([model.hidden_face for model in models]),
        static=np.zeros((0, 7)),
        sample=np.ascontiguousarray(np.concatenate([model.sample for model in models], axis=1)),
        grid=rows,
        grid_value=np.concatenate([model.grid_value for model in models]),
    )


def _united(all_features: list[Features], scene: Scene) -> Features:
    """What any of several scenes of two solids needs, and what couples the bodies of a scene."""
    values: dict[str, Any] = {}
    for name in Features._fields:
        each = [getattr(features, name) for features in all_features]
        values[name] = max(each)
    return Features(**values)._replace(rotation=GENERAL, **couplings(scene))
