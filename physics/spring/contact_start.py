"""Where a state was set: memory and pose of a half-pair before its contact loop, and after it.

The force of such a state acts for the half step that comes, so it is evaluated in the middle of
that time, see `contacts`. In all other steps nothing of this runs but saving memory where a lane
passes a step by.
"""

from physics.compiler.jit import LANES, stage
from physics.model.contact_memory import contact_memory
from physics.model.features import cached_by_features
from physics.model.state import BEGINS, QUERY
from physics.spring.contact_loop import SLOWEST

# N, a load above any force
_ANY_LOAD = 1e200


@cached_by_features
def make_keep_memory(features):
    """Stages that save the memory of candidates, begin it and restore it."""
    memory_rows = contact_memory(features)
    size, FORCE, SPEED = memory_rows.size, memory_rows.normal_force, memory_rows.impact_speed

    @stage
    def save_memory(candidate, slots, saved):
        for n in range(slots):
            for row in range(size):
                for i in range(LANES):
                    saved[n].memory[row, i] = candidate[n].memory[row, i]

    @stage
    def begin_memory(candidate, slots, updates_memory):
        """Makes contacts of a state that was set last ones that bear any load.

        So a sample that the state puts inside a surface is no impact: at rest it has the undamped
        force of its spring.
        """
        for n in range(slots):
            memory = candidate[n].memory
            for i in range(LANES):
                begins = updates_memory[i] != 0
                memory[FORCE, i] = _ANY_LOAD if begins else memory[FORCE, i]
                memory[SPEED, i] = SLOWEST if begins else memory[SPEED, i]

    @stage
    def restore_memory(candidate, slots, saved, updates_memory, refresh):
        """After a query that is all lanes, else those that don't update their memory.

        After the half step of a state that was set contacts begin with the next step, but know
        their rate.
        """
        for n in range(slots):
            for row in range(size):
                for i in range(LANES):
                    if refresh == QUERY or updates_memory[i] == 0:
                        candidate[n].memory[row, i] = saved[n].memory[row, i]
            for i in range(LANES):
                if refresh == BEGINS and updates_memory[i] != 0:
                    candidate[n].memory[FORCE, i] = 0.0
                    candidate[n].memory[SPEED, i] = 0.0

    return save_memory, begin_memory, restore_memory


@stage
def keep_pose(relative, kept):
    """Copies the pose of a row of SOLID."""
    for row in range(9):
        for i in range(LANES):
            kept.rotation[row, i] = relative.rotation[row, i]
    for row in range(3):
        for i in range(LANES):
            kept.position[row, i] = relative.position[row, i]


@stage
def move_ahead(relative, time, moves):
    """Moves an owner to where its velocities take it in `time` s, to first order."""
    R, c, v, w = relative.rotation, relative.position, relative.velocity, relative.angular_velocity
    for i in range(LANES):
        part = time if moves[i] != 0 else 0.0
        c[0, i] += part * v[0, i]
        c[1, i] += part * v[1, i]
        c[2, i] += part * v[2, i]
        wx, wy, wz = part * w[0, i], part * w[1, i], part * w[2, i]
        for column in range(3):
            x, y, z = R[column, i], R[3 + column, i], R[6 + column, i]
            R[column, i] = x + (wy * z - wz * y)
            R[3 + column, i] = y + (wz * x - wx * z)
            R[6 + column, i] = z + (wx * y - wy * x)
