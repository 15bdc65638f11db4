"""One of our scenes as a MuJoCo model."""

import math
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np

try:
    import mujoco
except ModuleNotFoundError:
    raise SystemExit("MuJoCo is missing: pip install -e '.[bench]', or make bench") from None

from benchmarks.peers.mujoco_options import MujocoOptions
from physics import BallJoint, Body, Box, Capsule, Drive, Ground, Hinge, Scene, Slider, Sphere
from physics.rotation import rotate_back
from physics.scene.shapes import Shape

Array = np.ndarray


def _text(*values: float) -> str:
    return " ".join(f"{float(v):.17g}" for v in values)


def _geom(parent: Element, name: str, shape: Shape, mass: float | None) -> None:
    size: tuple[float, ...]
    if isinstance(shape, Box):
        kind, size = "box", shape.half_extents
    elif isinstance(shape, Capsule):
        kind, size = "capsule", (shape.radius, shape.half_length)
    else:
        assert isinstance(shape, Sphere)
        kind, size = "sphere", (shape.radius,)
    geom = SubElement(parent, "geom", name=name, type=kind, size=_text(*size))
    geom.attrib.update(contype="0", conaffinity="0")  # contact pairs are listed
    if mass is not None:
        geom.set("mass", _text(mass))


def _joint(parent: Element, scene: Scene, body: int) -> None:
    """The joint of a body to the world; a free one if the scene has none."""
    solid = scene.bodies[body]
    for joint in scene.joints:
        if scene.joint_ends(joint) != (body, None):
            continue
        assert isinstance(joint, BallJoint | Hinge | Slider)
        assert joint.anchor is not None
        away = np.subtract(joint.anchor, solid.position)
        turn = np.array(solid.orientation)
        kinds = {BallJoint: "ball", Hinge: "hinge", Slider: "slide"}
        found = SubElement(parent, "joint", type=kinds[type(joint)])
        found.set("pos", _text(*rotate_back(turn, away)))
        if not isinstance(joint, BallJoint):
            found.set("axis", _text(*rotate_back(turn, np.array(joint.axis))))
        return
    SubElement(parent, "freejoint")


def model_of(scene: Scene, options: MujocoOptions, *, grip: bool = False) -> mujoco.MjModel:
    """A model of the same solids, masses, friction and gravity.

    Contact pairs are listed, with the geometric mean of both frictions. MuJoCo has no coefficient
    of restitution and no contact stiffness in N/m: all contacts have those of `options`.

    Args:
        scene: bodies, at most one joint of each to the world, drives, statics and gravity.
        options: step, solver and contact parameters.
        grip: fingers of grippers press with their grip limit, each on a slide joint. Otherwise they
            are, as all drives, mocap bodies: they follow their path whatever they meet, and cost
            MuJoCo the least.
    """
    root = Element("mujoco")
    option = SubElement(root, "option", integrator=options.integrator, cone=options.cone)
    option.attrib.update(
        timestep=_text(options.timestep), gravity=_text(*scene.gravity), solver=options.solver,
        iterations=str(options.iterations), impratio=_text(options.impratio),
        noslip_iterations=str(options.noslip),
    )  # fmt: skip
    world, contact = SubElement(root, "worldbody"), SubElement(root, "contact")
    actuators = SubElement(root, "actuator")
    pressing = {}
    if grip:
        for first, gripper in scene.grippers:
            pressing[first], pressing[first + 1] = gripper.grip_limit, -gripper.grip_limit
    solids = [*scene.bodies, *scene.driven_bodies, *scene.statics]
    for i, solid in enumerate(solids):
        name = f"solid{i}"
        if isinstance(solid, Ground):
            plane = SubElement(world, "geom", name=name, type="plane", size="0 0 1")
            plane.attrib.update(pos=_text(0, 0, solid.height), contype="0", conaffinity="0")
            continue
        x, y, z, w = solid.orientation
        body = SubElement(world, "body", pos=_text(*solid.position), quat=_text(w, x, y, z))
        mass = solid.mass if isinstance(solid, Body) else None
        finger = i - len(scene.bodies)
        if isinstance(solid, Body):
            _joint(body, scene, i)
        elif finger in pressing:
            assert isinstance(solid, Drive)
            mass = solid.mass
            SubElement(body, "joint", name=name, type="slide", axis="0 1 0")
            body.set("gravcomp", "1")
            motor = SubElement(actuators, "general", joint=name, biastype="affine")
            motor.set("gainprm", "0")
            motor.set("biasprm", _text(pressing[finger], 0, 0))
        elif isinstance(solid, Drive):
            body.set("mocap", "true")
        _geom(body, name, solid.shape, mass)
    for i, a in enumerate(scene.bodies):
        for j in range(i + 1, len(solids)):
            b = solids[j]
            friction = math.sqrt(a.material.friction * b.material.friction)
            pair = SubElement(contact, "pair", geom1=f"solid{i}", geom2=f"solid{j}")
            # sliding twice, then torsion and rolling, which contacts with condim=3 ignore
            pair.set("friction", _text(friction, friction, 0.005, 0.0001, 0.0001))
            pair.set("condim", "3" if friction > 0.0 else "1")
            pair.set("solref", _text(*options.solref))
            pair.set("solimp", _text(*options.solimp))
    return mujoco.MjModel.from_xml_string(tostring(root, encoding="unicode"))
