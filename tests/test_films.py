"""Pictures of the documentation: a command draws each of them, and films show what tables say."""

from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from benchmarks import plots
from benchmarks.draw import tasks, worlds
from benchmarks.twins import films as twin_films
from physics import PRESETS
from training.policies.policy_file import read_policy
from training.policies.trained_policy import shipped_policy
from training.results.result import read_results
from training.results.results_tables import by_kind, image_paths
from training.settings.environments import make_single_env, make_vector_env
from training.settings.seed_ranges import EVALUATION

ROOT = Path(__file__).parents[1]
SHOWN = 3  # episodes of a film of a result
KINDS = by_kind(read_results(ROOT))
FILMED = [(task, 1_000_000 + k, steps, {}) for row in tasks.FILM for task, steps in row.items()
          for k in range(tasks.FILM_LENGTH // steps)]  # fmt: skip
STRIPS = [
    (strip.task, strip.seed, max(strip.steps), strip.arguments) for strip in tasks.STRIPS.values()
]


def test_a_command_draws_every_picture():
    drawn = {plot.path for plot in plots.PLOTS.values()} | set(plots.TRADE)
    drawn |= {plots.FILM, plots.WORLDS, plots.SCENES, plots.PIXELS, plots.VIEW}
    drawn |= {ROOT / f"docs/images/{name}.png" for name in tasks.STRIPS}
    drawn |= {ROOT / path for kind in KINDS for path in image_paths(kind[0].kind)}
    drawn |= {twin_films.path(name) for name in twin_films.FILMED}
    # by benchmarks.stability
    drawn |= {ROOT / f"docs/trade/stability_{name}.png" for name in PRESETS}
    found = {path for path in (ROOT / "docs").rglob("*") if path.suffix in (".png", ".gif")}
    assert {path for path in found if "_build" not in path.parts} == drawn
    assert all(path.stat().st_size <= 300_000 for path in drawn - {plots.FILM, plots.WORLDS})
    assert plots.FILM.stat().st_size + plots.WORLDS.stat().st_size <= 1_600_000


def solved(policy, seed, steps=None, **arguments):
    """Whether the goal is met at the end of an episode, or after some steps."""
    if steps is not None:
        arguments["max_episode_steps"] = steps
    with closing(make_single_env(policy.env_id, **{**policy.env_kwargs, **arguments})) as env:
        observation, _ = env.reset(seed=seed)
        ended = False
        while not ended:
            batch = {name: np.asarray(value)[None] for name, value in observation.items()}
            action = np.asarray(policy.act(batch))[0].astype(np.float32)
            observation, _, terminated, truncated, info = env.step(action)
            ended = terminated or truncated
    return info["is_success"]


@pytest.mark.parametrize(("task", "seed", "steps", "arguments"), [*STRIPS, *FILMED])
def test_episodes_of_the_animation_and_of_the_strips_end_with_the_goal_met(
    task, seed, steps, arguments
):
    assert solved(tasks.player(task, arguments), seed, steps)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind[0].kind)
def test_most_episodes_of_a_film_of_a_result_end_with_the_goal_met(kind):
    """Three are shown: with the success of the table, at least two are solved."""
    policy = read_policy(kind[0].folder(ROOT) / "policy.safetensors")
    assert sum(solved(policy, EVALUATION + k) for k in range(SHOWN)) >= 2


def test_the_film_of_many_worlds_shows_the_success_of_the_table():
    count = worlds.ROWS * worlds.COLUMNS
    assert count >= 64
    policy = shipped_policy(f"RigidEnvs/{worlds.TASK}-v0")
    arguments = {**policy.env_kwargs, "max_episode_steps": -1}
    with closing(make_vector_env(policy.env_id, count, **arguments)) as envs:
        observation, _ = envs.reset(seed=worlds.SEED)
        for _ in range(worlds.STEPS):
            observation, _, _, _, info = envs.step(policy.act(observation))
    (own,) = (
        kind[0] for kind in KINDS
        if kind[0].kind == f"ppo-RigidEnvs-{worlds.TASK}-v0"
    )  # fmt: skip
    rate = own.success_at_end["rate"]
    deviation = np.sqrt(rate * (1.0 - rate) / count)
    assert abs(info["is_success"].mean() - rate) < 3.0 * deviation
