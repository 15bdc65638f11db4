"""World: a scene, a fidelity and a count, ready to advance, read, write, save and restore."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from physics.analysis import diagnostics, energies, stability
from physics.analysis.diagnostics import Contacts
from physics.analysis.parameter_limits import ParameterLimits
from physics.analysis.solids import Solids
from physics.analysis.step_limits import cause_of_divergence, check_step
from physics.errors import ContactOverflow, SimulationDiverged
from physics.model.features import Features
from physics.model.state import State
from physics.model.state import copy as copy_state
from physics.motion.drive_commands import by_worlds, make_command, make_lead
from physics.scene.fidelity import Fidelity, resolve
from physics.scene.parameters import Parameters, check_ranges, check_values, with_parameters
from physics.scene.scene import Scene
from physics.scene.validation import array, instance, integer, positive
from physics.step.readout import Readout
from physics.step.simulation import Simulation, read_only
from physics.step.threads import check_threads
from physics.step.write_state import write_state

Array = np.ndarray


class Snapshot(NamedTuple):
    """Everything that worlds hold, hidden contact state included, and what they are worlds of."""

    scene: Scene
    fidelity: Fidelity
    state: State
    parameters: Parameters | None = None  # of varied worlds


class World:
    """`count` copies of a scene, advanced together.

    Args:
        scene: what is in each world.
        fidelity: a preset's name or a Fidelity.
        count: number of worlds, at least 1.
        threads: to share the worlds out over; all cores if None. Results don't depend on it.
        allow_unstable: accept what makes the fidelity's step too long, see Raises.
        varied: worlds may have masses, friction, restitution and sizes of their own, see
            `set_parameters`. Worlds that are all alike go without, and are quicker.

    Raises:
        TypeError, ValueError: a bad argument; a step that is too long for the scene, see
            `physics.analysis.step_limits.check_step`.
    """

    def __init__(
        self,
        scene: Scene,
        fidelity: str | Fidelity = "balanced",
        count: int = 1,
        threads: int | None = None,
        *,
        allow_unstable: bool = False,
        varied: bool = False,
    ) -> None:
        """Builds the model and puts every world into the scene's state."""
        self.scene: Scene = instance("scene", scene, Scene)
        self.fidelity = resolve(fidelity)
        self.count = integer("count", count, low=1)
        self.threads = check_threads(threads)
        varied = instance("varied", varied, bool)
        self._allow_unstable: bool = instance("allow_unstable", allow_unstable, bool)
        self._simulation = Simulation(scene, self.fidelity, self.count, self.threads, varied)
        if not allow_unstable:
            check_step(scene, self.fidelity, self._simulation.base, self.features)
        self._limits = ParameterLimits(scene, self.fidelity)
        self._solids = Solids(self._simulation.base)
        self._span = 0.0

    def __repr__(self) -> str:
        """Names what the world is made of."""
        return (
            f"World({len(self.scene.bodies)} bodies, {len(self.scene.drives)} drives, "
            f"{len(self.scene.statics)} statics, fidelity={self.fidelity}, count={self.count})"
        )

    # --- time ---------------------------------------------------------------------------------

    def advance(self, time: float, worlds: Any = None) -> None:
        """Advances worlds by `time` s, in whole substeps no longer than the fidelity's.

        Args:
            time: s.
            worlds: mask [count] of the worlds to advance, the others stay as they are; all if None.

        Raises:
            TypeError, ValueError: `time` isn't a positive finite number; a bad mask.
            SimulationDiverged: a world turned non-finite; the others have advanced and are whole.
            ContactOverflow: more particle pairs touch than there is room for.
        """
        if type(time) is not float or time != self._span:  # frames are all of one length
            self._span = positive("time", time)
        if not self._simulation.advance(self._span, self._mask(worlds)):
            self._raise_failure()

    def _raise_failure(self) -> None:
        """Raises the error of the worlds whose last steps failed."""
        simulation, scene = self._simulation, self.scene
        diverged = simulation.failed("diverged")
        if not diverged:
            full = simulation.failed("overflow")
            raise ContactOverflow(
                f"worlds {full}: two bodies have more than eight touching particle pairs a "
                "particle; they overlap deeply, or Fidelity.skin is too wide"
            )
        world = diverged[0]
        if self.features.varied:
            scene = with_parameters(scene, simulation.parameters.pick([world]))
        status, model = simulation.state.world[world], simulation.model.of_world(world)
        cause = cause_of_divergence(
            scene, self.fidelity, model, self.features, simulation.last_substep
        )
        raise SimulationDiverged(
            world, int(status["diverged"]) - 1, float(status["time"]), cause, diverged
        )

    def _settle(self) -> None:
        """Brings candidates and forces up to a state that was set from outside."""
        if not self._simulation.settle():
            self._raise_failure()

    # --- writing ------------------------------------------------------------------------------

    def _mask(self, worlds: Any) -> Array:
        if worlds is None:
            return self._simulation.everyone
        mask = np.ascontiguousarray(worlds)
        if mask.dtype != bool or mask.shape != (self.count,):
            raise ValueError(
                f"worlds must be a mask of bools of shape ({self.count},), got {mask.dtype} of "
                f"shape {mask.shape}"
            )
        return mask

    def reset(self, worlds: Any = None) -> None:
        """Puts worlds back into the scene's state at time zero; all of them, or a mask [count]."""
        self._simulation.reset(self._mask(worlds))

    def set_state(
        self,
        *,
        position: Any = None,
        orientation: Any = None,
        linear_velocity: Any = None,
        angular_velocity: Any = None,
        drive_position: Any = None,
        drive_velocity: Any = None,
        time: Any = None,
        worlds: Any = None,
    ) -> None:
        """Writes any part of the state of the chosen worlds, and clears what is hidden in them.

        Args:
            position: m; [chosen, bodies, 3] or what broadcasts to it, as the others.
            orientation: [chosen, bodies, 4] quaternions x y z w; they are normalised.
            linear_velocity: m/s, [chosen, bodies, 3].
            angular_velocity: rad/s, world frame, [chosen, bodies, 3].
            drive_position: m, [chosen, tools, 3].
            drive_velocity: m/s, [chosen, tools, 3].
            time: [chosen] s.
            worlds: mask [count] of the chosen worlds; all if None.

        Raises:
            ValueError: a wrong shape, a value that isn't finite, a quaternion of length zero,
                fingers of a gripper apart in x or z. The state is then as it was.
        """
        given = {
            "position": position,
            "orientation": orientation,
            "linear_velocity": linear_velocity,
            "angular_velocity": angular_velocity,
            "drive_position": drive_position,
            "drive_velocity": drive_velocity,
            "time": time,
        }
        write_state(self._simulation, given, self._mask(worlds))

    def command_drives(self, velocity: Any) -> None:
        """Lets every tool's reference move from where the tool is now, at a velocity.

        Args:
            velocity: [count, tools, 3] m/s, or what broadcasts to it; it holds until changed.
        """
        shape = (self.count, len(self.scene.tools), 3)
        checked = array("velocity", velocity, shape)
        simulation = self._simulation
        make_command()(simulation.state.mover, simulation.bodies, by_worlds(checked))
        simulation.changed()

    def move_drives(self, target: Any, time: float) -> None:
        """Lets every tool's reference move from where the reference is now to a target.

        A tool that holds a load hangs behind its reference. From the reference on, it stays so.

        Args:
            target: [count, tools, 3] m, or what broadcasts to it.
            time: s in which it is reached, and after which a new command is due.
        """
        shape = (self.count, len(self.scene.tools), 3)
        checked = array("target", target, shape)
        time = positive("time", time)
        simulation = self._simulation
        make_lead()(simulation.state.mover, simulation.bodies, by_worlds(checked), time)
        simulation.changed(poses=False)

    # --- parameters ---------------------------------------------------------------------------

    @property
    def parameters(self) -> Parameters:
        """A copy of the bodies' parameters, [count, bodies] each."""
        shape = (self.count, len(self.scene.bodies))
        own = self._simulation.parameters
        return Parameters(*(np.broadcast_to(values, shape).copy() for values in own))

    def check_parameters(self, ranges: Mapping[str, Any]) -> None:
        """Refuses ranges that hold parameters which the step is too long for.

        The ends of the ranges are looked at: all bodies at one, and each in turn at the other.
        What `set_parameters` writes within ranges that were checked needs no check of its own.

        Args:
            ranges: low and high of "mass", "friction", "restitution" or "size": numbers, or
                [bodies] each. What isn't named is as in the scene.

        Raises:
            TypeError, ValueError: no such parameter, or no such range; a range that is unstable or
                lets a body sink, with what binds and the largest safe step.
        """
        low, high = check_ranges(ranges, Parameters.of(self.scene))
        self._limits.check_range(low, high, self._allow_unstable)

    def set_parameters(
        self,
        *,
        mass: Any = None,
        friction: Any = None,
        restitution: Any = None,
        size: Any = None,
        worlds: Any = None,
    ) -> None:
        """Gives the chosen worlds parameters of their own, and clears what is hidden in them.

        Positions and velocities stay; `reset` and `set_state` then start from the new parameters
        to the last bit. `reset` keeps parameters, `snapshot` holds them.

        Args:
            mass: kg, [chosen, bodies] or what broadcasts to it, as the others.
            friction: of the bodies' material.
            restitution: of the bodies' material, 0 to 1.
            size: factor of every length of a body's shape, 1 as in the scene. A body keeps the
                samples that it has there, so sizes can't be worlds apart.
            worlds: mask [count] of the chosen worlds; all if None.

        Raises:
            ValueError: the World isn't `varied`; a wrong shape, a value out of its limits, or one
                that the step is too long for. The parameters are then as they were.
        """
        if not self.features.varied:
            raise ValueError(
                "set_parameters needs worlds that may differ: build the World with varied=True"
            )
        mask = self._mask(worlds)
        chosen = np.flatnonzero(mask)
        given = {"mass": mass, "friction": friction, "restitution": restitution, "size": size}
        values = check_values(given, chosen, len(self.scene.bodies))
        if not values or not len(chosen):
            return
        new = self._simulation.parameters.pick(mask)._replace(**values)
        if not self._allow_unstable:
            self._limits.check(new, chosen)
        self._simulation.vary_bodies(mask, new)

    # --- saving -------------------------------------------------------------------------------

    def snapshot(self) -> Snapshot:
        """Everything the worlds hold; `restore` continues from it to the last bit."""
        own = self.parameters if self.features.varied else None
        return Snapshot(self.scene, self.fidelity, copy_state(self._simulation.state), own)

    def restore(self, saved: Snapshot) -> None:
        """Takes all worlds back to a snapshot of a world of the same scene, fidelity and count."""
        instance("saved", saved, Snapshot)
        count = len(saved.state.world)
        if count != self.count:
            what = f"count: {count} instead of {self.count}"
        elif saved.fidelity != self.fidelity:
            ours = vars(self.fidelity)
            fields = [f"{k}={v!r}" for k, v in vars(saved.fidelity).items() if v != ours[k]]
            what = f"fidelity: {', '.join(fields)}"
        elif saved.scene != self.scene:
            what = "scene"
        elif (saved.parameters is not None) != self.features.varied:
            what = f"varied: {saved.parameters is not None}"
        else:
            what = ""
        if what:
            raise ValueError(f"saved must be of the same worlds; it has another {what}")
        simulation = self._simulation
        if saved.parameters is not None:
            pairs = zip(simulation.parameters, saved.parameters, strict=True)
            other = np.any([np.any(mine != theirs, axis=1) for mine, theirs in pairs], axis=0)
            simulation.write_parameters(other, saved.parameters.pick(other))
        for mine, theirs in zip(simulation.state, saved.state, strict=True):
            mine[...] = theirs
        simulation.changed()

    # --- reading ------------------------------------------------------------------------------

    @property
    def features(self) -> Features:
        """What was compiled in for this scene."""
        return self._simulation.features

    @property
    def time(self) -> Array:
        """[count] s, read-only."""
        return read_only(self._simulation.state.world["time"])

    @property
    def position(self) -> Array:
        """[count, bodies, 3] m, centres of mass: a read-only view that follows the state."""
        return read_only(self._simulation.state.mover["position"][:, : self._simulation.bodies])

    @property
    def orientation(self) -> Array:
        """[count, bodies, 4] unit quaternions x y z w: a read-only view that follows the state."""
        return read_only(self._simulation.state.mover["orientation"][:, : self._simulation.bodies])

    @property
    def linear_velocity(self) -> Array:
        """[count, bodies, 3] m/s, world frame."""
        momentum = self._simulation.state.mover["momentum"][:, : self._simulation.bodies]
        return read_only(momentum * self._simulation.of_bodies("inverse_mass")[..., None])

    @property
    def angular_velocity(self) -> Array:
        """[count, bodies, 3] rad/s, world frame."""
        return read_only(self._simulation.angular_velocity())

    @property
    def drive_position(self) -> Array:
        """[count, tools, 3] m: a read-only view that follows the state."""
        return read_only(self._simulation.state.mover["position"][:, self._simulation.bodies :])

    @property
    def drive_velocity(self) -> Array:
        """[count, tools, 3] m/s, world frame."""
        bodies = self._simulation.bodies
        inverse = self._simulation.base.mover["inverse_mass"][bodies:]
        momentum = self._simulation.state.mover["momentum"][:, bodies:]
        return read_only(momentum * inverse[:, None])

    @property
    def drive_reference(self) -> Array:
        """[count, tools, 3] m, where the servos pull to: a read-only view of the state."""
        return read_only(self._simulation.state.mover["reference"][:, self._simulation.bodies :])

    def read(self) -> Readout:
        """All poses and velocities as they are now, drives after the bodies: read-only."""
        return self._simulation.readout()

    def kinetic_energy(self) -> Array:
        """[count] J of the bodies, translation and rotation."""
        return energies.kinetic_energy(self._simulation)

    def potential_energy(self) -> Array:
        """[count] J of the bodies in the field of gravity, zero at the origin."""
        return energies.potential_energy(self._simulation)

    def linear_momentum(self) -> Array:
        """[count, 3] kg m/s of the bodies."""
        return energies.linear_momentum(self._simulation)

    def angular_momentum(self) -> Array:
        """[count, 3] kg m^2/s of the bodies about the origin."""
        return energies.angular_momentum(self._simulation)

    def penetration(self) -> Array:
        """[count] m, deepest overlap now; 0 where nothing touches."""
        self._settle()
        simulation = self._simulation
        return diagnostics.penetration(simulation.model, self.features, simulation.state)

    def contacts(self, world: int = 0) -> Contacts:
        """Who touches what in one world, where and how hard."""
        self._settle()
        simulation, index = self._simulation, self._world_index(world)
        return diagnostics.contacts(simulation.model, self.features, simulation.state, index)

    def samples(self, solid: int) -> tuple[Array, float | Array]:
        """Points with which a solid touches others: [n, 3] m in its frame, and their radius in m.

        Of a Compound whose samples differ in it, their radii [n]. A solid that others only touch
        with theirs, as the ground, has none.

        Args:
            solid: its index, as in `first_touch`.
        """
        return diagnostics.samples(self._simulation.base, self._solids.index("solid", solid))

    def first_touch(self, first: int, second: int) -> Array:
        """[count] s, when two solids first touched since their state was set; NaN before.

        Args:
            first: index of a solid: bodies, then tools, then statics, each in scene order.
            second: another.
        """
        sides = self._solids.pair(first, second)[2]
        self._settle()
        return diagnostics.first_touch(self._simulation.state, sides)

    def first_touch_position(self, first: int, second: int) -> Array:
        """[count, 3] m, where the centre of one of two solids was at their first touch; NaN before.

        Args:
            first: index of the solid whose position is told, as in `first_touch`.
            second: another, that comes after it.
        """
        one, other, sides = self._solids.pair(first, second)
        if one > other:
            raise ValueError(
                f"first must come before second, whose position isn't kept: got {one} and {other}"
            )
        self._settle()
        return diagnostics.first_touch_position(self._simulation.state, sides)

    def pressing(self, first: int, second: int) -> Array:
        """[count] N, the sum of the normal forces between two solids, as in `first_touch`."""
        sides = self._solids.pair(first, second)[2]
        self._settle()
        return diagnostics.pressing(self._simulation.state, sides)

    def largest_stable_step(self, world: int = 0) -> float:
        """Largest stable step in s with the contacts that a world has now; inf without any."""
        self._settle()
        simulation, index = self._simulation, self._world_index(world)
        return stability.of_contacts(simulation.model, self.features, simulation.state, index)

    @property
    def nbytes(self) -> int:
        """Bytes of state a world, beyond the shared model; of varied worlds with their own."""
        own = self._simulation.model.nbytes if self.features.varied else 0
        return (self._simulation.state.nbytes + own) // self.count

    def _world_index(self, world: int) -> int:
        index = integer("world", world, low=0)
        if index >= self.count:
            raise ValueError(f"world must be below {self.count}, got {world!r}")
        return index
