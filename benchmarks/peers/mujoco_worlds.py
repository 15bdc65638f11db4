"""Worlds of a scene in MuJoCo, with the interface of a physics.World."""

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout

from benchmarks.peers.mujoco_options import MujocoOptions
from benchmarks.peers.mujoco_scene import model_of
from benchmarks.report.provenance import THREADS
from physics import Scene
from physics.rotation import rotate, rotate_back

Array = np.ndarray


class MujocoWorlds:
    """`count` worlds of a scene; each is advanced by itself, in one call.

    Args:
        scene: what is in each world, see `model_of`.
        options: step, solver and contact parameters.
        count: number of worlds.
        grip: see `model_of`.
    """

    def __init__(
        self, scene: Scene, options: MujocoOptions, count: int = 1, *, grip: bool = False
    ) -> None:
        """Sets the bodies to the initial state of the scene."""
        self.count, self._bodies = count, len(scene.bodies)
        self._model = model_of(scene, options, grip=grip)
        self._data = [mujoco.MjData(self._model) for _ in range(count)]
        masses = [float(b.mass or 0.0) for b in scene.bodies]
        self._mass = np.array(masses)
        self._inertia = np.array(
            [b.shape.inertia(m) for b, m in zip(scene.bodies, masses, strict=True)]
        )
        self._gravity = np.array(scene.gravity)
        # a free joint has seven coordinates and six speeds; the angular ones in the body's frame
        self._free = self._model.nq >= 7 * self._bodies and not scene.joints
        if self._free:
            self.set_state(
                linear_velocity=[b.linear_velocity for b in scene.bodies],
                angular_velocity=[b.angular_velocity for b in scene.bodies],
            )
        else:
            for i, body in enumerate(scene.bodies):
                spin = np.array(body.angular_velocity)
                self._turn(1 + i, rotate_back(np.array(body.orientation), spin))

    def _turn(self, body: int, spin: Array) -> None:
        """Sets the joint of a body of the model turning at `spin` rad/s, in the body frame.

        Raises:
            ValueError: a joint that doesn't turn.
        """
        joint, address = self._model.body_jntadr[body], self._model.body_dofadr[body]
        kind = self._model.jnt_type[joint]
        if kind == mujoco.mjtJoint.mjJNT_BALL:
            speed = spin
        elif kind == mujoco.mjtJoint.mjJNT_HINGE:
            speed = np.atleast_1d(spin @ self._model.jnt_axis[joint])
        else:
            raise ValueError("only balls and hinges can start turning")
        for data in self._data:
            data.qvel[address : address + len(speed)] = speed

    def move_drives(self, target: Any, time: float) -> None:
        """Does nothing: fingers press from the beginning, other drives rest where they are."""

    def advance(self, time: float) -> None:
        """Advances by `time` s, rounded to whole steps."""
        steps = round(time / self._model.opt.timestep)
        for data in self._data:
            mujoco.mj_step(self._model, data, nstep=steps)

    def apply_wrench(self, force: Any) -> None:
        """Pulls at the centres by forces that broadcast to [count, bodies, 3] N from now on."""
        forces = np.broadcast_to(force, (self.count, self._bodies, 3))
        for data, own in zip(self._data, forces, strict=True):
            data.xfrc_applied[1 : 1 + self._bodies, :3] = own

    def snapshot(self) -> Array:
        """The states of all worlds."""
        spec = mujoco.mjtState.mjSTATE_INTEGRATION
        saved = np.empty((self.count, mujoco.mj_stateSize(self._model, spec)))
        for row, data in zip(saved, self._data, strict=True):
            mujoco.mj_getState(self._model, data, row, spec)
        return saved

    def restore(self, saved: Array) -> None:
        """Returns all worlds to a snapshot."""
        for row, data in zip(saved, self._data, strict=True):
            mujoco.mj_setState(self._model, data, row, mujoco.mjtState.mjSTATE_INTEGRATION)

    def rollout(self, time: float) -> Callable[[], None]:
        """A function that advances all worlds from their present state by `time` s, on threads.

        It uses mujoco.rollout and leaves the worlds as they are.
        """
        steps = round(time / self._model.opt.timestep)
        spec = mujoco.mjtState.mjSTATE_FULLPHYSICS
        size = mujoco.mj_stateSize(self._model, spec)
        start = np.empty((self.count, size))
        for row, data in zip(start, self._data, strict=True):
            mujoco.mj_getState(self._model, data, row, spec)
        states = np.empty((self.count, steps, size))
        workers = [mujoco.MjData(self._model) for _ in range(THREADS)]
        pool = rollout.Rollout(nthread=THREADS)

        def roll() -> None:
            pool.rollout(self._model, workers, start, state=states, nstep=steps)

        return roll

    def set_state(
        self,
        *,
        position: Any = None,
        orientation: Any = None,
        linear_velocity: Any = None,
        angular_velocity: Any = None,
    ) -> None:
        """Writes states of free bodies, of shapes that broadcast to [count, bodies, 3 or 4].

        Raises:
            ValueError: bodies with joints.
        """
        if not self._free:
            raise ValueError("set_state: bodies with joints have other coordinates")
        places = np.stack([data.qpos[: 7 * self._bodies] for data in self._data])
        speeds = np.stack([data.qvel[: 6 * self._bodies] for data in self._data])
        place = places.reshape(self.count, self._bodies, 7)
        speed = speeds.reshape(self.count, self._bodies, 6)
        if position is not None:
            place[..., :3] = position
        if orientation is not None:
            place[..., 3:] = np.roll(np.asarray(orientation), 1, axis=-1)
        if linear_velocity is not None:
            speed[..., :3] = linear_velocity
        if angular_velocity is not None:
            turn = np.roll(place[..., 3:], -1, axis=-1)
            spin = np.broadcast_to(np.asarray(angular_velocity, dtype=float), speed[..., 3:].shape)
            speed[..., 3:] = rotate_back(turn, spin)
        for w, data in enumerate(self._data):
            data.qpos[: 7 * self._bodies] = places[w]
            data.qvel[: 6 * self._bodies] = speeds[w]

    def _read(self, values: Callable[[mujoco.MjData], Array]) -> Array:
        """Values of the bodies, [count, bodies, ...]; the world is MuJoCo's body 0."""
        for data in self._data:
            mujoco.mj_kinematics(self._model, data)
        return np.stack([values(data)[1 : 1 + self._bodies] for data in self._data])

    @property
    def time(self) -> Array:
        """[count] s."""
        return np.array([data.time for data in self._data])

    @property
    def position(self) -> Array:
        """[count, bodies, 3] m."""
        return self._read(lambda data: data.xpos)

    @property
    def orientation(self) -> Array:
        """[count, bodies, 4] unit quaternions x y z w."""
        return np.roll(self._read(lambda data: data.xquat), -1, axis=-1)

    def _velocity(self) -> Array:
        """[count, bodies, 6]: angular in rad/s, then linear in m/s, world frame."""
        found = np.empty((self.count, self._bodies, 6))
        for w, data in enumerate(self._data):
            mujoco.mj_kinematics(self._model, data)
            mujoco.mj_comPos(self._model, data)
            mujoco.mj_comVel(self._model, data)
            for i in range(self._bodies):
                kind = mujoco.mjtObj.mjOBJ_BODY
                mujoco.mj_objectVelocity(self._model, data, kind, 1 + i, found[w, i], 0)
        return found

    @property
    def linear_velocity(self) -> Array:
        """[count, bodies, 3] m/s."""
        return self._velocity()[..., 3:]

    @property
    def angular_velocity(self) -> Array:
        """[count, bodies, 3] rad/s, world frame."""
        return self._velocity()[..., :3]

    def kinetic_energy(self) -> Array:
        """[count] J."""
        both = self._velocity()
        spin = rotate_back(self.orientation, both[..., :3])
        terms = self._mass * np.sum(both[..., 3:] ** 2, axis=-1)
        terms = terms + np.sum(self._inertia * spin**2, axis=-1)
        return 0.5 * terms.sum(axis=1)

    def potential_energy(self) -> Array:
        """[count] J, zero at the origin."""
        return -np.sum(self._mass * np.sum(self.position * self._gravity, axis=-1), axis=1)

    def angular_momentum(self) -> Array:
        """[count, 3] kg m^2/s about the origin."""
        both, turn = self._velocity(), self.orientation
        spin = rotate(turn, self._inertia * rotate_back(turn, both[..., :3]))
        orbital = np.cross(self.position, self._mass[:, None] * both[..., 3:])
        return (spin + orbital).sum(axis=1)

    def penetration(self) -> Array:
        """[count] m, deepest overlap now."""
        found = np.zeros(self.count)
        for w, data in enumerate(self._data):
            mujoco.mj_fwdPosition(self._model, data)
            if data.ncon:
                found[w] = max(0.0, -float(np.min(data.contact.dist)))
        return found
