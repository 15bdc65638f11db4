"""Pictures of the tasks: frames of an episode in a row, and an animation of all tasks.

Trained policies of results/ play; the scripted controller builds the tower of three.
"""

from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from training.policies.policy import Policy, scripted_policy
from training.policies.trained_policy import shipped_policy
from training.results.gif import GifWriter
from training.results.video import film_episode
from training.settings.environments import make_single_env

Array = np.ndarray

GAP = 8  # pixels between frames


class Strip(NamedTuple):
    """Frames of an episode side by side.

    Attributes:
        task: its name.
        seed: of the episode.
        steps: after which a frame is drawn.
        arguments: of the environment; with any, the scripted controller plays.
    """

    task: str
    seed: int
    steps: tuple[int, ...]
    arguments: dict[str, Any]


STRIPS = {
    "pickandplace": Strip("PickAndPlace", 1_000_001, (0, 8, 14, 24), {}),
    "push": Strip("Push", 1_000_008, (0, 7, 13, 27), {}),
    "pusht": Strip("PushT", 1_000_009, (0, 12, 30, 60), {}),
    "reach": Strip("Reach", 1_000_001, (0, 2, 5), {}),
    "slide": Strip("Slide", 1_000_000, (0, 5, 12, 30), {}),
    "stack": Strip("Stack", 1_000_000, (0, 14, 60, 140), {"blocks": 3}),
    "throw": Strip("Throw", 1_000_000, (2, 8, 13, 17), {}),
}
SIZE = 360  # pixels of a strip's frame

# the animation: rows of tasks, and how many steps are shown of each task's episodes
FILM = (
    {"Push": 16, "Stack": 48, "Throw": 24},
    {"PushT": 48, "Reach": 12, "Slide": 32},
)
FILM_LENGTH = 96
FILM_SIZE, FILM_FPS, FILM_COLOURS = 250, 25.0, 96


def draw_strip(name: str, path: Path) -> None:
    """Writes a PNG of the frames of an episode."""
    strip = STRIPS[name]
    frames = episode(strip.task, strip.seed, max(strip.steps), SIZE, **strip.arguments)
    shown = [frame for step, frame in enumerate(frames) if step in strip.steps]
    picture = Image.new("RGB", (len(shown) * (SIZE + GAP) - GAP, SIZE), "white")
    for n, frame in enumerate(shown):
        picture.paste(Image.fromarray(frame), (n * (SIZE + GAP), 0))
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.save(path, optimize=True)


def draw_film(path: Path) -> None:
    """Writes a GIF of all tasks, in rows."""
    films = np.array([[_film(task, steps) for task, steps in row.items()] for row in FILM])
    rows, columns, length = films.shape[:3]
    pitch = FILM_SIZE + GAP
    width = columns * pitch - GAP
    pictures = np.full((length, rows * pitch - GAP, width, 3), 255, np.uint8)
    for row, column in np.ndindex(rows, columns):
        top, left = row * pitch, column * pitch
        pictures[:, top : top + FILM_SIZE, left : left + FILM_SIZE] = films[row, column]
    path.parent.mkdir(parents=True, exist_ok=True)
    with GifWriter(path, FILM_FPS, width, FILM_COLOURS) as writer:
        for picture in pictures:
            writer.append_data(picture)


def _film(task: str, steps: int) -> list[Array]:
    """FILM_LENGTH frames: `steps` of each of several episodes."""
    return [
        frame
        for k in range(FILM_LENGTH // steps)
        for frame in episode(task, 1_000_000 + k, steps, FILM_SIZE)[1:]
    ]


def episode(task: str, seed: int, steps: int, size: int, **arguments: Any) -> list[Array]:
    """Frames of an episode: one at the start, and one after each step."""
    acting = player(task, arguments)
    shown = {"width": size, "height": size, "max_episode_steps": -1, "render_mode": "rgb_array"}
    with closing(make_single_env(acting.env_id, **{**acting.env_kwargs, **shown})) as env:
        return film_episode(env, acting, seed, steps=steps)


def player(task: str, arguments: dict[str, Any]) -> Policy:
    """Who acts: the scripted controller where there are arguments, else the trained policy."""
    env_id = f"RigidEnvs/{task}-v0"
    return scripted_policy(env_id, **arguments) if arguments else shipped_policy(env_id)
