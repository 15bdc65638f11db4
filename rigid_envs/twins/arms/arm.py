"""An arm: what its hand does in a step, from the angles and speeds of its hinges.

The engine simulates only the hand. Hinges are integrated here, freely; where the hand was held back
in the engine, by an object or the table, a force on it must have done so, and the hinges follow as
they would follow that force. Angles and speeds are kept in the world's `memory`.
"""

from collections.abc import Callable
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np

from physics import World
from physics.compiler.jit import LANES, entry, sequence, stage
from physics.step.threads import run_in_blocks
from rigid_envs.twins.arms.chain import Chain, differentiate, locate
from rigid_envs.twins.arms.dynamics import answer
from rigid_envs.twins.arms.linear import factor, solve
from rigid_envs.twins.arms.work import JOINTS, WORK

Array = np.ndarray

# of `Arm.place`: the hand is then within 0.1 mm
ITERATIONS, DAMPING = 8, 1e-4  # damping in m^2 or rad^2


class Response(NamedTuple):
    """What a hand does in a step.

    Attributes:
        moved: [count, parts, 3] m, its displacement until the end of each part of the step.
        end: [count, parts, 3] m/s, its velocity then.
        load: [count] N, mean force with which it presses on what is below.
    """

    moved: Array
    end: Array
    load: Array


