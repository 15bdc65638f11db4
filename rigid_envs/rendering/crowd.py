"""Pictures of one world of many bodies, which are drawn by kind rather than one by one."""

from collections import defaultdict
from typing import Any

import numpy as np

from physics import Static, World
from physics.rotation import rotation_matrix
from rigid_envs.rendering.cameras import looking_at
from rigid_envs.rendering.primitives import placed, shape_primitives
from rigid_envs.rendering.renderer import Renderer
from rigid_envs.rendering.scene_view import DRIVE_COLOR, STATIC_COLOR, floor
from rigid_envs.rendering.view import BODY_COLORS, Item

Array = np.ndarray

WALL = 0.12  # opacity of statics, which may stand between the camera and the bodies
SHADES = 0.15  # by how much bodies of one colour differ in brightness


class Crowd:
    """Draws a world; the camera sees the places that its bodies have now, down to the ground.

    Args:
        world: with one world.
        size: width and height of a picture in pixels.
    """

    def __init__(self, world: World, size: int = 480) -> None:
        self._world, scene = world, world.scene
        kinds: dict[Any, list[int]] = defaultdict(list)
        for i, body in enumerate(scene.bodies):
            kinds[body.shape].append(i)
        self._kinds = [(shape_primitives(shape), np.array(own)) for shape, own in kinds.items()]
        reach = max(body.shape.reach for body in scene.bodies)
        position = world.position[0]
        low, high = position.min(axis=0) - reach, position.max(axis=0) + reach
        ground = floor(scene).height
        camera = looking_at((*low[:2], low[2] if ground is None else ground), high)
        # soft shadows of what hangs far above the ground would take most of the time
        self._renderer = Renderer(size, size, camera, soft=False, floor=ground)
        self._colors = _colors(len(scene.bodies))

    def frame(self) -> Array:
        """A picture [height, width, 3] uint8 of the world as it is now."""
        world, scene = self._world, self._world.scene
        position, turn = world.position[0], rotation_matrix(world.orientation[0])
        tables = []
        for local, own in self._kinds:
            table = placed(local, position[own][:, None], turn[own][:, None])
            table["color"], table["solid"] = self._colors[own][:, None], own[:, None]
            tables.append(table.reshape(-1))
        others = [
            Item(drive.shape, place, np.array(drive.orientation), DRIVE_COLOR)
            for drive, place in zip(scene.driven_bodies, world.drive_position[0], strict=True)
        ]
        for static in scene.statics:
            if isinstance(static, Static):
                pose = np.array(static.position), np.array(static.orientation)
                others.append(Item(static.shape, *pose, STATIC_COLOR, opacity=WALL))
        frames = self._renderer.frames(others, primitives=np.concatenate(tables)[None])
        assert frames.rgb is not None
        return np.asarray(frames.rgb[0])


def _colors(count: int) -> Array:
    """[count, 3] in 0..255: a fifth of the bodies each, in order, some darker and some brighter.

    Most scenes are built from the ground up, so that layers have a colour, and mix visibly.
    """
    colors = np.array(BODY_COLORS, dtype=float)[np.arange(count) * len(BODY_COLORS) // count]
    share = np.modf(0.618 * np.arange(count))[0]  # spreads evenly
    return np.asarray(np.clip(colors * (1.0 + SHADES * (2.0 * share - 1.0))[:, None], 0.0, 255.0))
