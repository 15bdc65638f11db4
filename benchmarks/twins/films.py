"""Films of the same policy in a twin, at the left, and in its original, from the same start."""

from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks.twins.replay import OBJECT
from physics import World
from rigid_envs import RigidEnv
from rigid_envs.twins import TWINS
from rigid_envs.twins.twin import Twin
from training.policies.policy import Policy
from training.policies.policy_file import read_policy
from training.results.gif import GifWriter
from training.results.originals import Originals
from training.results.result import read_results
from training.results.video import film_episode
from training.settings.environments import task_of
from training.settings.seed_ranges import EVALUATION

Array = np.ndarray

ROOT = Path(__file__).parents[2]
FILMED = ("FetchPush", "FetchPickAndPlace", "PandaPush", "PandaStack")
SEEDS = range(EVALUATION, EVALUATION + 3)  # the first of `evaluate --in`
HEIGHT, FPS = 240, 25  # pixels of a frame; of the originals' steps of 40 ms
AFTER = 10  # frames that are shown after the goal is met


def path(name: str) -> Path:
    """Where the film of a twin is."""
    return ROOT / f"docs/images/twin-{name}.gif"


def draw(python: Path | None = None, names: Sequence[str] = FILMED) -> None:
    """Films the first recorded policy of each twin."""
    for name in names:
        result = next(one for one in read_results(ROOT) if one.env_id == f"RigidEnvs/{name}-v0")
        film(read_policy(result.folder(ROOT) / "policy.safetensors"), path(name), python)


def film(policy: Policy, gif: Path, python: Path | None = None) -> None:
    """Films the episodes of a twin's policy that begin in the original with `SEEDS`."""
    name = task_of(policy.env_id)
    assert name is not None
    twin = TWINS[name]
    with (
        Originals(twin.original, 1, python=python, render=True) as originals,
        GifWriter(gif, FPS, 2 * HEIGHT) as writer,
    ):
        for seed in SEEDS:
            start, there = episode(originals, policy, seed)
            env = RigidEnv(
                starting_at(twin(), start), render_mode="rgb_array",
                fidelity=policy.env_kwargs.get("fidelity", "balanced"),
                terminate_on_success=twin.ends_on_success,
            )  # fmt: skip
            with closing(env):
                here = film_episode(env, policy, seed, after=AFTER, fits=False)
            for k in range(max(len(here), len(there))):
                pair = (here[min(k, len(here) - 1)], there[min(k, len(there) - 1)])
                writer.append_data(np.concatenate([square(frame) for frame in pair], axis=1))


def episode(
    originals: Originals, policy: Policy, seed: int
) -> tuple[dict[str, Array], list[Array]]:
    """First observation and frames of an episode in the original."""
    start = now = originals.reset([seed])
    frames, left = [originals.frame()], AFTER
    while left > 0:
        now = originals.step(np.clip(policy.act(now), -1.0, 1.0))
        frames.append(originals.frame())
        if now["terminated"][0] or now["truncated"][0]:
            break
        left = left - 1 if now["is_success"][0] else AFTER
    return start, frames


def starting_at(twin: Twin, observation: dict[str, Array]) -> Twin:
    """A twin whose episodes begin with the objects and the goal of an original's observation."""
    first = OBJECT[type(twin).__name__[:5].lower()] + len(getattr(twin.hand, "names", ()))  # type: ignore[attr-defined]
    start = twin.start

    def start_there(world: World, mask: Array, draws: Array) -> Array:
        start(world, mask, draws)
        bodies = len(world.scene.bodies)
        row = observation["observation"]
        positions = [row[:, first + 12 * body : first + 12 * body + 3] for body in range(bodies)]
        world.set_state(position=np.stack(positions, axis=1), worlds=mask)
        return observation["desired_goal"]

    twin.start = start_there  # type: ignore[method-assign]
    return twin


def square(frame: Array) -> Array:
    """The middle of a frame, `HEIGHT` pixels wide and high."""
    height, width = frame.shape[:2]
    side = min(height, width)
    top, left = (height - side) // 2, (width - side) // 2
    cut = Image.fromarray(frame[top : top + side, left : left + side])
    return np.asarray(cut.resize((HEIGHT, HEIGHT), Image.Resampling.LANCZOS))
