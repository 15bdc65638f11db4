"""Kick: momenta change by the present forces over a time."""

from physics.compiler.jit import LANES, stage
from physics.model.features import BY_TABLE, NO_ROTATION, cached_by_features


@cached_by_features
def make_kick(features):
    """Stage that adds the impulses of the present force and torque over a time."""
    rotation = features.rotation
    by_table = rotation == BY_TABLE

    @stage
    def kick(model, workspace, time):
        for m in range(model.dynamic.shape[0]):
            solid = workspace.solid[m]
            P, L = solid.momentum, solid.angular_momentum
            force, torque = solid.force, solid.torque
            for i in range(LANES):
                P[0, i] += time * force[0, i]
                P[1, i] += time * force[1, i]
                P[2, i] += time * force[2, i]
            if by_table and model.dynamic[m].rotation == NO_ROTATION:
                continue
            if rotation != NO_ROTATION and model.dynamic[m].is_body:
                for i in range(LANES):
                    L[0, i] += time * torque[0, i]
                    L[1, i] += time * torque[1, i]
                    L[2, i] += time * torque[2, i]

    return kick
