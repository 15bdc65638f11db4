"""One of our scenes as a MuJoCo model, with MuJoCo's default options."""

import math
from typing import Any
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np

try:
    import mujoco
except ModuleNotFoundError:
    raise SystemExit("MuJoCo is missing: pip install -e '.[bench]', or make bench") from None

from physics import Body, Box, Capsule, Drive, Ground, Scene, Sphere, Static
from physics.rotation import rotate, rotate_back
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


def model_of(
    scene: Scene, timestep: float, integrator: str = "Euler", cone: str = "elliptic"
) -> mujoco.MjModel:
    """A model of the same solids, masses, friction and gravity.

    Bodies have free joints. A drive is a mocap body: it follows its path whatever it meets, and
    costs MuJoCo the least. Contact pairs are listed, with the geometric mean of both frictions.
    MuJoCo has no coefficient of restitution and no contact stiffness in N/m: its own contact
    parameters keep their defaults.

    Args:
        scene: solids and gravity.
        timestep: s.
        integrator: name of a MuJoCo integrator.
        cone: "elliptic", which is exact, or "pyramidal".
    """
    root = Element("mujoco")
    option = SubElement(root, "option", integrator=integrator, cone=cone)
    option.attrib.update(timestep=_text(timestep), gravity=_text(*scene.gravity))
    world, contact = SubElement(root, "worldbody"), SubElement(root, "contact")
    solids = [*scene.bodies, *scene.driven_bodies, *scene.statics]
    for i, solid in enumerate(solids):
        name = f"solid{i}"
        if isinstance(solid, Ground):
            plane = SubElement(world, "geom", name=name, type="plane", size="0 0 1")
            plane.attrib.update(pos=_text(0, 0, solid.height), contype="0", conaffinity="0")
            continue
        x, y, z, w = solid.orientation
        body = SubElement(world, "body", pos=_text(*solid.position), quat=_text(w, x, y, z))
        if isinstance(solid, Body):
            SubElement(body, "freejoint")
        elif isinstance(solid, Drive):
            body.set("mocap", "true")
        _geom(body, name, solid.shape, solid.mass if isinstance(solid, Body) else None)
    for i, a in enumerate(scene.bodies):
        for j in range(i + 1, len(solids)):
            b: Body | Drive | Static | Ground = solids[j]
            friction = math.sqrt(a.material.friction * b.material.friction)
            pair = SubElement(contact, "pair", geom1=f"solid{i}", geom2=f"solid{j}")
            # sliding twice, then torsion and rolling, which contacts with condim=3 ignore
            pair.set("friction", _text(friction, friction, 0.005, 0.0001, 0.0001))
            pair.set("condim", "3" if friction > 0.0 else "1")
    return mujoco.MjModel.from_xml_string(tostring(root, encoding="unicode"))


class MujocoWorld:
    """One world of a scene without drives in MuJoCo, with the interface of a physics.World."""

    def __init__(
        self, scene: Scene, timestep: float, integrator: str = "Euler", cone: str = "elliptic"
    ) -> None:
        """Sets the bodies to the initial state of the scene."""
        self._model = model_of(scene, timestep, integrator, cone)
        self._data = mujoco.MjData(self._model)
        # a free joint has seven coordinates and six speeds; the angular ones in the body's frame
        self._place = self._data.qpos.reshape(1, -1, 7)
        self._motion = self._data.qvel.reshape(1, -1, 6)
        masses = [float(b.mass or 0.0) for b in scene.bodies]
        self._mass = np.array(masses)[:, None]
        self._inertia = np.array(
            [b.shape.inertia(m) for b, m in zip(scene.bodies, masses, strict=True)]
        )
        self.set_state(linear_velocity=[b.linear_velocity for b in scene.bodies])
        spin = np.array([b.angular_velocity for b in scene.bodies])
        self._motion[..., 3:] = rotate_back(self.orientation, spin)

    def advance(self, time: float) -> None:
        """Advances by `time` s, rounded to whole steps."""
        mujoco.mj_step(self._model, self._data, nstep=round(time / self._model.opt.timestep))

    def set_state(self, *, linear_velocity: Any) -> None:
        """Writes velocities in m/s, of a shape that broadcasts to [1, bodies, 3]."""
        self._motion[..., :3] = linear_velocity

    @property
    def position(self) -> Array:
        """[1, bodies, 3] m."""
        return self._place[..., :3]

    @property
    def orientation(self) -> Array:
        """[1, bodies, 4] unit quaternions x y z w."""
        return np.roll(self._place[..., 3:], -1, axis=-1)

    @property
    def linear_velocity(self) -> Array:
        """[1, bodies, 3] m/s."""
        return self._motion[..., :3]

    def kinetic_energy(self) -> Array:
        """[1] J."""
        terms = self._mass * self._motion[..., :3] ** 2 + self._inertia * self._motion[..., 3:] ** 2
        return 0.5 * terms.sum(axis=(1, 2))

    def angular_momentum(self) -> Array:
        """[1, 3] kg m^2/s about the origin."""
        spin = rotate(self.orientation, self._inertia * self._motion[..., 3:])
        orbital = np.cross(self.position, self._mass * self.linear_velocity)
        return (spin + orbital).sum(axis=1)
