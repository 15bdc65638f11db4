"""Bare MuJoCo on many worlds at once: `mujoco.rollout` and `mujoco.batch`, on threads.

No task and no Python loop: the bodies, ground and drives of a task's scene at a step of 2 ms, 20
steps per environment step. The drives follow the paths that random actions, or a trained policy,
produce in our own environment, from the same initial states.
"""

import numpy as np
from mujoco import MjData, mjtState, rollout
from mujoco.batch import Batch

from benchmarks.measure.episodes import recorded_episode
from benchmarks.peers.mujoco_options import MujocoOptions
from benchmarks.peers.mujoco_scene import model_of
from benchmarks.report.provenance import THREADS
from benchmarks.report.timing import Side
from rigid_envs.tasks import TASKS

ROLLOUT, BATCH = "MuJoCo: rollout", "MuJoCo: batch"
SUBSTEPS = 20  # MuJoCo steps per environment step


def mujoco_sides(task: str, worlds: int = 256, trained: bool = False) -> dict[str, Side]:
    """Each call is an episode of `mujoco.rollout`, or of `mujoco.batch` driven step by step."""
    world, position, orientation, path = recorded_episode(task, worlds, trained=trained)
    steps = path.shape[1] - 1
    model = model_of(world.scene, MujocoOptions(TASKS[task].frame / SUBSTEPS, cone="pyramidal"))
    state = np.zeros((worlds, 1 + model.nq + model.nv))
    pose = np.concatenate([position, np.roll(orientation, 1, axis=-1)], axis=-1)
    state[:, 1 : 1 + model.nq] = pose.reshape(worlds, -1)
    fraction = np.arange(1, SUBSTEPS + 1)[:, None, None] / SUBSTEPS
    control = path[:, :-1, None] + fraction * np.diff(path, axis=1)[:, :, None]
    control = control.reshape(worlds, steps * SUBSTEPS, -1)
    states = np.empty((worlds, steps * SUBSTEPS, state.shape[1]))
    pool, data = rollout.Rollout(nthread=THREADS), [MjData(model) for _ in range(THREADS)]
    spec = int(mjtState.mjSTATE_MOCAP_POS)
    batch = Batch(model, nsim=worlds, nthread=THREADS)

    def roll() -> int:
        pool.rollout(model, data, state, control, control_spec=spec, state=states)
        return worlds * steps

    def step() -> int:
        batch.reset()
        batch.qpos = state[:, 1 : 1 + model.nq]
        for frame in range(steps):
            batch.mocap_pos = path[:, frame + 1]
            batch.step(nstep=SUBSTEPS)
        return worlds * steps

    return {ROLLOUT: roll, BATCH: step}
