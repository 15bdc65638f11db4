"""Speed of pictures: 480 x 480 frames of single environments by render() alone, on one core.

Each world is looked at halfway through an episode of random actions, with contact forces drawn.
The bar is 100 frames a second.
"""

from collections.abc import Callable, Iterator
from typing import Any

import gymnasium as gym

import rigid_envs  # noqa: F401  (registers the ids)
from benchmarks.report import Cell, Table, main, rate

SCENES: list[tuple[str, dict[str, Any]]] = [
    ("Push", {}),
    *(("Stack", {"blocks": blocks}) for blocks in (2, 3, 4, 5)),
    ("Throw", {}),
]
STEPS, SECONDS = 25, 1.5
BAR = 100.0


def pictures(task: str, **arguments: Any) -> Callable[[], int]:
    """Ten frames a call of one world."""
    env = gym.make(f"RigidEnvs/{task}-v0", render_mode="rgb_array", show_forces=True, **arguments)
    env.reset(seed=0)
    env.action_space.seed(0)
    for _ in range(STEPS):
        env.step(env.action_space.sample())

    def turn() -> int:
        for _ in range(10):
            env.render()
        return 10

    turn()
    return turn


def measure() -> Iterator[Table]:
    """Frames a second of every task, with exact shapes and with particles."""
    rows: list[list[Cell]] = []
    for task, arguments in SCENES:
        exact = rate(pictures(task, **arguments), SECONDS)
        particles = rate(pictures(task, show_particles=True, **arguments), SECONDS)
        blocks = f", {arguments['blocks']} blocks" if arguments else ""
        rows.append([f"{task}{blocks}", BAR, exact, particles])
    columns = ["frames a second", "bar", "exact shapes", "particles"]
    yield Table("pictures", "Pictures of 480 x 480 with contact forces, one core", columns, rows)


if __name__ == "__main__":
    main(__doc__, measure)
