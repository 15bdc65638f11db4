"""Products of 3-vectors, rotation matrices and symmetric tensors whose entries stand in lanes."""

from physics.compiler.jit import at, stage


@stage
def cross(ax, ay, az, bx, by, bz):
    """The cross product a x b."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@stage
def rotated(R, i, x, y, z):
    """R v: a vector of the frame R (rows in [9, LANES]) in the frame that R rotates into."""
    return (
        R[0, i] * x + R[1, i] * y + R[2, i] * z,
        R[3, i] * x + R[4, i] * y + R[5, i] * z,
        R[6, i] * x + R[7, i] * y + R[8, i] * z,
    )


@stage
def rotated_at(R, i, v):
    """R v of a constant v: one vector [3], or one per lane [3, LANES]."""
    return rotated(R, i, at(v[0], i), at(v[1], i), at(v[2], i))


@stage
def rotated_back(R, i, x, y, z):
    """R^T v: the inverse of `rotated`."""
    return (
        R[0, i] * x + R[3, i] * y + R[6, i] * z,
        R[1, i] * x + R[4, i] * y + R[7, i] * z,
        R[2, i] * x + R[5, i] * y + R[8, i] * z,
    )


@stage
def tensor_times(entry, i, x, y, z):
    """A symmetric tensor (xx yy zz xy xz yz in [6, LANES]) times a vector."""
    return (
        entry[0, i] * x + entry[3, i] * y + entry[4, i] * z,
        entry[3, i] * x + entry[1, i] * y + entry[5, i] * z,
        entry[4, i] * x + entry[5, i] * y + entry[2, i] * z,
    )
