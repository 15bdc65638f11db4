"""Between the state that users see, body by body, and blocks of bodies."""

from functools import cache

from physics.compiler.jit import LANES, entry
from physics.manybody.blocks import blocks_of, make_place_group, write_tensors
from physics.model.features import Features
from physics.motion.kinematics import write_rotation
from physics.step.time_layers import LARGEST


@cache
def make_load_bodies():
    """Entry point that loads the dynamic bodies of world w into their blocks, copies included."""

    @entry
    def load_bodies(dynamic, w, crowd):
        for p in range(crowd.body.shape[0]):
            body = crowd.body[p]
            if body < 0:
                continue
            row, solid, i = dynamic[w, body], crowd.solid[p // LANES], p % LANES
            for c in range(3):
                solid.position[c, i] = row.position[c]
                solid.momentum[c, i] = row.momentum[c]
                solid.angular_momentum[c, i] = row.angular_momentum[c]
                solid.force[c, i] = row.force[c]
                solid.torque[c, i] = row.torque[c]
                solid.reference[c, i] = row.reference[c]
                solid.reference_velocity[c, i] = row.reference_velocity[c]
            solid.reference_time[i] = row.reference_time
            for c in range(4):
                solid.orientation[c, i] = row.orientation[c]
            if crowd.constants[p // LANES].is_body == 0:  # a drive, which never rotates
                write_rotation(solid, i)

    return load_bodies


@cache
def make_store_bodies():
    """Entry point that stores the bodies of world w, with quaternions of w >= 0."""

    @entry
    def store_bodies(dynamic, w, crowd):
        """Returns the index plus 1 of the first body that isn't finite; 0 if all are."""
        diverged = 0
        for body in range(crowd.place.shape[0]):
            p = crowd.place[body]
            row, solid, i = dynamic[w, body], crowd.solid[p // LANES], p % LANES
            total = 0.0
            for c in range(3):
                row.position[c] = solid.position[c, i]
                row.momentum[c] = solid.momentum[c, i]
                row.angular_momentum[c] = solid.angular_momentum[c, i]
                row.force[c] = solid.force[c, i]
                row.torque[c] = solid.torque[c, i]
                row.reference[c] = solid.reference[c, i]
                total += abs(row.position[c]) + abs(row.momentum[c]) + abs(row.angular_momentum[c])
            row.reference_time = solid.reference_time[i]
            sign = -1.0 if solid.orientation[3, i] < 0.0 else 1.0
            for c in range(4):
                row.orientation[c] = sign * solid.orientation[c, i]
            if diverged == 0 and not total < LARGEST:
                diverged = body + 1
        return diverged

    return store_bodies


@cache
def make_place_bodies(features: Features):
    """Entry point that writes the frames and tensors of bodies at rest in their blocks."""
    place_group = make_place_group(features)

    @entry
    def place_bodies(model, workspace, crowd):
        for g in range(crowd.group.shape[0]):
            place_group(model, workspace, crowd, g)
            for m in blocks_of(crowd, g):
                write_tensors(crowd, m)

    return place_bodies
