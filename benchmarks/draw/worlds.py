"""An animation of many worlds at once: a trained policy plays in all of them, side by side."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from physics.rotation import rotation_matrix
from rigid_envs import RigidVectorEnv
from rigid_envs.episodes.runner import Runner
from rigid_envs.rendering import scene_view
from rigid_envs.rendering.camera import Camera
from rigid_envs.rendering.cameras import fitted
from rigid_envs.rendering.primitives import placed, shape_primitives
from rigid_envs.rendering.renderer import Renderer
from training.policies.trained_policy import shipped_policy
from training.results.gif import GifWriter
from training.settings.environments import make_vector_env

Array = np.ndarray

TASK, SEED = "PushT", 1_000_000
ROWS, COLUMNS = 8, 12
STEPS, PAUSE = 72, 24  # how many are shown, and how many more the last frame stands still
PITCH, BORDER = 0.34, 0.15  # m, from a world to the next one, and around the middle of one
WIDTH, HEIGHT = 720, 378  # pixels
COLOURS = 64
CAMERA = Camera.around((0.0, 0.0, 0.0), 1.0, -90.0, 56.0, field_of_view=20.0)  # its side


def draw(path: Path) -> None:
    """Writes a GIF of ROWS x COLUMNS worlds in one picture."""
    policy = shipped_policy(f"RigidEnvs/{TASK}-v0")
    arguments = {**policy.env_kwargs, "max_episode_steps": -1}
    envs: Any = make_vector_env(policy.env_id, ROWS * COLUMNS, **arguments).unwrapped
    assert isinstance(envs, RigidVectorEnv)
    observation, _ = envs.reset(seed=SEED)
    picture = SideBySide(envs.runner)
    path.parent.mkdir(parents=True, exist_ok=True)
    with GifWriter(path, 25.0, WIDTH, COLOURS) as writer:
        writer.append_data(picture.frame())
        for _ in range(STEPS):
            observation = envs.step(policy.act(observation))[0]
            frame = picture.frame()
            writer.append_data(frame)
        for _ in range(PAUSE):
            writer.append_data(frame)
    envs.close()


class SideBySide:
    """Draws all worlds of a runner in one picture, in rows on one ground.

    Args:
        runner: whose worlds.
    """

    def __init__(self, runner: Runner) -> None:
        self._runner = runner
        row, column = np.divmod(np.arange(runner.count), COLUMNS)
        rows = math.ceil(runner.count / COLUMNS)
        flat = [column - 0.5 * (COLUMNS - 1), 0.5 * (rows - 1) - row, np.zeros(runner.count)]
        self._offsets = PITCH * np.stack(flat, axis=1)
        corners = BORDER * np.array([[x, y, 0.0] for x in (-1, 1) for y in (-1, 1)])
        points = (self._offsets[:, None] + corners).reshape(-1, 3)
        camera = fitted(CAMERA, points, WIDTH / HEIGHT, used=1.0)
        self._renderer = Renderer(WIDTH, HEIGHT, camera, threads=runner.world.threads)

    def frame(self) -> Array:
        """A picture [HEIGHT, WIDTH, 3] uint8 of the worlds as they are now."""
        runner, renderer = self._runner, self._renderer
        solids: list[Array] = []
        glass: list[Array] = []
        for item in scene_view.items(runner.world, np.arange(runner.count)):
            turn = rotation_matrix(item.orientation)[:, None]
            place = (item.position + self._offsets)[:, None]
            table = placed(shape_primitives(item.shape), place, turn)
            table["color"], table["opacity"] = item.color, item.opacity
            (solids if item.opacity == 1.0 else glass).append(table.reshape(-1))
        markers = [
            replace(marker, position=marker.position + self._offsets[world])
            for world in range(runner.count)
            for marker in scene_view.markers(runner, world)
        ]
        overlay = renderer.overlay(markers)
        overlay = overlay._replace(glass=np.concatenate([*glass, overlay.glass]))
        frames = renderer.frames([], [overlay], primitives=np.concatenate(solids)[None])
        assert frames.rgb is not None
        return np.asarray(frames.rgb[0])
