"""World: a scene, a fidelity and a count, ready to advance, write, save and restore."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from physics import snapshot
from physics.analysis.failures import failure
from physics.analysis.integrator_limits import check_integrator
from physics.analysis.lane_queries import LaneQueries
from physics.analysis.odd_scenes import warn_of_odd_scenes
from physics.analysis.parameter_limits import ParameterLimits
from physics.analysis.soft_supports import warn_of_soft_supports
from physics.analysis.solids import Solids
from physics.analysis.solver_limits import check_solver
from physics.analysis.step_limits import check_step
from physics.analysis.work_limits import check_work
from physics.engines import choose_engine
from physics.granular.queries import GranularQueries
from physics.granular.simulation import GranularSimulation
from physics.manybody.limits import check_crowd, check_impacts
from physics.manybody.queries import CrowdQueries
from physics.manybody.simulation import CrowdSimulation
from physics.motion.drive_commands import make_move_command, make_velocity_command, worlds_last
from physics.readings import Readings
from physics.scene.fidelity import Fidelity, resolve
from physics.scene.parameters import Parameters, check_ranges, check_values
from physics.scene.scene import Scene
from physics.scene.validation import ZERO, array, instance, integer, number, positive
from physics.snapshot import Snapshot
from physics.step.kernel_choice import requested
from physics.step.simulation import Simulation
from physics.step.threads import check_threads
from physics.step.write_forces import write_motors, write_wrench
from physics.step.write_state import write_state

Array = np.ndarray


class World(Readings):
    """`count` copies of a scene, advanced together.

    Args:
        scene: what is in each world.
        fidelity: a preset's name or a Fidelity.
        count: number of worlds, at least 1.
        threads: number of threads; all cores if None. Results don't depend on it.
        allow_unstable: accept a scene for which the fidelity's substep is too long.
        per_world_parameters: masses, friction, restitution and sizes may differ between worlds, see
            `set_parameters`. Identical worlds are faster.
        measure_work: sum up the work of the drives' servos, see `drive_work`. For worlds side by
            side with equal steps.
        kernel: "special": compiled for what this scene needs, which takes seconds. "general": one
            for nearly all scenes of the same law; the same bits, at 0.83 to 0.89 of the speed.
            Scenes with torsional resistance, tori, particles or work of servos, and joints together
            with contacts, have special kernels only. "auto": what has been compiled before, special
            before general; if neither has, general below 256 worlds. None: what the environment
            variable RIGID_ENVS_KERNEL says, else "auto". `World.kernel` tells what was chosen.
        engine: "worlds", "bodies" or "particles", see `physics.engines`; "auto": what suits the
            scene. `World.engine` tells what was chosen.

    Attributes:
        engine: see above.

    Raises:
        TypeError: an argument of the wrong type.
        ValueError: an argument out of range; a substep that is too long for the scene, see
            `physics.analysis.step_limits.check_step`; an integrator that can't advance it, see
            `physics.analysis.integrator_limits.check_integrator`; a solver that can't solve it, see
            `physics.analysis.solver_limits.check_solver`; `measure_work` where it is not supported.
    """

    def __init__(
        self,
        scene: Scene,
        fidelity: str | Fidelity = "balanced",
        count: int = 1,
        threads: int | None = None,
        *,
        allow_unstable: bool = False,
        per_world_parameters: bool = False,
        measure_work: bool = False,
        kernel: str | None = None,
        engine: str = "auto",
    ) -> None:
        """Builds the model and puts every world into the scene's state."""
        self.scene: Scene = instance("scene", scene, Scene)
        self.fidelity = resolve(fidelity)
        self.count = integer("count", count, low=1)
        self.threads = check_threads(threads)
        per_world_parameters = instance("per_world_parameters", per_world_parameters, bool)
        measure_work = instance("measure_work", measure_work, bool)
        self._allow_unstable: bool = instance("allow_unstable", allow_unstable, bool)
        kernel = requested(kernel)
        arguments = scene, self.fidelity, self.count, self.threads, per_world_parameters
        self.engine = choose_engine(scene, self.fidelity, engine, per_world_parameters)
        check_solver(scene, self.fidelity, self.engine)
        if measure_work:
            check_work(scene, self.fidelity, self.engine)
        if self.engine == "particles":
            heap = GranularSimulation(*arguments[:-1])
            self._simulation, self._queries = heap, GranularQueries(heap)
            if not allow_unstable:
                check_crowd(scene, self.fidelity, heap.classes())
        elif self.engine == "bodies":
            many = CrowdSimulation(*arguments, kernel=kernel)
            self._simulation, self._queries = many, CrowdQueries(many)
            check_integrator(scene, self.fidelity, many.base)
            if not allow_unstable:
                check_crowd(scene, self.fidelity, many.kinds.of_solid, many.mechanisms.checked)
                check_impacts(scene, self.fidelity, many.kinds)
        else:
            self._simulation = Simulation(*arguments, measure_work, kernel)
            self._queries = LaneQueries(self._simulation)
            check_integrator(scene, self.fidelity, self._simulation.base)
            if not allow_unstable:
                check_step(scene, self.fidelity, self._simulation.base, self.features)
                warn_of_soft_supports(scene, self.fidelity, self._simulation.base)
        if not allow_unstable:
            warn_of_odd_scenes(scene, self.fidelity)
        self._memory: dict[str, Array] = {}
        self._limits = ParameterLimits(scene, self.fidelity)
        self._solids = Solids(scene.solid_names, self._queries.can_touch)

    def __repr__(self) -> str:
        """Names the contents of the world."""
        return (
            f"World({len(self.scene.bodies)} bodies, {len(self.scene.drives)} drives, "
            f"{len(self.scene.statics)} statics, fidelity={self.fidelity}, count={self.count}, "
            f"engine={self.engine!r}, kernel={self.kernel!r})"
        )

    # --- time ---------------------------------------------------------------------------------

    def advance(self, time: float, worlds: Any = None) -> None:
        """Advances worlds by `time` s, in whole steps no longer than the fidelity's substep.

        Args:
            time: s.
            worlds: mask [count] of the worlds to advance; all if None.

        Raises:
            TypeError, ValueError: `time` isn't a positive finite number; a bad mask.
            SimulationDiverged: a world became non-finite now, or did before and was neither reset
                nor left out; the others have advanced. StepVanished, a kind of it: one needs
                shorter steps than the adaptive integrator takes.
            ContactOverflow: more pairs of particles are within the skin than there is room for. If
                another world diverged in the same call, this is a note of that error.
        """
        if not self._simulation.advance(positive("time", time), self._mask(worlds)):
            raise failure(self._simulation)

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
        """Resets worlds to the scene's state at time zero; all of them, or a mask [count].

        Their `memory` is zero again; parameters stay.
        """
        mask = self._mask(worlds)
        self._simulation.reset(mask)
        for numbers in self._memory.values():
            numbers[mask] = 0.0

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
        """Writes any part of the state of the chosen worlds, and clears their hidden contact state.

        Args:
            position: m; [chosen, bodies, 3] or what broadcasts to it, like all others.
            orientation: [chosen, bodies, 4] quaternions x y z w; they are normalised, w >= 0.
                Angular velocities stay as they are.
            linear_velocity: m/s, [chosen, bodies, 3].
            angular_velocity: rad/s, world frame, [chosen, bodies, 3].
            drive_position: m, [chosen, drives, 3]; the set points move there, too, and stop.
            drive_velocity: m/s, [chosen, drives, 3].
            time: [chosen] s.
            worlds: mask [count] of the chosen worlds; all if None.

        Raises:
            ValueError: a wrong shape, a value that isn't finite, a quaternion of length zero,
                fingers of a gripper that differ in x or z, an angular velocity in a scene whose
                rotation isn't simulated, or poses that a joint doesn't allow. The state is then
                unchanged.
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
        """Moves the set point of every drive at a velocity, starting at the drive's position.

        Args:
            velocity: [count, drives, 3] m/s, or what broadcasts to it; it holds until the next
                command. The two fingers of a gripper count as two drives.

        Raises:
            ValueError: a wrong shape, a value that isn't finite, or a scene without drives.
        """
        checked = array("velocity", velocity, self._drives_shape("command_drives"))
        simulation = self._simulation
        make_velocity_command()(simulation.state.dynamic, simulation.bodies, worlds_last(checked))
        simulation.changed()

    def move_drives(self, target: Any, time: float, *, renew_forces: bool = False) -> None:
        """Moves the set point of every drive from where it is to a target, and holds it there.

        A loaded drive lags behind its set point. Because the motion starts at the set point, the
        lag doesn't add up over several commands.

        Args:
            target: [count, drives, 3] m, or what broadcasts to it.
            time: s, duration of the motion. With 0 the set points are there at once, and the servos
                answer a step.
            renew_forces: compute forces again, so that servos follow the command from now on. Else
                the first half of the next substep is still under the forces of the last one, as
                integrators keep them.

        Raises:
            TypeError, ValueError: a wrong shape, a value that isn't finite, a negative time, or a
                scene without drives.
        """
        checked = array("target", target, self._drives_shape("move_drives"))
        time = number("time", time, low=0.0)
        simulation = self._simulation
        make_move_command()(simulation.state.dynamic, simulation.bodies, worlds_last(checked), time)
        if instance("renew_forces", renew_forces, bool):
            simulation.renew_forces()
        simulation.changed(poses=time == 0.0)

    def _drives_shape(self, method: str) -> tuple[int, int, int]:
        """Shape of a vector for every drive in every world; an error if there are no drives."""
        if not self.scene.drives:
            raise ValueError(f"World.{method} needs a Drive or Gripper in Scene.drives")
        return self.count, len(self.scene.driven_bodies), 3

    def apply_wrench(
        self,
        force: Any = ZERO,
        torque: Any = ZERO,
        body: int | str | None = None,
        point: Any = None,
    ) -> None:
        """Adds forces and torques that act on bodies during the next call of `advance`.

        Constant in the world frame and over that call; calls add up. The first use compiles
        a kernel with this feature.

        Args:
            force: N, world frame: [count, 3] for one body, or what broadcasts to it;
                [count, bodies, 3] if `body` is None.
            torque: N m, world frame, likewise.
            body: index or name of a body; None: all of them.
            point: m, world frame, where the force acts; the centre of mass if None. Of one body
                [count, 3], else [count, bodies, 3]. The torque about the centre is that of the
                present pose.

        Raises:
            TypeError, ValueError: no such body, a wrong shape, or a value that isn't finite; a
                torque or point in a scene whose rotation isn't simulated. Nothing is then added.
        """  # fmt: skip
        write_wrench(self._simulation, force, torque, body, point)

    def command_motors(self, velocity: Any) -> None:
        """Sets the velocities to which the motors of joints drive; they hold until changed.

        Args:
            velocity: [count, motors] rad/s of hinges, m/s of sliders, or what broadcasts to it; the
                motors are those of `Scene.joints`, in their order. Zero brakes.

        Raises:
            ValueError: a wrong shape, a value that isn't finite, or a scene without motors.
        """
        write_motors(self._simulation, "velocity", velocity)

    def move_motors(self, position: Any) -> None:
        """Makes servos of the motors of joints, with these set points; they hold until changed.

        Args:
            position: [count, motors] rad of hinges, m of sliders, or what broadcasts to it; a hinge
                turns the shorter way.

        Raises:
            ValueError: a wrong shape, a value that isn't finite, or a scene without motors.
        """
        write_motors(self._simulation, "position", position)

    # --- parameters ---------------------------------------------------------------------------

    @property
    def parameters(self) -> Parameters:
        """A copy of the bodies' parameters, [count, bodies] each."""
        shape = (self.count, len(self.scene.bodies))
        own = self._simulation.parameters
        return Parameters(*(np.broadcast_to(values, shape).copy() for values in own))

    def check_parameters(self, ranges: Mapping[str, Any]) -> None:
        """Raises an error if the scene can't be simulated with parameters within ranges.

        The ends of the ranges are checked: all bodies at one end, and each in turn at the other.
        For values within the last checked ranges `set_parameters` doesn't check the substep again.

        Args:
            ranges: (low, high) of "mass", "friction", "restitution" or "size": numbers, or
                [bodies] each. Parameters that aren't named are as in the scene.

        Raises:
            TypeError, ValueError: no such parameter, or a bad range; a range in which the substep
                is unstable, a body sinks, or one is too light for what presses it. The message
                names the solid and the largest safe substep or the least mass.
        """
        if self.engine != "worlds":
            raise ValueError(
                f"check_parameters needs engine='worlds', got {self.engine!r} for "
                f"{len(self.scene.bodies)} bodies: build a World with per_world_parameters=True"
            )
        low, high = check_ranges(ranges, Parameters.of(self.scene))
        if not self._allow_unstable:
            self._limits.check_range(low, high)

    def set_parameters(
        self,
        *,
        mass: Any = None,
        friction: Any = None,
        restitution: Any = None,
        size: Any = None,
        worlds: Any = None,
    ) -> None:
        """Sets the parameters of the chosen worlds, and clears their hidden contact state.

        Positions and velocities stay. After `reset` or `set_state` a world behaves bitwise as one
        whose scene has these parameters. `reset` keeps parameters, `snapshot` includes them.

        Args:
            mass: kg, [chosen, bodies] or what broadcasts to it, like all others.
            friction: of the bodies' material.
            restitution: of the bodies' material, 0 to 1.
            size: factor on every length of a body's shape, 1 as in the scene. The number of samples
                stays, which limits how much sizes can differ.
            worlds: mask [count] of the chosen worlds; all if None.

        Raises:
            ValueError: the World was built without `per_world_parameters`; a wrong shape, a value
                out of range, one for which the substep is too long, or a mass too small for what
                presses on the body. The parameters are then unchanged.
        """
        if not self.features.per_world_parameters:
            raise ValueError(
                "set_parameters needs a World that is built with per_world_parameters=True"
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
        self._simulation.change_parameters(mask, new)

    def memory(self, name: str, size: int) -> Array:
        """Numbers that each world keeps for its user: zero at first, and after `reset`.

        They mean nothing to the engine, but belong to the state: snapshots include them.

        Args:
            name: of these numbers.
            size: how many each world keeps.

        Returns:
            [count, size], to write to.

        Raises:
            ValueError: this name has numbers of another size.
        """
        found = self._memory.setdefault(name, np.zeros((self.count, size)))
        if found.shape[1] != size:
            raise ValueError(f"size of memory {name!r} must be {found.shape[1]}, got {size}")
        return found

    # --- saving -------------------------------------------------------------------------------

    def snapshot(self) -> Snapshot:
        """The complete state; worlds continue bitwise identically after `restore`."""
        memory = {name: numbers.copy() for name, numbers in self._memory.items()}
        return snapshot.save(self._simulation)._replace(memory=memory)

    def restore(self, saved: Snapshot) -> None:
        """Returns all worlds to a snapshot of a World of the same scene, fidelity and count.

        Raises:
            TypeError, ValueError: not a snapshot of such a World; parameters that `set_parameters`
                refuses, as a World with `allow_unstable` can have. The state is then unchanged.
        """
        instance("saved", saved, Snapshot)
        limits = None if self._allow_unstable else self._limits
        snapshot.restore(self._simulation, saved, limits)
        for name, numbers in saved.memory.items():
            self.memory(name, numbers.shape[1])[:] = numbers
        for name in self._memory.keys() - saved.memory.keys():
            self._memory[name][:] = 0.0
