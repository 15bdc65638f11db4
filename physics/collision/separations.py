"""Separations between the samples of a half-pair and its surface, in one lane, for a search."""

from physics.collision.distances import core_distance
from physics.collision.facing import FLOORS, facing
from physics.collision.grid_distance import grid_separations
from physics.collision.surface_kinds import by_surface_kind
from physics.compiler.jit import at, stage
from physics.model.features import cached_by_features
from physics.scene.shapes import GRID, PARTICLES, PLANE


@stage
def separation_bound(half_pair, i, relative):
    """Lower bound in m of all separations: along the surface's axes, from the core's box.

    Over a plane that is along z. It is tighter than the distance of bounding spheres for boxes that
    stand side by side.
    """
    R, c, core = relative.rotation, relative.position, half_pair.core
    size = at(half_pair.owner_size, i)
    ex, ey, ez = size * half_pair.extent[0], size * half_pair.extent[1], size * half_pair.extent[2]
    gz = c[2, i] - at(core[0], i) if half_pair.kind == PLANE else abs(c[2, i]) - at(core[2], i)
    # one product in each sum: with two, the compiler chooses which one it rounds
    gz -= abs(R[6, i]) * ex
    gz -= abs(R[7, i]) * ey
    gz -= abs(R[8, i]) * ez
    if half_pair.kind == PLANE:
        return gz - at(half_pair.radius, i)
    gx, gy = abs(c[0, i]) - at(core[0], i), abs(c[1, i]) - at(core[1], i)
    gx -= abs(R[0, i]) * ex
    gx -= abs(R[1, i]) * ey
    gx -= abs(R[2, i]) * ez
    gy -= abs(R[3, i]) * ex
    gy -= abs(R[4, i]) * ey
    gy -= abs(R[5, i]) * ez
    return max(gx, max(gy, gz)) - at(half_pair.radius, i)


@cached_by_features
def make_separations(features):
    """Stage that writes the separation [samples] m of every sample of a half-pair."""
    per_world_parameters, axial = features.per_world_parameters, features.axial

    def make_loop(kind):
        """A loop without branches over columns of samples, for vector instructions."""
        if kind == PARTICLES:  # pairs of particles are searched one by one
            return None
        if kind == GRID:
            return grid_separations
        distance = core_distance(kind)
        turn, turned = facing(kind), axial and kind in FLOORS

        @stage
        def loop(model, half_pair, i, relative, separation):
            R, c = relative.rotation, relative.position
            first, count = half_pair.first_sample, half_pair.sample_count
            along_x = model.sample[0, first : first + count]
            along_y = model.sample[1, first : first + count]
            along_z = model.sample[2, first : first + count]
            core, face_normals = half_pair.core, half_pair.face_normals != 0
            turns = half_pair.axial != 0
            ca, cb, cc = at(core[0], i), at(core[1], i), at(core[2], i)
            radius, size = at(half_pair.radius, i), at(half_pair.owner_size, i)
            xx, xy, xz, x0 = R[0, i], R[1, i], R[2, i], c[0, i]
            yx, yy, yz, y0 = R[3, i], R[4, i], R[5, i], c[1, i]
            zx, zy, zz, z0 = R[6, i], R[7, i], R[8, i], c[2, i]
            for s in range(count):
                sx, sy, sz = along_x[s], along_y[s], along_z[s]
                if per_world_parameters:
                    sx, sy, sz = size * sx, size * sy, size * sz
                if turned:
                    tx, ty = turn(sx, sy, sz, R, c, i, ca, cb, cc)
                    sx, sy = tx if turns else sx, ty if turns else sy
                # one product in each sum, see `separation_bound`
                x = xz * sz + (xy * sy + (xx * sx + x0))
                y = yz * sz + (yy * sy + (yx * sx + y0))
                z = zz * sz + (zy * sy + (zx * sx + z0))
                separation[s] = distance(x, y, z, ca, cb, cc, radius, face_normals)[0] - radius

        return loop

    call = by_surface_kind(features, make_loop)

    @stage
    def separations(model, half_pair, i, relative, separation):
        call(half_pair.kind, model, half_pair, i, relative, separation)

    return separations
