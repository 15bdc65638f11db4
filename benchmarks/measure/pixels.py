"""Pixels of Push as observations: frames per second alone, and environment steps with them.

All worlds are in the middle of episodes with random actions. Two threads draw small pictures of
many worlds; one core draws a heap of 16,384 chess pieces of four balls each, before it falls.
panda-gym draws each step of one environment with its own software renderer.
"""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import gymnasium as gym

import rigid_envs  # noqa: F401  (registers the ids)
from benchmarks.measure.episodes import id_of
from benchmarks.peers.panda import PANDA, panda_side
from benchmarks.report.tables import Cell, Table
from benchmarks.report.timing import Side, rate, ratios_to, take_turns
from physics import World
from physics.reference.many_bodies import SCENES
from rigid_envs.rendering.crowd import Crowd

WORLDS, THREADS, STEPS = 1024, 2, 20
SIZES = {64: 20_000.0, 84: 10_000.0}  # pixels: target in frames per second
STEPS_TARGET = 8_000.0  # environment steps per second
PIECES, PIECES_TARGET = 16_384, 5.0
SECONDS, ROUNDS = 1.5, 5


def _envs(size: int, worlds: int) -> Any:
    envs: Any = gym.make_vec(
        id_of("Push"), num_envs=worlds, obs_type="pixels", pixel_size=size, threads=THREADS
    )
    envs.reset(seed=0)
    envs.action_space.seed(0)
    for _ in range(STEPS):
        envs.step(envs.action_space.sample())
    return envs


def steps_side(size: int, worlds: int = WORLDS) -> Side:
    """Each call makes a step of all worlds, with pictures, physics and reward."""
    envs = _envs(size, worlds)
    actions = envs.action_space.sample()

    def turn() -> int:
        envs.step(actions)
        return worlds

    return turn


def frames_side(size: int) -> Side:
    """Each call draws all worlds."""
    pixels = _envs(size, WORLDS).unwrapped.runner.pixels

    def turn() -> int:
        pixels.stepped()
        pixels.observe()
        return WORLDS

    return turn


def crowd_side() -> Side:
    """Each call draws a frame of 480 x 480 pixels."""
    scene, fidelity = SCENES["chess"](PIECES, 0)
    crowd = Crowd(World(scene, fidelity, threads=1))

    def turn() -> int:
        crowd.frame()
        return 1

    turn()
    return turn


def measure(panda_python: Path | None = None) -> Iterator[Table]:
    """Frames and steps by size of the picture, the heap, and panda-gym's steps.

    Args:
        panda_python: interpreter that has panda-gym installed, if any.
    """
    rows: list[list[Cell]] = [
        [f"{size} x {size}", target, rate(frames_side(size), SECONDS), STEPS_TARGET,
         rate(steps_side(size), SECONDS)]
        for size, target in SIZES.items()
    ]  # fmt: skip
    columns = ["pixels", "target frames", "frames per second"]
    columns += ["target steps", "env steps per second"]
    title = f"Push, {WORLDS:,} worlds, {THREADS} threads, pixels as observations"
    yield Table("pixels", title, columns, rows)
    heap: list[list[Cell]] = [["16,384 chess pieces", PIECES_TARGET, rate(crowd_side(), SECONDS)]]
    columns = ["frames per second", "target", "one core"]
    yield Table("heap frames", "Frames of 480 x 480 of many bodies, one core", columns, heap)
    if panda_python:
        with ExitStack() as children:
            sides = {
                "one world": steps_side(84, 1),
                f"{WORLDS:,} worlds": steps_side(84),
                PANDA: children.enter_context(panda_side(panda_python, pixels=84)),
            }
            rows = ratios_to(PANDA, take_turns(sides, ROUNDS, SECONDS))
        columns = ["env steps per second", "median", "ratio", "lowest", "highest"]
        yield Table("pixels and panda-gym", "Push with pixels of 84 x 84", columns, rows)
