"""Rows of the table of fields."""

from typing import Any

import numpy as np

from physics.model.tables import ATTRACTOR, DRAG, FIELD, POINT_SPRING
from physics.scene.fields import Attractor, PointSpring
from physics.scene.scene import Scene

Array = np.ndarray


def field_rows(scene: Scene) -> Array:
    """Rows of FIELD: one per field; a Drag without a body has one for each body."""
    rows = []
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
        else:
            row["kind"], row["damping"], row["quadratic"] = DRAG, field.linear, field.quadratic
            if field.body is None:
                for i in range(len(scene.bodies)):
                    row["body"] = i
                    rows.append(row.copy())
                continue
            row["body"] = scene.body_index(field.body)
        rows.append(row)
    return np.array(rows, dtype=FIELD)
