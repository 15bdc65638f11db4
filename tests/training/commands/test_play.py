"""Play: keys move the finger or gripper as the frame shows; closing the window ends the game."""

import gymnasium as gym
import numpy as np
import pygame
import pytest

from rigid_envs.rendering.window import Key, Window
from rigid_envs.tasks import Push, Stack, Throw
from training.commands import cli, extras
from training.commands.play import FAST_PACE, MOVES, PACE, Game, action_of, play
from training.settings.environments import make_single_env
from training.settings.errors import UsageError

PUSH, STACK, THROW = (f"RigidEnvs/{name}-v0" for name in ("Push", "Stack", "Throw"))
ALONG_X = -90.0  # degrees, azimuth at which x points to the right of the frame and y away


@pytest.fixture
def game():
    games = []

    def make(env_id, **arguments):
        env = make_single_env(env_id, fidelity="fast", **arguments)
        games.append(Game(env, 3))
        return games[-1]

    yield make
    for one in games:
        one.env.close()


# --- keys ---------------------------------------------------------------------------------------


def test_no_key_gives_no_motion():
    assert action_of([], 3, closed=False, azimuth=ALONG_X).tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("key", MOVES)
def test_key_moves_in_the_direction_of_the_frame(key):
    action = action_of([key], 3, closed=False, azimuth=ALONG_X)
    np.testing.assert_allclose(action, PACE * np.array(MOVES[key]), rtol=1e-6)


@pytest.mark.parametrize("task", [Push(), Stack(), Throw()], ids=lambda t: type(t).__name__)
@pytest.mark.parametrize("key", ["right", "left", "up", "down", "r", "f"])
def test_motion_is_within_45_degrees_of_the_key_s_direction(key, task):
    right, _, forward = task.camera.axes
    away = forward * (1.0, 1.0, 0.0) / np.hypot(*forward[:2])
    direction = np.array(MOVES[key]) @ np.stack([right, away, (0.0, 0.0, 1.0)])
    move = action_of([key], 3, closed=False, azimuth=task.camera.azimuth)
    assert move @ direction > np.cos(np.radians(45.0)) * PACE


def test_keys_add_up_and_opposite_keys_cancel():
    both = action_of(["right", "up"], 3, closed=False, azimuth=ALONG_X)
    np.testing.assert_allclose(both, [PACE, PACE, 0.0], rtol=1e-6)
    assert not action_of(["left", "right"], 3, closed=False, azimuth=ALONG_X).any()


def test_two_keys_of_one_direction_are_no_faster_than_one():
    one, two = (action_of(k, 3, closed=False, azimuth=ALONG_X) for k in (["a"], ["a", "left"]))
    np.testing.assert_array_equal(one, two)


def test_shift_is_fast():
    fast = action_of(["right", "left shift"], 3, closed=False, azimuth=ALONG_X)
    np.testing.assert_allclose(fast, [FAST_PACE, 0.0, 0.0])


def test_the_grip_is_the_last_component():
    assert action_of([], 4, closed=True, azimuth=ALONG_X)[3] == -1.0
    assert action_of([], 4, closed=False, azimuth=ALONG_X)[3] == 1.0


def test_other_keys_do_nothing():
    assert not action_of(["q", "tab"], 3, closed=False, azimuth=ALONG_X).any()


# --- game ---------------------------------------------------------------------------------------


def test_key_acts_while_it_is_down(game):
    playing = game(PUSH)
    playing.press([Key("right", True)])
    playing.step()
    assert playing.held == {"right"}
    playing.press([Key("right", False)])
    assert playing.held == set()
    assert playing.steps == 1


@pytest.mark.parametrize(("env_id", "closed"), [(PUSH, False), (STACK, False), (THROW, True)])
def test_gripper_that_holds_an_object_starts_closed(game, env_id, closed):
    assert game(env_id).closed is closed


def test_space_releases_the_ball(game):
    playing = game(THROW)
    heights = []
    for keys in ([], [Key("space", True), Key("space", False)]):
        playing.press(keys)
        for _ in range(8):
            playing.step()
        heights.append(playing.env.unwrapped._runner.world.position[0, 0, 2])
    assert heights[0] > 0.2
    assert heights[1] < 0.1
    assert not playing.closed


@pytest.mark.parametrize("key", ["n", "backspace"])
def test_key_starts_a_new_episode(game, key):
    playing = game(PUSH)
    goal = playing.env.unwrapped._runner.goals.copy()
    playing.step()
    playing.press([Key(key, True)])
    assert (playing.steps, playing.total) == (0, 0.0)
    assert (playing.env.unwrapped._runner.goals != goal).any()


def test_next_episode_follows_the_end_of_an_episode(game):
    playing = game(PUSH, max_episode_steps=2)
    for _ in range(3):
        playing.step()
    assert playing.steps == 1


