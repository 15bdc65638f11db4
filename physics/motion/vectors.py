"""Products of vectors and matrices whose entries stand in lanes."""

from physics.jit import stage


@stage
def turned(R, i, x, y, z):
    """A vector of the frame R of lane i in the world frame."""
    return (
        R[0, i] * x + R[1, i] * y + R[2, i] * z,
        R[3, i] * x + R[4, i] * y + R[5, i] * z,
        R[6, i] * x + R[7, i] * y + R[8, i] * z,
    )


@stage
def turned_back(R, i, x, y, z):
    """A vector of the world frame in the frame R of lane i."""
    return (
        R[0, i] * x + R[3, i] * y + R[6, i] * z,
        R[1, i] * x + R[4, i] * y + R[7, i] * z,
        R[2, i] * x + R[5, i] * y + R[8, i] * z,
    )


@stage
def times(entry, i, x, y, z):
    """A symmetric tensor times a vector, in lane i."""
    return (
        entry[0, i] * x + entry[3, i] * y + entry[4, i] * z,
        entry[3, i] * x + entry[1, i] * y + entry[5, i] * z,
        entry[4, i] * x + entry[5, i] * y + entry[2, i] * z,
    )


@stage
def cross(ax, ay, az, bx, by, bz):
    """The vector product."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
