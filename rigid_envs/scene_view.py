"""What a world looks like: its solids, goal and contact forces as items that a renderer draws."""

import numpy as np

from physics import Static
from rigid_envs.runner import Runner
from rigid_envs.view import Arrow, Goal, Item

BODY_COLORS = ((222, 132, 68), (86, 128, 196), (206, 92, 104), (118, 160, 84), (150, 112, 178))
DRIVE_COLOR = (92, 98, 110)
STATIC_COLOR = (170, 170, 165)
# m of arrow to a newton
FORCE_SCALE = 0.02


def items(runner: Runner, world: int) -> list[Item]:
    """Bodies, drives and statics of one world."""
    engine, scene = runner.world, runner.world.scene
    sizes = np.ones(len(scene.bodies))
    if engine.features.varied:
        sizes = engine.parameters.size[world]
    found = [
        Item(
            body.shape if sizes[i] == 1.0 else body.shape.scaled(float(sizes[i])),
            engine.position[world, i],
            engine.orientation[world, i],
            BODY_COLORS[i % len(BODY_COLORS)],
        )
        for i, body in enumerate(scene.bodies)
    ]
    for i, drive in enumerate(scene.tools):
        orientation = np.array(drive.orientation)
        position = engine.drive_position[world, i]
        found.append(Item(drive.shape, position, orientation, DRIVE_COLOR))
    for static in scene.statics:
        if isinstance(static, Static):
            pose = np.array(static.position), np.array(static.orientation)
            found.append(Item(static.shape, *pose, STATIC_COLOR))
    return found


def goals(runner: Runner, world: int) -> list[Goal]:
    """The goal of one world: a marker every three components."""
    points = runner.goals[world].astype(float).reshape(-1, 3)
    return [Goal(point, runner.task.reward.threshold) for point in points]


def forces(runner: Runner, world: int) -> list[Arrow]:
    """The contact forces of one world."""
    contacts = runner.world.contacts(world)
    return [
        Arrow(point, FORCE_SCALE * force)
        for point, force in zip(contacts.point, contacts.force, strict=True)
    ]