def test_text_shows_step_reward_and_success(game):
    playing = game(PUSH)
    playing.step()
    assert "step 1" in playing.text[0]
    assert "reward -1.00" in playing.text[0]
    assert "SOLVED" not in playing.text[0]
    runner = playing.env.unwrapped._runner
    runner.world.set_state(position=runner.goals[:, None].astype(float))
    playing.step()
    assert "SOLVED" in playing.text[0]


# --- window -------------------------------------------------------------------------------------


@pytest.fixture
def keyboard(monkeypatch):
    """Posts pygame events before the nth frame is shown, by n; lists the texts under "shown"."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    script = {"shown": (shown := [])}
    show = Window.show

    def scripted(window, picture, text=()):
        shown.append(text)
        if window._surface is None:
            window._open()
            pygame.event.clear()
        for event in script.get(len(shown), []):
            pygame.event.post(event)
        return show(window, picture, text)

    monkeypatch.setattr(Window, "show", scripted)
    return script


def down(key):
    return pygame.event.Event(pygame.KEYDOWN, key=key)


SMALL = {"fidelity": "fast", "fps": 1000.0, "width": 64, "height": 64}


def test_closing_the_window_ends_the_game(keyboard):
    keyboard[4] = [pygame.event.Event(pygame.QUIT)]
    assert play(PUSH, seed=0, **SMALL) == 3
    assert not pygame.display.get_init()


def test_escape_ends_the_game(keyboard):
    keyboard[2] = [down(pygame.K_ESCAPE)]
    assert play(PUSH, seed=0, **SMALL) == 1
    assert not pygame.display.get_init()


def test_keys_reach_the_environment(keyboard):
    keyboard[1], keyboard[3] = [down(pygame.K_LEFT)], [down(pygame.K_n)]
    keyboard[5] = [down(pygame.K_ESCAPE)]
    assert play(STACK, seed=0, blocks=3, **SMALL) == 4
    steps = [text[0].split()[1] for text in keyboard["shown"]]
    assert steps == ["0", "1", "2", "1", "2"]


def test_keys_follow_the_chosen_camera():
    moved = []
    for camera in ("front", "back"):
        env = make_single_env(PUSH, fidelity="fast", camera=camera)
        played, world = Game(env, 0), env.unwrapped._runner.world
        start = world.drive_position[0, 0].copy()
        played.press([Key("right", True)])
        played.step()
        moved.append(world.drive_position[0, 0] - start)
    assert moved[0][0] > 1e-4
    np.testing.assert_allclose(moved[0][:2], -moved[1][:2], atol=1e-9)


def test_pixels_alone_cannot_be_played():
    with pytest.raises(UsageError, match='obs_type must be "state"'):
        play(PUSH, seed=0, obs_type="pixels", **SMALL)


def test_episodes_have_no_step_limit_by_default(keyboard):
    keyboard[60] = [down(pygame.K_ESCAPE)]
    play(PUSH, seed=0, **SMALL)
    assert keyboard["shown"][-1][0].startswith("step 59 ")


def test_no_display_raises(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "no such driver")
    with pytest.raises(UsageError, match="cannot open a window"):
        play(PUSH, **SMALL)


# --- command ------------------------------------------------------------------------------------


def test_command_passes_arguments_to_the_environment(keyboard, capsys):
    keyboard[1] = [down(pygame.K_ESCAPE)]
    words = ["play", STACK, "--blocks", "3", "--fidelity", "fast", "--seed", "1"]
    words += ["--reward", "dense", "--show-forces", "--show-particles"]
    assert cli.main([*words, "--env-kwargs", "width:64", "height:64"]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["RigidEnvs/Pusj-v0"], "did you mean 'RigidEnvs/Push-v0'"),
        (["--blocks", "3"], "unknown argument 'blocks'"),
        (["--reward", "shaped"], "invalid choice: 'shaped'"),
        (["--fidelity", "lavish"], "lavish"),
    ],
)
def test_mistakes_are_reported_in_one_line(words, complaint, capsys):
    assert cli.main(["play", *words]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ")
    assert error.count("\n") == 1
    assert complaint in error


def test_play_requires_only_pygame(monkeypatch, capsys):
    monkeypatch.setattr(extras, "TRAIN_EXTRA", ("no_such_package",))
    monkeypatch.setattr(extras, "RENDER_EXTRA", ("no_such_pygame",))
    assert cli.main(["play"]) == 2
    assert capsys.readouterr().err == (
        "error: this command requires no_such_pygame; "
        'to install, in a clone: pip install -c constraints.txt -e ".[render]"\n'
    )


@pytest.mark.parametrize("env_id", [name for name in gym.registry if name.startswith("RigidEnvs/")])
def test_every_task_can_be_played(game, env_id):
    playing = game(env_id)
    playing.press([Key("right", True), Key("r", True)])
    playing.step()
    assert playing.steps == 1
