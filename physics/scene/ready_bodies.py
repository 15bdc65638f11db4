"""Ready bodies of particles: the chess piece and the torus of the first lecture (Harada 2007)."""

import numpy as np

from physics.scene.particles import Particles
from physics.scene.validation import integer, positive


def chess_piece(radius: float) -> Particles:
    """Four balls in a row along z, each touching the next: Harada's chess pieces.

    Args:
        radius: m, of a ball.

    Raises:
        TypeError, ValueError: not a number above zero.
    """
    radius = positive("chess_piece radius", radius)
    heights = radius * np.array([-3.0, -1.0, 1.0, 3.0])
    return Particles([(0.0, 0.0, z) for z in heights.tolist()], radius)


def torus(radius: float, balls: int = 6) -> Particles:
    """Balls on a ring about z, each touching the next: Harada's tori have six.

    Args:
        radius: m, of a ball.
        balls: how many, at least 3.

    Raises:
        TypeError, ValueError: not a number above zero; fewer balls.
    """
    radius = positive("torus radius", radius)
    balls = integer("torus balls", balls, low=3)
    ring = radius / np.sin(np.pi / balls)
    angles = 2.0 * np.pi * np.arange(balls) / balls
    points = ring * np.stack([np.cos(angles), np.sin(angles), np.zeros(balls)], axis=-1)
    return Particles(tuple(map(tuple, points.tolist())), radius)
