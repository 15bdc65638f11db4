"""What a setting costs: simulated seconds per second, of one world and of thousands.

Our 4,096 worlds share two threads. MuJoCo's many worlds are advanced by mujoco.rollout on two
threads; 64 of them, as its rate doesn't depend on the number. One world is advanced in one call by
one thread, in both engines. The time that is measured begins at the start of the trial, and is
shorter than the trial where many small steps would take too long.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import Any

from benchmarks.peers.mujoco_options import MujocoOptions
from benchmarks.peers.mujoco_worlds import MujocoWorlds
from benchmarks.report.provenance import THREADS
from benchmarks.trade.trial import FRAME, Make, Trial, start
from physics import Fidelity, World

MANY, PEER_MANY = 4096, 64
STEPS_ONE, STEPS_MANY, STEPS_SETTLED = 8000, 400, 200
# repeats, and s of wall time of them after which a measurement ends
REPEATS, ENOUGH = 3, 0.3


def maker(options: Fidelity | MujocoOptions, trial: Trial, threads: int = THREADS) -> Make:
    """Builds worlds with these options."""
    if isinstance(options, MujocoOptions):
        return lambda scene, count: MujocoWorlds(scene, options, count, grip=trial.grip)
    return lambda scene, count: World(scene, options, count, threads)


def step_of(options: Fidelity | MujocoOptions) -> float:
    """Its step in s."""
    return options.timestep if isinstance(options, MujocoOptions) else options.substep


def _measured(trial: Trial, step: float, steps: int) -> float:
    """Simulated s to measure: whole frames, and no more than about `steps` steps."""
    whole = trial.time if trial.timed is None else trial.timed
    frames = max(1, min(round(whole / FRAME), math.ceil(steps * step / FRAME)))
    return frames * FRAME


def _fastest(work: Callable[[], None], prepare: Callable[[], None]) -> float:
    """Shortest duration in s of some repeats of work."""
    shortest, spent = math.inf, 0.0
    for _ in range(REPEATS):
        prepare()
        begin = perf_counter()
        work()
        took = perf_counter() - begin
        shortest, spent = min(shortest, took), spent + took
        if spent > ENOUGH:
            break
    return shortest


def one_world(trial: Trial, options: Fidelity | MujocoOptions) -> float:
    """Simulated s per s of a single world on one thread."""
    time = _measured(trial, step_of(options), STEPS_ONE)
    worlds: Any = start(_short(trial, options), maker(options, trial, threads=1), 1)
    saved = worlds.snapshot()
    return time / _fastest(lambda: worlds.advance(time), lambda: worlds.restore(saved))


def many_worlds(trial: Trial, options: Fidelity | MujocoOptions) -> float:
    """Simulated s per s of all worlds together, on all threads."""
    time = _measured(trial, step_of(options), STEPS_MANY)
    make = maker(options, trial)
    short = _short(trial, options)
    if isinstance(options, MujocoOptions):
        peers: Any = start(short, make, PEER_MANY)
        return PEER_MANY * time / _fastest(peers.rollout(time), lambda: None)
    worlds: Any = start(short, make, MANY)
    saved = worlds.snapshot()
    return MANY * time / _fastest(lambda: worlds.advance(time), lambda: worlds.restore(saved))


def _short(trial: Trial, options: Fidelity | MujocoOptions) -> Trial:
    """The trial with no more time to settle than is needed to measure its cost."""
    settle = min(trial.settle, max(FRAME, STEPS_SETTLED * step_of(options)))
    return replace(trial, settle=settle if trial.settle else 0.0)