class Arm:
    """An arm.

    Args:
        chain: its links.
        entry: makes the function that moves the hinges of worlds; see `fetch.arm`, `panda.arm`.
        angles: [n] rad, at the start of an episode.
        speeds: [n] rad/s, at the start of an episode.
        base: [3] m, position of the chain's origin.
        rise: m/s, its velocity upwards.
        parts: equal parts of a step at whose ends a response says where the hand is.
    """

    def __init__(
        self,
        chain: Chain,
        entry: Callable[[], Any],
        angles: Array,
        speeds: Array,
        base: Array,
        rise: float = 0.0,
        parts: int = 1,
    ) -> None:
        self.chain, self.entry, self.base, self.parts = chain, entry, base, parts
        self.start, self.rise = np.concatenate([angles, speeds]), np.array([0.0, 0.0, rise])

    @cached_property
    def start_pose(self) -> tuple[Array, Array]:
        """Position [3] m and rotation [3, 3] of the hand at the start of an episode."""
        work = self._locate_start()
        return self.base + work.origin[JOINTS, :, 0], work.rotation[JOINTS, :, :, 0]

    @cached_property
    def start_velocity(self) -> Array:
        """[3] m/s, of the hand at the start of an episode."""
        work = self._locate_start()
        differentiate(work)
        return np.asarray(work.jacobian[:3, :, 0] @ self.start[JOINTS:] + self.rise)

    def _locate_start(self) -> Any:
        work = make_work()
        work.angles[...] = self.start[:JOINTS, None]
        locate(self.chain, work.angles, work)
        return work

    def respond(
        self,
        world: World,
        position: Array,
        velocity: Array,
        asked: Array,
        frame: float,
        support: Array | None = None,
    ) -> "Response":
        """What a hand does in a step that no object holds back.

        Args:
            world: whose memory has the hinges.
            position: [count, 3] m, of the hand.
            velocity: [count, 3] m/s.
            asked: [count, 3] m, displacement that is asked for.
            frame: s, duration of a step.
            support: [count] m, height of what is below the hand, for arms that meet it; 0 if None.
        """
        below = np.zeros(world.count) if support is None else support
        from_base = position - self.base - self.rise * world.time[:, None]
        moved, end = np.empty((2, world.count, self.parts, 3))
        load = np.empty(world.count)
        known = (
            self.chain, self.start, world.memory("arm", len(self.start)),
            *(
                np.ascontiguousarray(x, float)
                for x in (from_base, velocity - self.rise, asked, below)
            ),
            moved, end, load,
        )  # fmt: skip

        def run(first: int, last: int) -> int:
            self.entry()(*known, make_work(), first, last)
            return 0

        run_in_blocks(run, -(-world.count // LANES), world.threads)
        times = frame / self.parts * np.arange(1, self.parts + 1)[:, None]
        return Response(moved + times * self.rise, end + self.rise, load)

    def place(self, world: World, worlds: Array, position: Array) -> None:
        """Brings the hinges to hands that were moved, at rest.

        Args:
            world: the worlds.
            worlds: [count] bool, those whose hand was moved; k of them.
            position: [k, 3] m, of their hands.
        """
        hinges = np.zeros((len(position), len(self.start)))
        hinges[:, JOINTS:] = -self.start[JOINTS:]
        target = position - self.base - self.rise * world.time[worlds][:, None]
        _make_place()(self.chain, self.start, hinges, target, self.start_pose[1], make_work())
        world.memory("arm", len(self.start))[worlds] = hinges


def make_work() -> Any:
    """Memory for the arms of a lane group."""
    return np.zeros(1, WORK).view(np.recarray)[0]


@cache
def _make_place() -> Any:
    @entry
    def place(chain, start, hinges, target, rotation, work):
        error, system, step = work.vector[1], work.matrix[0], work.vector[2]
        for group in range((len(hinges) + LANES - 1) // LANES):
            read(start, hinges, target, target, target, target[:, 2], group, work)
            for _ in range(ITERATIONS):
                locate(chain, work.angles, work)
                differentiate(work)
                _find_turn(rotation, work.rotation[JOINTS], error)
                for a in range(3):
                    for lane in range(LANES):
                        error[a, lane] = work.position[a, lane] - work.origin[JOINTS, a, lane]
                for a in range(6):
                    for b in range(a + 1):
                        for lane in range(LANES):
                            system[a, b, lane] = DAMPING if a == b else 0.0
                        for i in range(JOINTS):
                            for lane in range(LANES):
                                system[a, b, lane] += (
                                    work.jacobian[a, i, lane] * work.jacobian[b, i, lane]
                                )
                    for lane in range(LANES):
                        step[a, lane] = error[a, lane]
                factor(system, 6)
                solve(system, step, 6)
                for i in range(JOINTS):
                    for a in range(6):
                        for lane in range(LANES):
                            work.angles[i, lane] += work.jacobian[a, i, lane] * step[a, lane]
            for lane in range(min(LANES, len(hinges) - group * LANES)):
                for i in range(JOINTS):
                    hinges[group * LANES + lane, i] = work.angles[i, lane] - start[i]

    return place


@stage
def _find_turn(wanted, rotation, error):
    """Writes to error[3:6] about which vector in rad frames have yet to turn: half of D - D^T.

    With D = wanted R^T; the angles are small.
    """
    for lane in range(LANES):
        error[3, lane] = error[4, lane] = error[5, lane] = 0.0
        for k in range(3):
            x, y, z = rotation[0, k, lane], rotation[1, k, lane], rotation[2, k, lane]
            error[3, lane] += 0.5 * (wanted[2, k] * y - wanted[1, k] * z)
            error[4, lane] += 0.5 * (wanted[0, k] * z - wanted[2, k] * x)
            error[5, lane] += 0.5 * (wanted[1, k] * x - wanted[0, k] * y)


@stage
def read(start, hinges, position, velocity, asked, support, group, work):
    """Takes the worlds of a lane group; the last group repeats the last world."""
    for lane in range(LANES):
        world = min(group * LANES + lane, len(hinges) - 1)
        for i in range(JOINTS):
            work.angles[i, lane] = start[i] + hinges[world, i]
            work.speeds[i, lane] = start[JOINTS + i] + hinges[world, JOINTS + i]
        for a in range(3):
            work.position[a, lane] = position[world, a]
            work.velocity[a, lane] = velocity[world, a]
            work.asked[a, lane] = asked[world, a]
        work.support[lane], work.load[lane] = support[world], 0.0


@stage
def write_part(part, group, work, moved, end):
    """Writes how far the hands have moved until the end of a part, and their velocities."""
    for lane in range(min(LANES, len(moved) - group * LANES)):
        world = group * LANES + lane
        for a in range(3):
            moved[world, part, a] = work.origin[JOINTS, a, lane] - work.position[a, lane]
            end[world, part, a] = 0.0
            for i in range(JOINTS):
                end[world, part, a] += work.jacobian[a, i, lane] * work.speeds[i, lane]


@stage
def write(start, group, work, hinges, load):
    """Keeps angles and speeds; writes how hard the hands press."""
    for lane in range(min(LANES, len(hinges) - group * LANES)):
        world = group * LANES + lane
        load[world] = work.load[lane]
        for i in range(JOINTS):
            hinges[world, i] = work.angles[i, lane] - start[i]
            hinges[world, JOINTS + i] = work.speeds[i, lane] - start[JOINTS + i]


@stage
def predict(work, time):
    """Writes to `work.vector[0]` the angles after some time in s, at the present speeds."""
    for i in range(JOINTS):
        for lane in range(LANES):
            work.vector[0, i, lane] = work.angles[i, lane] + time * work.speeds[i, lane]


@sequence
def hold_back(work):
    """Moves the hinges to hands that were held back, as forces F on these would do.

    q'' = M^-1 J^T F, so displacements dx of a hand and dq of the hinges go together as
    dq = M^-1 J^T (J M^-1 J^T)^-1 dx; velocities likewise.
    """
    J, along, compliance, load = work.jacobian, work.matrix[0], work.matrix[1], work.vector[0]
    answer(J, 3, work.factored[0], along, compliance)
    factor(compliance, 3)
    for kind in range(2):  # angles, speeds
        for a in range(3):
            for lane in range(LANES):
                if kind == 0:
                    load[a, lane] = work.position[a, lane] - work.origin[JOINTS, a, lane]
                else:
                    load[a, lane] = work.velocity[a, lane]
            if kind == 1:
                for i in range(JOINTS):
                    for lane in range(LANES):
                        load[a, lane] -= J[a, i, lane] * work.speeds[i, lane]
        solve(compliance, load, 3)
        x = work.angles if kind == 0 else work.speeds
        for a in range(3):
            for i in range(JOINTS):
                for lane in range(LANES):
                    x[i, lane] += along[a, i, lane] * load[a, lane]
