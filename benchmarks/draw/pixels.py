"""Observed pixels of a task: colours, depth and segmentation, each pixel enlarged."""

from contextlib import closing
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from PIL import Image

import rigid_envs  # noqa: F401  (registers the ids)
from rigid_envs.rendering.view import BODY_COLORS
from training.scripted import controller_for

ENV_ID = "RigidEnvs/Stack-v0"
STEPS = 50  # of the scripted controller, until the hand carries the second cube to the tower
CAMERA = {"position": (0.33, -0.2, 0.26), "target": (0.0, 0.09, 0.07)}  # nearer than the task's
ENLARGED, GAP = 4, 8  # times, and pixels
NOTHING, OTHERS = (255, 255, 255), (120, 124, 135)  # colours of no solid, and of all but the cubes


def draw(path: Path) -> None:
    """Writes a PNG of the three kinds of pixels side by side."""
    kinds = ("rgb", "depth", "segmentation")
    arguments: dict[str, Any] = {
        "blocks": 3, "obs_type": "pixels+state", "pixels": kinds, "camera": CAMERA,
    }  # fmt: skip
    with closing(gym.make(ENV_ID, **arguments)) as env:
        observation, _ = env.reset(seed=1_000_000)
        for _ in range(STEPS):
            state = {**observation, "observation": observation["state"]}
            batch = {name: values[None] for name, values in state.items()}
            observation = env.step(controller_for(ENV_ID)(batch)[0].astype(np.float32))[0]
    pixels = observation["observation"]
    statics = (228, 231, 240)
    colors = np.array([NOTHING, *BODY_COLORS[:3], OTHERS, OTHERS, statics], dtype=np.uint8)
    shown = [pixels[:, :, :3], pixels[:, :, [3] * 3], colors[pixels[:, :, 4]]]
    side = ENLARGED * len(pixels)
    picture = Image.new("RGB", (3 * (side + GAP) - GAP, side), "white")
    for n, part in enumerate(shown):
        large = Image.fromarray(part).resize((side, side), Image.Resampling.NEAREST)
        picture.paste(large, (n * (side + GAP), 0))
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.save(path, optimize=True)
