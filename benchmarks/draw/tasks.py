"""Picture: the three tasks side by side, played by recorded policies."""

from contextlib import closing
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

from benchmarks.report.provenance import ROOT
from training.policies.policy_file import read_policy
from training.settings.environments import make_single_env


class Shot(NamedTuple):
    """One frame of an episode.

    Attributes:
        task: name of the task.
        seed: of the episode.
        step: environment step at which it is drawn.
        left, top, size: the square of the frame that is shown, as fractions of its width.
    """

    task: str
    seed: int
    step: int
    left: float
    top: float
    size: float


SHOTS = (
    Shot("Push", 1_000_000, 8, 0.40, 0.27, 0.52),
    Shot("Stack", 1_000_000, 30, 0.22, 0.18, 0.66),
    Shot("Throw", 1_000_000, 11, 0.27, 0.06, 0.46),
)
SIZE = 400  # pixels, width and height of each frame
GAP = 8  # pixels between frames


def draw(path: Path) -> None:
    """Writes a PNG of the three frames in a row."""
    picture = Image.new("RGB", (len(SHOTS) * (SIZE + GAP) - GAP, SIZE), "white")
    for n, shot in enumerate(SHOTS):
        picture.paste(Image.fromarray(_frame(shot)), (n * (SIZE + GAP), 0))
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.save(path, optimize=True)


def _frame(shot: Shot) -> np.ndarray:
    policy = read_policy(ROOT / f"results/ppo/RigidEnvs-{shot.task}-v0_seed0/policy.policy")
    pixels = round(SIZE / shot.size)
    arguments = {**policy.env_kwargs, "render_mode": "rgb_array", "render_size": pixels}
    with closing(make_single_env(policy.env_id, **arguments)) as env:
        observation, _ = env.reset(seed=shot.seed)
        for _ in range(shot.step):
            batch = {name: np.asarray(values)[None] for name, values in observation.items()}
            action = np.asarray(policy.act(batch))[0].astype(env.action_space.dtype)
            observation = env.step(action)[0]
        frame = env.render()
    assert isinstance(frame, np.ndarray)
    row, column = round(shot.top * pixels), round(shot.left * pixels)
    return frame[row : row + SIZE, column : column + SIZE]
