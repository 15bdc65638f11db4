"""Rows of the table of distance grids, and the values at their nodes."""

from typing import Any

import numpy as np

from physics.model.pairs import Layout
from physics.model.tables import GRID_TABLE

Array = np.ndarray


def grid_rows(layout: Layout) -> tuple[Array, Array, Array]:
    """Grids of all meshes that are surfaces, once each.

    Returns:
        [k] index of each half-pair's grid, or -1; rows of GRID_TABLE; values of all grids in m.
    """
    index = np.full(len(layout.half_pairs), -1)
    rows: list[Any] = []
    values: list[Array] = [np.zeros(0)]
    known: dict[Any, int] = {}
    for k, half_pair in enumerate(layout.half_pairs):
        mesh = half_pair.surface.mesh
        if mesh is None:
            continue
        if mesh not in known:
            known[mesh], grid = len(rows), mesh.grid
            row: Any = np.zeros(1, dtype=GRID_TABLE)[0]
            first = sum(map(len, values))
            row["first"], row["count"] = first, grid.values.shape
            row["first_point"], row["point_count"] = first + grid.values.size, len(grid.points)
            row["origin"], row["cell"] = mesh.scale * grid.origin, mesh.scale * grid.cell
            row["low"], row["high"] = mesh.scale * grid.low, mesh.scale * grid.high
            rows.append(row)
            values += [mesh.scale * grid.values.ravel(), mesh.scale * grid.points.ravel()]
        index[k] = known[mesh]
    return index, np.array(rows, dtype=GRID_TABLE), np.concatenate(values)
