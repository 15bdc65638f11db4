"""Meshes of common objects for the tests: a plate with holes, a tray, a wheel."""

import numpy as np

from physics.reference import meshes


def holed_plate(size=(0.1, 0.067, 0.0042), columns=4, rows=3, around=16):
    """A plate with round holes in a grid; size in m."""
    x, y, z = size
    cell = np.array((x / columns, y / rows))
    angle = 2.0 * np.pi * np.arange(around) / around + np.pi / 4.0
    way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    square = way / np.abs(way).max(axis=1, keepdims=True) * cell / 2.0
    hole = 0.3 * cell.min() * way
    vertices, faces = [], []
    for i in range(columns):
        for j in range(rows):
            centre = (np.array((i, j)) + 0.5) * cell - np.array((x, y)) / 2.0
            first = len(vertices)
            for ring, height in ((square, z), (hole, z), (square, -z), (hole, -z)):
                vertices += [(*(centre + p), height / 2.0) for p in ring]
            top, inner, bottom, below = (first + k * around for k in range(4))
            for k in range(around):
                m = (k + 1) % around
                quads = [(top + k, top + m, inner + m, inner + k)]
                quads += [(bottom + k, below + k, below + m, bottom + m)]
                quads += [(inner + k, inner + m, below + m, below + k)]
                middle = np.abs(centre + 0.5 * (square[k] + square[m]))
                if np.any(np.abs(middle - np.array((x, y)) / 2.0) < 1e-9):
                    quads += [(top + k, bottom + k, bottom + m, top + m)]
                faces += [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return np.array(vertices).round(12), np.array(faces)


def tray(size=(0.08, 0.058, 0.0056), wall=0.004, floor=0.002, corner=0.01, steps=8):
    """A plate with round corners and a pocket; lengths in m."""
    x, y, z = np.array(size) / 2.0

    def outline(x, y, radius):
        angle = np.linspace(0.0, np.pi / 2.0, steps + 1)
        signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
        return [
            (a * (x - radius) + radius * np.cos(t), b * (y - radius) + radius * np.sin(t))
            for k, (a, b) in enumerate(signs)
            for t in angle + k * np.pi / 2.0
        ]

    outside, inside = outline(x, y, corner), outline(x - wall, y - wall, corner - wall)
    rings = [(outside, -z), (outside, z), (inside, z), (inside, floor - z)]
    return meshes.tube(np.array([[(*p, height) for p in ring] for ring, height in rings]))


def wheel(diameter=0.13, width=0.04, fillet=0.006, around=48):
    """A disc with rounded edges; lengths in m."""
    radius, half, angle = (
        diameter / 2.0 - fillet,
        width / 2.0 - fillet,
        np.linspace(0, np.pi / 2, 5),
    )
    lower = np.stack([radius + fillet * np.sin(angle), -half - fillet * np.cos(angle)], axis=1)
    upper = np.stack([radius + fillet * np.cos(angle), half + fillet * np.sin(angle)], axis=1)
    ends = np.array([[0.0, -width / 2.0]]), np.array([[0.0, width / 2.0]])
    return meshes.revolved(np.concatenate([ends[0], lower, upper, ends[1]]), around)
