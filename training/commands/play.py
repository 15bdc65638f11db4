"""Play: a window in which the keyboard drives an environment's tool."""

from collections.abc import Iterable, Sequence
from contextlib import closing
from typing import Any

import numpy as np

from rigid_envs.rendering.window import Key, NoDisplay, Window, load_pygame
from training.settings.environments import make_single_env
from training.settings.errors import UsageError

Array = np.ndarray

# pixels of the picture, larger than a film's
SIZE = 720
# by pygame's names: what moves the tool as its picture shows it (right, away, up)
MOVES: dict[str, tuple[int, int, int]] = {
    **dict.fromkeys(("right", "d"), (1, 0, 0)),
    **dict.fromkeys(("left", "a"), (-1, 0, 0)),
    **dict.fromkeys(("up", "w"), (0, 1, 0)),
    **dict.fromkeys(("down", "s"), (0, -1, 0)),
    **dict.fromkeys(("page up", "r"), (0, 0, 1)),
    **dict.fromkeys(("page down", "f"), (0, 0, -1)),
}
FAST, GRIP = ("left shift", "right shift"), ("space",)
RESET, QUIT = ("n", "backspace"), ("escape",)
# shares of the full action: the whole of it is too much to place a cube
PACE, FAST_PACE = 0.3, 1.0
# m between the pads under which a hand holds something at the start
HELD = 0.06
HELP = (
    "arrows or WASD: move      page up, page down or R, F: up and down      shift: fast",
    "space: open or close the gripper      N or backspace: new episode      Esc: quit",
)


def action_of(held: Iterable[str], components: int, *, closed: bool, azimuth: float) -> Array:
    """The action that the keys held down ask for.

    Args:
        held: names of keys.
        components: of the action: displacement along x, y, z, and after it, if there is one, grip.
        closed: whether the gripper shall be closed.
        azimuth: degrees of the camera; keys go along the axes that its picture shows that way.

    Returns:
        [components] float32 within [-1, 1].
    """
    held = set(held)
    moves = [MOVES[key] for key in held & MOVES.keys()]
    right, away, up = np.clip(np.sum(moves, axis=0) if moves else np.zeros(3), -1.0, 1.0)
    # at -90 degrees x points to the right and y into the picture; others are quarter turns of it
    turn = np.radians(90.0 * np.round((azimuth + 90.0) / 90.0))
    cos, sin = np.round(np.cos(turn)), np.round(np.sin(turn))
    move = np.array([cos * right - sin * away, sin * right + cos * away, up])
    action = np.zeros(components, dtype=np.float32)
    action[:3] = (FAST_PACE if held.intersection(FAST) else PACE) * move
    action[3:] = -1.0 if closed else 1.0
    return action


class Game:
    """An environment that keys drive, step by step.

    Args:
        env: a single environment of `rigid_envs`.
        seed: of the first episode; any if None.
    """

    def __init__(self, env: Any, seed: int | None = None) -> None:
        """Starts the first episode."""
        self.env, self.held, self.quit = env, set[str](), False
        self._components = env.action_space.shape[0]
        self._task = env.unwrapped.task
        self.begin(seed)

    def begin(self, seed: int | None = None) -> None:
        """Starts an episode: the seed's first, or the next one."""
        observation, info = self.env.reset(seed=seed)
        names = [bound[0] for bound in self._task.bounds]
        opening = observation["observation"][names.index("opening")] if "opening" in names else 1.0
        self.closed = bool(opening < HELD)
        self.steps, self.reward, self.total = 0, 0.0, 0.0
        self.solved = bool(info["is_success"])

    def press(self, keys: Iterable[Key]) -> None:
        """Takes note of keys that went down or up, and does at once what they ask for."""
        for key in keys:
            (self.held.add if key.down else self.held.discard)(key.name)
            if key.down and key.name in GRIP:
                self.closed = not self.closed
            elif key.down and key.name in RESET:
                self.begin()
            elif key.down and key.name in QUIT:
                self.quit = True

    def step(self) -> None:
        """Advances by a frame; an episode that ends is followed by the next."""
        azimuth = self._task.camera.azimuth
        action = action_of(self.held, self._components, closed=self.closed, azimuth=azimuth)
        _, reward, terminated, truncated, info = self.env.step(action)
        self.steps, self.reward, self.total = self.steps + 1, reward, self.total + reward
        self.solved = bool(info["is_success"])
        if terminated or truncated:
            self.begin()

    @property
    def text(self) -> tuple[str, ...]:
        """What to write below the picture."""
        state = f"step {self.steps}      reward {self.reward:+.2f}      total {self.total:+.1f}"
        return (state + ("      SOLVED" if self.solved else ""), *HELP)


def play(env_id: str, *, seed: int | None = None, fps: float = 25.0, **env_kwargs: Any) -> int:
    """Opens a window and lets its user play until it is closed.

    Episodes have no limit of steps unless `env_kwargs` hold one.

    Args:
        env_id: Environment.
        seed: Of the first episode; any if None.
        fps: Frames a second, which is the pace of the world too.
        env_kwargs: Arguments of the environment.

    Returns:
        How many steps were played.

    Raises:
        UsageError: The id or an argument is wrong, or there is no display.
    """
    arguments = {"max_episode_steps": -1, "render_size": SIZE, **env_kwargs}
    env = make_single_env(env_id, render_mode="rgb_array", **arguments)
    size, played = arguments["render_size"], 0
    window = Window(size, size, fps, f"{env_id}: play", len(HELP) + 1)
    with closing(env), closing(window):
        game = Game(env, seed)
        while not (window.closed or game.quit):
            picture: Any = env.render()
            game.press(_show(window, picture, game.text))
            if not (window.closed or game.quit):
                game.step()
                played += 1
    return played


def _show(window: Window, picture: Array, text: Sequence[str]) -> list[Key]:
    pygame = load_pygame()
    try:
        return window.show(picture, text)
    except NoDisplay:
        raise UsageError("no window can be opened: there is no display") from None
    except pygame.error as error:
        raise UsageError(f"no window can be opened: {error}") from None
