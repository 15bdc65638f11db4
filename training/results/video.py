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

from rigid_envs.tasks import Task
from training.policies.policy import Policy
from training.results.gif import WIDTH, GifWriter
from training.settings.environments import check_episodes_end, make_single_env
from training.settings.errors import UsageError
from training.settings.seed_ranges import EVALUATION

DEFAULT_FPS = 25
SUFFIXES = (".mp4", ".gif")
SHOWN_AFTER_SUCCESS = 1.0
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

    An episode is shown until a second after its goal is met for good, or until it ends.

    Args:
        policy: The policy.
        video: The mp4 or GIF to write; the still image has the same name with .png.
        episodes: Number of episodes.
        seed: Seed of the first episode.
        quiet: Show no progress.
        gif_width: Width of a GIF in pixels; an mp4 has the size of the frames.
        env_kwargs: Arguments of the environment that replace those of training; without "camera",
            the camera is `Task.video_camera`.

    Returns:
        The paths of the video and of the still image, which shows the middle of the first episode.

    Raises:
        UsageError: A number or the file name is invalid, or the environment rejects its arguments.
    """
    if episodes < 1:
        raise UsageError(f"number of episodes is {episodes}, should be at least 1")
    arguments = {**policy.env_kwargs, **env_kwargs}
    check_episodes_end(arguments)
    env = make_video_env(policy.env_id, arguments)
    policy.check(env.observation_space)
    still = video.with_suffix(".png")
    fps = env.metadata.get("render_fps", DEFAULT_FPS)
    console = Console(quiet=quiet or not sys.stdout.isatty())
    with closing(env), video_writer(video, fps, gif_width) as writer:
        for episode in track(range(episodes), "recording", transient=True, console=console):
            frames = _render_episode(env, policy, seed + episode, round(fps * SHOWN_AFTER_SUCCESS))
            if episode == 0:
                imageio.imwrite(still, frames[len(frames) // 2])
            for frame in frames:
                writer.append_data(frame)
    return video, still


def make_video_env(env_id: str, arguments: dict[str, Any]) -> gym.Env:
    """The single environment with frames from `arguments["camera"]`, or the task's video camera.

    Raises:
        UsageError: As `make_single_env`.
    """
    arguments = {**arguments, "render_mode": "rgb_array"}
    env = make_single_env(env_id, **arguments)
    task = getattr(env.unwrapped, "task", None)
    if "camera" in arguments or not isinstance(task, Task) or task.video_camera == "task":
        return env
    env.close()
    return make_single_env(env_id, **arguments, camera=task.video_camera)


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


def _render_episode(env: Any, policy: Policy, seed: int, after: int) -> list[np.ndarray]:
    """Frames of an episode, until `after` steps after its goal is met for good."""
    observation, _ = env.reset(seed=seed)
    frames, unsolved = [env.render()], 0
    ended = False
    while not ended:
        batch_of_one = {key: np.asarray(value)[None] for key, value in observation.items()}
        action = np.asarray(policy.act(batch_of_one))[0].astype(env.action_space.dtype)
        observation, _, terminated, truncated, info = env.step(action)
        frames.append(env.render())
        if not info.get("is_success", False):
            unsolved = len(frames)
        ended = terminated or truncated
    return frames[: unsolved + after]
