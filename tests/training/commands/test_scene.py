"""Scenes of many bodies from the command line."""

import math
import re
from dataclasses import replace

import imageio.v2 as imageio
import numpy as np
import pytest

from physics import World
from physics.reference.many_bodies import SCENES, pyramid
from training.commands.cli import main


def test_a_scene_prints_its_speed_energy_and_penetration(capsys):
    assert main(["scene", "heap", "--bodies", "40", "--seconds", "0.1", "--threads", "1"]) == 0
    shown = capsys.readouterr().out
    assert "heap: 40 bodies, law spring, substep 0.5 ms" in shown
    assert re.search(r"\d+ steps/s, .* simulated seconds a second", shown)
    assert re.search(
        r"0\.100 s simulated in 200 steps; energy .* J, kinetic .* J; deepest penetration .* mm",
        shown,
    )


def test_ctrl_c_ends_a_scene_with_what_was_made(capsys, monkeypatch):
    advance, calls = World.advance, []

    def interrupted(world, time):
        calls.append(time)
        if len(calls) == 3:
            raise KeyboardInterrupt
        advance(world, time)

    monkeypatch.setattr(World, "advance", interrupted)
    assert main(["scene", "heap", "--bodies", "40", "--seconds", "1", "--threads", "1"]) == 130
    shown = capsys.readouterr().out
    assert "s simulated in 81 steps" in shown
    assert "Traceback" not in shown


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["cards"], r"unknown scene 'cards': choose one of chess, tori, pyramid"),
        (["heap", "--bodies", "100000000"], r"100000000 bodies of a scene need 150 GB"),
        (["heap", "--bodies", "0"], r"'0' should be an integer of at least 1"),
        (["heap", "--seconds", "-1"], r"'-1' should be a finite number above 0"),
        (["heap", "--seconds", "nan"], r"'nan' should be a finite number above 0"),
    ],
)
def test_mistakes_are_one_line(arguments, message, capsys):
    assert main(["scene", *arguments]) == 2
    shown = capsys.readouterr().err
    assert re.search(message, shown)
    assert shown.count("\n") == 1


@pytest.mark.parametrize("name", sorted(SCENES))
def test_scenes_have_as_many_bodies_as_asked_for_and_none_overlap_deeply(name):
    scene, fidelity = SCENES[name](120 if name != "pyramid" else 45, 3)
    assert len(scene.bodies) == (120 if name != "pyramid" else 45)
    world = World(scene, fidelity)
    world.advance(1.0)
    thinnest = min(body.shape.width for body in scene.bodies)
    assert world.penetration()[0] < 0.1 * thinnest


def test_a_pyramid_has_complete_rows():
    assert len(pyramid(5050).scene.bodies) == 5050
    assert len(pyramid(54).scene.bodies) == 45


@pytest.mark.parametrize("name", ["film.mp4", "film.gif"])
def test_a_video_has_a_frame_for_each_25th_of_a_second(name, tmp_path, capsys):
    video = tmp_path / "made" / name
    words = ["scene", "heap", "--bodies", "40", "--seconds", "0.2", "--size", "64"]
    assert main([*words, "--video", str(video)]) == 0
    assert "film" in capsys.readouterr().out
    frames = imageio.mimread(video)
    assert len(frames) == (6 if name.endswith("mp4") else 3)  # a GIF has every second one
    assert np.shape(frames[0])[:2] == (64, 64)
    assert (frames[0] != frames[-1]).any()


@pytest.mark.parametrize(
    ("video", "message"),
    [
        ("film.avi", r"error: video is 'film\.avi', should end in \.mp4 or \.gif"),
        ("/proc/none/film.mp4", r"cannot write '/proc/none/film\.mp4'"),
    ],
)
def test_a_video_that_cannot_be_written_is_named_before_anything_runs(video, message, capsys):
    assert main(["scene", "heap", "--bodies", "40", "--video", video]) == 2
    shown = capsys.readouterr()
    assert re.search(message, shown.err)
    assert "simulated" not in shown.out


def test_a_video_that_is_too_large_is_refused(capsys, tmp_path):
    words = ["scene", "heap", "--bodies", "40", "--video", str(tmp_path / "x.mp4")]
    assert main([*words, "--size", "5000"]) == 2
    assert "--size is 5000, should be 16 to 4096 pixels" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_all_dominoes_fall_and_the_wave_has_the_speed_of_half_the_step():
    scene, fidelity = SCENES["dominoes"](60, 0)
    speeds = []
    for level in (fidelity, replace(fidelity, substep=0.5 * fidelity.substep)):
        world = World(scene, level)
        world.advance(1.5)
        tilted = np.array([up_of(world, body) for body in range(60)])
        assert tilted.max() < math.cos(math.radians(30.0))
        touched = [float(world.first_touch(n, n + 1)[0]) for n in (20, 50)]
        speeds.append(30 * 0.02 / (touched[1] - touched[0]))
    assert speeds[0] == pytest.approx(speeds[1], rel=0.03)
    assert 0.95 < speeds[1] < 1.05  # m/s


def up_of(world, body):
    """Cosine of the angle by which a body is tilted."""
    x, y = world.orientation[0, body, :2]
    return 1.0 - 2.0 * (x * x + y * y)
