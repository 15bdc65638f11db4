"""Contact parameters with which MuJoCo rebounds as a coefficient of restitution demands.

MuJoCo has no such coefficient. A contact with stiffness ω² and damping 2 ζ ω, both per kg, rebounds
with a ratio that falls with ζ. Here ζ is searched so that the mean ratio over all times of impact
within a step is e. That is the best that a user can reach; the errors that remain come from the
time of impact.
"""

from functools import cache

import numpy as np

from benchmarks.peers.mujoco_options import MujocoOptions
from benchmarks.peers.mujoco_worlds import MujocoWorlds
from benchmarks.trade.impacts import SPEED, bounce
from benchmarks.trade.trial import start

_SEARCHES = 14
_MOST_DAMPED = 4.0
IMPEDANCE = (0.999, 0.999, 0.001)


def _rebound(e: float, step: float, solref: tuple[float, float]) -> float:
    """Mean ratio of the speeds after and before the impact."""
    options = MujocoOptions(step, solref=solref, solimp=IMPEDANCE)
    trial = bounce(e)
    worlds = start(trial, lambda scene, count: MujocoWorlds(scene, options, count), trial.worlds)
    worlds.advance(trial.time)
    return float(np.mean(worlds.linear_velocity[:, 0, 2])) / SPEED


@cache
def tuned(e: float, step: float, ratio: float) -> tuple[float, float] | None:
    """Stiffness and damping, negative as MuJoCo wants them; None if no damping rebounds enough.

    Args:
        e: coefficient of restitution.
        step: s.
        ratio: ω times step.
    """
    frequency = ratio / step

    def solref(damping: float) -> tuple[float, float]:
        return -(frequency**2), -max(2.0 * damping * frequency, 1e-9)

    if not _rebound(e, step, solref(0.0)) >= e - 0.05:
        return None
    # beyond it explicit damping overshoots
    low, high = 0.0, min(_MOST_DAMPED, 0.5 / ratio)
    for _ in range(_SEARCHES):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _rebound(e, step, solref(middle)) > e else (low, middle)
    return solref(0.5 * (low + high))
