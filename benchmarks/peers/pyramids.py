"""The pyramid of cubes in MuJoCo and PyBullet. As a script it runs PyBullet's and prints its rate.

Millions of body-substeps per second over the first 60 steps of 1/240 s, on one core. The script
imports nothing of this project, so that it runs in an environment of its own.
"""

import json
import math
import sys
from time import perf_counter

STEPS, STEP, GAP = 60, 1.0 / 240.0, 0.05


def places(count: int) -> list[tuple[float, float]]:
    """x and z in m of the cubes' centres."""
    base = int((math.sqrt(8 * count + 1) - 1) / 2)
    return [
        ((k - (base - row - 1) / 2) * (1.0 + GAP), 0.5 + row)
        for row in range(base)
        for k in range(base - row)
    ]


def mujoco_rate(count: int) -> float:
    """MuJoCo's rate, with the Euler integrator and the elliptic cone."""
    import mujoco

    cubes = "".join(
        f'<body pos="{x} 0 {z}"><freejoint/><geom type="box" size=".5 .5 .5" mass="1000"/></body>'
        for x, z in places(count)
    )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{STEP}" cone="elliptic"/><size memory="1G"/>'
        '<default><geom friction="0.6 0 0" condim="3"/></default><worldbody>'
        f'<geom type="plane" size="0 0 1"/>{cubes}</worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    start = perf_counter()
    for _ in range(STEPS):
        mujoco.mj_step(model, data)
    return 1e-6 * STEPS * count / (perf_counter() - start)


def pybullet_rate(count: int) -> float:
    """PyBullet's rate, with its default solver."""
    import pybullet

    pybullet.connect(pybullet.DIRECT)
    pybullet.setTimeStep(STEP)
    pybullet.setGravity(0, 0, -9.81)
    plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE)
    pybullet.changeDynamics(pybullet.createMultiBody(0, plane), -1, lateralFriction=0.6)
    cube = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.5, 0.5, 0.5])
    for x, z in places(count):
        body = pybullet.createMultiBody(1000.0, cube, -1, [x, 0.0, z])
        pybullet.changeDynamics(body, -1, lateralFriction=0.6)
    pybullet.stepSimulation()
    start = perf_counter()
    for _ in range(STEPS):
        pybullet.stepSimulation()
    return 1e-6 * STEPS * count / (perf_counter() - start)


if __name__ == "__main__":
    print(json.dumps(pybullet_rate(int(sys.argv[1]))))
