"""A small scene for each general kernel that the presets use, to compile them ahead."""

from typing import NamedTuple

from physics.reference.scenes import CUBE, block_on_ground
from physics.scene.scene import Scene
from physics.scene.solids import Body
from physics.world import World


class GeneralKernel(NamedTuple):
    """What a World needs to get a general kernel.

    Attributes:
        scene: the scene.
        fidelity: name of a preset.
        per_world_parameters: see `World`.
    """

    scene: Scene
    fidelity: str = "balanced"
    per_world_parameters: bool = False


GENERAL_KERNELS = {
    "springs": GeneralKernel(block_on_ground()),
    "impulses": GeneralKernel(block_on_ground(), "solid"),
    "no contacts": GeneralKernel(Scene([Body(CUBE, mass=0.1)])),
    "springs, per-world parameters": GeneralKernel(block_on_ground(), per_world_parameters=True),
    "impulses, per-world parameters": GeneralKernel(block_on_ground(), "solid", True),
}


def compile_general(name: str) -> None:
    """Compiles a general kernel, unless that has been done, and what reads poses."""
    scene, fidelity, per_world = GENERAL_KERNELS[name]
    world = World(scene, fidelity, per_world_parameters=per_world, kernel="general")
    world.advance(world.fidelity.substep)
    world.reset()
    world.read()
