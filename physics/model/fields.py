"""Rows of the table of fields."""

from typing import Any

import numpy as np

from physics.model.tables import ATTRACTOR, DRAG, FIELD, POINT_SPRING, SURFACE_DRAG
from physics.scene.fields import Attractor, PointSpring, SurfaceDrag
from physics.scene.scene import Scene
from physics.scene.surface_points import surface_points

Array = np.ndarray


def field_rows(scene: Scene) -> tuple[Array, Array]:
    """Rows of FIELD: one per field, or one for each body; and columns of Model.surface_point.

    A Drag or SurfaceDrag without a body has one row for each body.
    """
    rows, blocks, first = [], [np.zeros((7, 0))], 0
    for field in scene.fields:
        row: Any = np.zeros(1, dtype=FIELD)[0]
        row["other"] = -1
        if isinstance(field, PointSpring):
            row["kind"], row["body"] = POINT_SPRING, scene.body_index(field.body)
            row["stiffness"], row["damping"] = field.stiffness, field.damping
            row["rest_length"], row["point"] = field.rest_length, field.point
            if isinstance(field.to, int | str):
                row["other"], row["to"] = scene.body_index(field.to), field.to_point
            else:
                row["to"] = field.to
        elif isinstance(field, Attractor):
            row["kind"], row["to"] = ATTRACTOR, field.position
            row["strength"], row["exponent"] = field.strength, field.exponent
            row["per_particle"] = field.per_particle
        elif isinstance(field, SurfaceDrag):
            row["kind"], row["flow"] = SURFACE_DRAG, field.flow
            row["pressure"] = 0.5 * field.density * field.coefficient
            row["tangential"] = 0.5 * field.density * field.friction
            everyone = range(len(scene.bodies))
            for i in everyone if field.body is None else [scene.body_index(field.body)]:
                shape = scene.bodies[i].shape
                points = surface_points(shape, field.points)
                row["body"], row["unit_inertia"] = i, shape.inertia(1.0)[0]
                row["first_point"], row["point_count"] = first, len(points.areas)
                first += len(points.areas)
                blocks.append(
                    np.concatenate([points.positions.T, points.normals.T, [points.areas]])
                )
                rows.append(row.copy())
            continue
        else:
            row["kind"], row["damping"], row["quadratic"] = DRAG, field.linear, field.quadratic
            if field.body is None:
                for i in range(len(scene.bodies)):
                    row["body"] = i
                    rows.append(row.copy())
                continue
            row["body"] = scene.body_index(field.body)
        rows.append(row)
    return np.array(rows, dtype=FIELD), np.concatenate(blocks, axis=1)
