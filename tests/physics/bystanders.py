"""Bystanders: far from a scene, one of all that needs kernels of its own.

A kernel is compiled for what a scene can meet, which takes up to a minute. Scenes that differ in
that alone share one if all of them have everything, out of reach.
"""

from dataclasses import replace

from physics import Body, Box, Capsule, Drive, Ground, Material, Scene, Sphere, Static

FAR = 100.0  # m


def with_bystanders(scene: Scene) -> Scene:
    """The scene, and far from it a box and a ball on a slab, a sphere, a capsule, ground, a tool.

    Bodies, statics and tools of the scene keep their places in front of them.
    """
    material = Material(0.5, 0.0, rolling_resistance=1e-3, spinning_resistance=5e-4)
    box = Body(Box((0.02, 0.03, 0.025)), mass=0.1, position=(0, FAR, 0.025), material=material)
    # surfaces of balls are for other balls alone
    ball = Body(Sphere(0.02), mass=0.1, position=(0.06, FAR, 0.02), material=material)
    statics = [
        Static(Box((0.1, 0.1, 0.05)), (0, FAR, -0.05), material=material),
        Static(Sphere(0.05), (FAR, 0, 0), material=material),
        Static(Capsule(0.05, 0.05), (FAR, FAR, 0), material=material),
    ]
    if not any(isinstance(static, Ground) for static in scene.statics):
        statics.append(Ground(material, -FAR))
    tools = [] if scene.drives else [Drive(Sphere(0.02), 0.05, 5.0, (-FAR, 0, 0))]
    return replace(
        scene,
        bodies=(*scene.bodies, box, ball),
        statics=(*scene.statics, *statics),
        drives=(*scene.drives, *tools),
    )
