"""Records a video of a policy: an mp4 or a GIF, and a still image. Needs no display."""

import sys
from contextlib import closing
from pathlib import Path
from typing import Any

import gymnasium as gym
import imageio.v2 as imageio
import numpy as np
from rich.console import Console
from rich.progress import track

from rigid_envs import RigidEnv
from training.policies.policy import Policy
from training.results.gif import WIDTH, GifWriter
from training.settings.environments import check_episodes_end, make_single_env
from training.settings.errors import UsageError
from training.settings.seed_ranges import EVALUATION

DEFAULT_FPS = 25
SUFFIXES = (".mp4", ".gif")
SHOWN_AFTER_SUCCESS = 0.6
"""s of an episode that are shown after its goal is met for good."""


def record(
    policy: Policy,
    video: Path,
    *,
    episodes: int = 8,
    seed: int = EVALUATION,
    quiet: bool = False,
    gif_width: int = WIDTH,
    **env_kwargs: Any,
) -> tuple[Path, Path]:
    """Records the episodes with the seeds seed, seed + 1, ... of the single environment.

    An episode is shown until shortly after its goal is met for good, or until it ends.

    Args:
        policy: The policy.
        video: The mp4 or GIF to write; the still image has the same name with .png.
        episodes: Number of episodes.
        seed: Seed of the first episode.
        quiet: Show no progress.
        gif_width: Width of a GIF in pixels; an mp4 has the size of the frames.
        env_kwargs: Arguments of the environment that replace those of training; without "camera",
            each episode is filmed from `Task.video_camera`.

    Returns:
        The paths of the video and of the still image, which shows the middle of the first episode.

    Raises:
        UsageError: A number or the file name is invalid, or the environment rejects its arguments.
    """
    if episodes < 1:
        raise UsageError(f"number of episodes is {episodes}, should be at least 1")
    arguments = {**policy.env_kwargs, **env_kwargs}
    check_episodes_end(arguments)
    env = make_single_env(policy.env_id, **{**arguments, "render_mode": "rgb_array"})
    policy.check(env.observation_space)
    fits = "camera" not in arguments
    still = video.with_suffix(".png")
    fps = env.metadata.get("render_fps", DEFAULT_FPS)
    console = Console(quiet=quiet or not sys.stdout.isatty())
    with closing(env), video_writer(video, fps, gif_width) as writer:
        for episode in track(range(episodes), "recording", transient=True, console=console):
            after = round(fps * SHOWN_AFTER_SUCCESS)
            frames = film_episode(env, policy, seed + episode, after=after, fits=fits)
            if episode == 0:
                imageio.imwrite(still, frames[len(frames) // 2])
            for frame in frames:
                writer.append_data(frame)
    return video, still


def video_writer(video: Path, fps: float, gif_width: int = WIDTH) -> Any:
    """Takes frames by `append_data` and writes them when it is closed.

    Raises:
        UsageError: not an mp4 or a GIF, or it can't be written.
    """
    if video.suffix not in SUFFIXES:
        raise UsageError(f"video is {str(video)!r}, should end in {' or '.join(SUFFIXES)}")
    try:
        video.parent.mkdir(parents=True, exist_ok=True)
        existed = video.exists()
        video.open("ab").close()
        if not existed:  # a failure until it is written leaves nothing behind
            video.unlink()
    except OSError as error:
        raise UsageError(f"cannot write {str(video)!r}: {error.strerror}") from None
    if video.suffix == ".gif":
        return GifWriter(video, fps, gif_width)
    # the codec requires even sizes: blocks of 2 keep the size of the frames, the default scales it
    return imageio.get_writer(video, format="FFMPEG", fps=fps, macro_block_size=2)


def film_episode(
    env: gym.Env,
    policy: Policy,
    seed: int,
    *,
    steps: int | None = None,
    after: int | None = None,
    fits: bool = True,
) -> list[np.ndarray]:
    """Frames of an episode: one of its start and one after each step.

    Args:
        env: A single environment that renders arrays.
        policy: Who acts.
        seed: Of the episode.
        steps: After which the film ends; with the episode if None.
        after: Number of steps that are shown after the goal is met for good; all if None.
        fits: Whether an environment of this project is filmed from `Task.video_camera`; its camera
            is that of the task afterwards.
    """
    bare: Any = env.unwrapped
    own = isinstance(bare, RigidEnv)
    shown: list[Any] = []  # states of an environment of this project, else frames
    observation, _ = env.reset(seed=seed)
    shown.append(bare.get_state() if own else env.render())
    unsolved, ended = 1, False
    while not ended:
        batch_of_one = {key: np.asarray(value)[None] for key, value in observation.items()}
        action = np.asarray(policy.act(batch_of_one))[0].astype(env.action_space.dtype)
        observation, _, terminated, truncated, info = env.step(action)
        shown.append(bare.get_state() if own else env.render())
        if not info.get("is_success", False):
            unsolved = len(shown)
        ended = terminated or truncated or len(shown) - 1 == steps
    if after is not None:
        shown = shown[: unsolved + after]
    if not own:
        return shown
    if fits:
        bare.camera = bare.task.video_camera or bare.camera_for(shown)
    frames = []
    for state in shown:
        bare.set_state(state)
        frames.append(bare.render())
    if fits:
        bare.camera = None
    return frames
