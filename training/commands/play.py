"""The play command: a window in which the keyboard controls the finger or gripper."""

from collections.abc import Iterable, Sequence
from contextlib import closing
from typing import Any

import numpy as np

from rigid_envs.rendering.window import Key, NoDisplay, Window, check_display, load_pygame
from training.settings.environments import make_single_env
from training.settings.errors import UsageError

Array = np.ndarray

# pixels, width and height of the frame; larger than that of a video
SIZE = 720
# directions in the frame (right, away from the camera, up) by pygame's names of keys
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
# fractions of the full action: the full action is too fast to place a cube
PACE, FAST_PACE = 0.3, 1.0
# m, initial distance between the pads below which the gripper holds an object
HOLDING_OPENING = 0.06
HELP = (
    "arrows or WASD: move      page up, page down or R, F: up and down      shift: fast",
    "space: open or close the gripper      N or backspace: new episode      Esc: quit",
)


def action_of(held: Iterable[str], components: int, *, closed: bool, azimuth: float) -> Array:
    """The action for the keys that are held down.

    Args:
        held: Names of the keys.
        components: Number of components of the action: displacement along x and y; along x, y and
            z; or these and the grip.
        closed: Whether to close the gripper.
        azimuth: Azimuth of the camera in degrees; keys move along the axis that is nearest to the
            direction in the frame.

    Returns:
        [components] float32 within [-1, 1].
    """
    held = set(held)
    moves = [MOVES[key] for key in held & MOVES.keys()]
    right, away, up = np.clip(np.sum(moves, axis=0) if moves else np.zeros(3), -1.0, 1.0)
    # at -90 degrees x points to the right of the frame and y away; round to quarter turns of this
    turn = np.radians(90.0 * np.round((azimuth + 90.0) / 90.0))
    cos, sin = np.round(np.cos(turn)), np.round(np.sin(turn))
    move = np.array([cos * right - sin * away, sin * right + cos * away, up])
    action = np.zeros(components, dtype=np.float32)
    action[:3] = (FAST_PACE if held.intersection(FAST) else PACE) * move[:components]
    action[3:] = -1.0 if closed else 1.0
    return action


class Game:
    """An environment that is controlled by keys, step by step.

    Args:
        env: A single environment of `rigid_envs`.
        seed: Seed of the first episode; random if None.
    """

    def __init__(self, env: Any, seed: int | None = None) -> None:
        """Starts the first episode."""
        self.env, self.held, self.quit = env, set[str](), False
        self._components = env.action_space.shape[0]
        self._task = env.unwrapped.task
        self.start_episode(seed)

    def start_episode(self, seed: int | None = None) -> None:
        """Starts the first episode of a seed, or the next episode."""
        observation, info = self.env.reset(seed=seed)
        names = [bound[0] for bound in self._task.bounds]
        state = observation.get("state", observation["observation"])
        opening = state[names.index("opening")] if "opening" in names else 1.0
        self.closed = bool(opening < HOLDING_OPENING)
        self.steps, self.reward, self.total = 0, 0.0, 0.0
        self.solved = bool(info["is_success"])

    def press(self, keys: Iterable[Key]) -> None:
        """Processes keys that were pressed or released."""
        for key in keys:
            (self.held.add if key.down else self.held.discard)(key.name)
            if key.down and key.name in GRIP:
                self.closed = not self.closed
            elif key.down and key.name in RESET:
                self.start_episode()
            elif key.down and key.name in QUIT:
                self.quit = True

    def step(self) -> None:
        """Advances by a step; starts the next episode at the end of one."""
        azimuth = self.env.unwrapped.camera.azimuth
        action = action_of(self.held, self._components, closed=self.closed, azimuth=azimuth)
        _, reward, terminated, truncated, info = self.env.step(action)
        self.steps, self.reward, self.total = self.steps + 1, reward, self.total + reward
        self.solved = bool(info["is_success"])
        if terminated or truncated:
            self.start_episode()

    @property
    def text(self) -> tuple[str, ...]:
        """The lines below the frame."""
        state = f"step {self.steps}      reward {self.reward:+.2f}      return {self.total:+.1f}"
        return (state + ("      SOLVED" if self.solved else ""), *HELP)


def play(env_id: str, *, seed: int | None = None, fps: float = 25.0, **env_kwargs: Any) -> int:
    """Opens a window and runs until it is closed.

    Episodes have no step limit unless `env_kwargs` sets `max_episode_steps`.

    Args:
        env_id: Environment id.
        seed: Seed of the first episode; random if None.
        fps: Frames per second; one frame is one step.
        env_kwargs: Arguments of the environment.

    Returns:
        The number of steps played.

    Raises:
        UsageError: The id or an argument is invalid, or there is no display.
    """
    if env_kwargs.get("obs_type", "state") == "pixels":
        raise UsageError('play needs the state: obs_type must be "state" or "pixels+state"')
    arguments = {"max_episode_steps": -1, "width": SIZE, "height": SIZE, **env_kwargs}
    env = make_single_env(env_id, render_mode="rgb_array", **arguments)
    width, height, played = arguments["width"], arguments["height"], 0
    window = Window(width, height, fps, f"{env_id}: play", len(HELP) + 1)
    try:
        check_display()
    except NoDisplay:
        raise UsageError("cannot open a window: there is no display") from None
    with closing(env), closing(window):
        game = Game(env, seed)
        while not (window.closed or game.quit):
            frame: Any = env.render()
            game.press(_show(window, frame, game.text))
            if not (window.closed or game.quit):
                game.step()
                played += 1
    return played


def _show(window: Window, frame: Array, text: Sequence[str]) -> list[Key]:
    pygame = load_pygame()
    try:
        return window.show(frame, text)
    except pygame.error as error:
        raise UsageError(f"cannot open a window: {error}") from None
