"""World: a scene, a fidelity and a count, ready to advance, read, write, save and restore."""

import math
from typing import Any, NamedTuple

import numpy as np

from physics.analysis.step_limits import cause_of_divergence, check_step
from physics.errors import ContactOverflow, SimulationDiverged
from physics.jit import LANES, columns
from physics.model.build import build, spread
from physics.model.features import NO_ROTATION
from physics.model.pairs import Layout
from physics.model.state import FIRST_TOUCH, MOVING, PRESSED, State, allocate
from physics.model.state import copy as copy_state
from physics.model.tables import Model
from physics.model.workspace import Work
from physics.motion.drive_commands import by_worlds, make_command, make_lead
from physics.scene.fidelity import Fidelity, resolve
from physics.scene.parameters import Parameters, with_parameters
from physics.scene.scene import Body, Drive, Scene
from physics.scene.validation import array, instance, integer, positive
from physics.step.readout import WIDTH, make_readout
from physics.step.threads import check_threads, share_out
from physics.step.time_layers import cut, make_advance
from physics.variation import Variation, spin_momentum

Array = np.ndarray


class Snapshot(NamedTuple):
    """Everything that worlds hold, hidden contact state included, and what they are worlds of."""

    scene: Scene
    fidelity: Fidelity
    state: State
    parameters: Parameters | None = None  # of varied worlds


class World(Variation):
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
        self._bodies = len(scene.bodies)
        self._base: Model
        varied = instance("varied", varied, bool)
        self._base, self._features = build(scene, self.fidelity, varied)
        self._model = spread(self._base, self.count) if varied else self._base
        self._layout = Layout.of(scene, self.fidelity) if varied else None
        self._parameters = Parameters.of(scene, self.count) if varied else Parameters.of(scene)
        self._checked: tuple[Parameters, Parameters] | None = None
        self._allow_unstable = instance("allow_unstable", allow_unstable, bool)
        if not allow_unstable:
            check_step(scene, self.fidelity, self._base, self._features)
        self._find_kernels()
        self._idle: list[Work] = []
        self._sides_between: dict[tuple[int, int], Array] = {}
        self._settled = False
        self._table = columns((len(self._base.mover), WIDTH), self.count, float)
        self._lent = False
        self._state = allocate(self._base, self._features, self.count)
        self._everyone = np.ones(self.count, dtype=bool)
        self._span, self._substeps = math.nan, 0
        self._initial = self._initial_rows()
        self._reset(self._everyone)

    def __repr__(self) -> str:
        """Names what the world is made of."""
        return (
            f"World({self._bodies} bodies, {len(self.scene.drives)} drives, "
            f"{len(self.scene.statics)} statics, fidelity={self.fidelity}, count={self.count})"
        )

    def _initial_rows(self) -> Array:
        """The scene's state as rows [movers] of MOVING."""
        bodies = self.scene.bodies
        movers: list[Body | Drive] = [*bodies, *self.scene.tools]
        rows = np.zeros(len(movers), dtype=MOVING)
        rows["position"] = rows["reference"] = [m.position for m in movers]
        rows["orientation"] = [m.orientation for m in movers]
        if bodies:
            velocity = np.array([b.linear_velocity for b in bodies])
            spin = np.array([b.angular_velocity for b in bodies])
            turn = np.array([b.orientation for b in bodies])
            inertia = self._base.mover["inertia"][: len(bodies)]
            inverse_mass = self._base.mover["inverse_mass"][: len(bodies)]
            rows["momentum"][: len(bodies)] = velocity / inverse_mass[:, None]
            rows["angular_momentum"][: len(bodies)] = spin_momentum(inertia, turn, spin)
        return rows

    def _reset(self, worlds: Array) -> None:
        """Puts the chosen worlds into the scene's state, at time zero."""
        self._state.mover[worlds] = self._initial
        if self._features.varied:  # the scene's velocities, with masses of their own
            mover, bodies = self._state.mover, self._bodies
            velocity = np.array([b.linear_velocity for b in self.scene.bodies]).reshape(-1, 3)
            spin = np.array([b.angular_velocity for b in self.scene.bodies]).reshape(-1, 3)
            turn = np.array([b.orientation for b in self.scene.bodies]).reshape(-1, 4)
            chosen = np.flatnonzero(worlds)
            inverse, inertia = (self._of_bodies(x, chosen) for x in ("inverse_mass", "inertia"))
            mover["momentum"][worlds, :bodies] = velocity / inverse[..., None]
            mover["angular_momentum"][worlds, :bodies] = spin_momentum(inertia, turn, spin)
        self._state.world["time"][worlds] = 0.0
        self._forget(worlds)

    def _forget(self, worlds: Array) -> None:
        """Clears what is hidden: candidates, contact memories, forces, divergence."""
        state = self._state
        self._table_valid = self._settled = False
        state.world["stale"][worlds] = 1
        state.world["diverged"][worlds] = 0
        touch = state.touch[..., : self.count]
        touch[:, PRESSED, worlds], touch[:, FIRST_TOUCH, worlds] = 0.0, np.nan
        state.world["overflow"][worlds] = 0

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
            self._substeps = cut(self._span, self.fidelity.substep)
        self._run(self._span / self._substeps, self._substeps, self._mask(worlds))

    def _run(self, h: float, substeps: int, worlds: Array) -> None:
        kernel, everyone = self._advance, bool(worlds.all())
        if self._lent:  # who has read the table keeps it
            before = self._table
            self._table, self._lent = np.empty_like(before), False
            if self._table_valid and not everyone:
                self._table[...] = before
        model, state, table = self._model, self._state, self._table
        together = self.fidelity.collision_substeps
        groups, idle = -(-self.count // LANES), self._idle

        def run(first: int, last: int) -> Any:
            try:
                work = idle.pop()
            except IndexError:  # as many as threads are made, once
                work = Work.of(self._base, self._features)
            failed = kernel(model, state, work, table, worlds, first, last, h, substeps, together)
            idle.append(work)
            return failed

        if share_out(run, groups, self.threads) == 0:
            # a world that diverged before isn't written, nor one that isn't advanced
            self._table_valid = self._table_valid or everyone
            self._settled = self._settled or (everyone and substeps > 0)
            return
        self._table_valid = False
        diverged = np.flatnonzero((state.world["diverged"] != 0) & worlds).tolist()
        if diverged:
            self._raise_diverged(h, diverged)
        full = np.flatnonzero((state.world["overflow"] != 0) & worlds).tolist()
        raise ContactOverflow(
            f"worlds {full}: two bodies have more than eight touching particle pairs a "
            "particle; they overlap deeply, or Fidelity.skin is too wide"
        )

    def _raise_diverged(self, h: float, worlds: list[int]) -> None:
        world = worlds[0]
        scene = self.scene
        if self._features.varied:
            scene = with_parameters(scene, self._parameters.pick([world]))
        model = self._model.of_world(world)
        cause = cause_of_divergence(scene, self.fidelity, model, self._features, h)
        raise SimulationDiverged(
            world,
            int(self._state.world["diverged"][world]) - 1,
            float(self._state.world["time"][world]),
            cause,
            worlds,
        )

    def _settle(self) -> None:
        """Brings candidates and forces up to a state that was set from outside, for a look at it.

        Such worlds stay marked: their first step works the forces out under its own commands, so
        that looking changes no bit.
        """
        if self._settled:
            return
        stale = self._state.world["stale"] != 0
        if stale.any():
            try:
                self._run(self.fidelity.substep, 0, stale)
            finally:
                self._state.world["stale"][stale] = 1
        self._settled = True

    # --- writing ------------------------------------------------------------------------------

    def _mask(self, worlds: Any) -> Array:
        if worlds is None:
            return self._everyone
        mask = np.ascontiguousarray(worlds)
        if mask.dtype != bool or mask.shape != (self.count,):
            raise ValueError(
                f"worlds must be a mask of bools of shape ({self.count},), got {mask.dtype} of "
                f"shape {mask.shape}"
            )
        return mask

    def reset(self, worlds: Any = None) -> None:
        """Puts worlds back into the scene's state at time zero; all of them, or a mask [count]."""
        self._reset(self._mask(worlds))

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
        mask = self._mask(worlds)
        chosen, bodies = int(mask.sum()), self._bodies
        drives = len(self.scene.tools)
        sizes = {
            "position": (bodies, 3),
            "orientation": (bodies, 4),
            "linear_velocity": (bodies, 3),
            "angular_velocity": (bodies, 3),
            "drive_position": (drives, 3),
            "drive_velocity": (drives, 3),
            "time": (),
        }
        given = {
            "position": position,
            "orientation": orientation,
            "linear_velocity": linear_velocity,
            "angular_velocity": angular_velocity,
            "drive_position": drive_position,
            "drive_velocity": drive_velocity,
            "time": time,
        }
        new = {
            name: array(name, value, (chosen, *sizes[name]))
            for name, value in given.items()
            if value is not None
        }
        if "orientation" in new:
            # of the largest entry first: squares of large ones overflow
            largest = np.abs(new["orientation"]).max(axis=-1, keepdims=True)
            if np.any(largest < 1e-12):
                raise ValueError(
                    "orientation holds a quaternion of length zero; no rotation is (0, 0, 0, 1)"
                )
            turn = new["orientation"] / largest
            new["orientation"] = turn / np.sqrt(np.sum(turn**2, axis=-1, keepdims=True))
        spins = np.any(new.get("angular_velocity", 0.0))
        if self._features.rotation == NO_ROTATION and spins:
            raise ValueError(
                "angular_velocity must be zero in a scene of frictionless balls at rest, where "
                "rotation isn't simulated; give a body its spin in the Scene"
            )
        for name in ("drive_position", "drive_velocity"):
            for first, _ in self.scene.grippers if name in new else ():
                one, other = new[name][:, first, ::2], new[name][:, first + 1, ::2]
                if np.any(one != other):
                    raise ValueError(
                        f"{name} must have the same x and z for both fingers of a gripper, tools "
                        f"{first} and {first + 1}, which are one solid along these axes"
                    )
        state = self._state
        # what isn't given stays: the spin, not its momentum, where only the orientation changes
        spin = new.get("angular_velocity")
        if spin is None and "orientation" in new:
            turning = state.mover["angular_momentum"][mask].any()
            spin = self.angular_velocity[mask] if turning else None
        if "position" in new:
            state.mover["position"][mask, :bodies] = new["position"]
        if "orientation" in new:
            state.mover["orientation"][mask, :bodies] = new["orientation"]
        if "linear_velocity" in new:
            inverse = self._of_bodies("inverse_mass", np.flatnonzero(mask))
            state.mover["momentum"][mask, :bodies] = new["linear_velocity"] / inverse[..., None]
        if spin is not None:
            turn = state.mover["orientation"][mask, :bodies]
            state.mover["angular_momentum"][mask, :bodies] = spin_momentum(
                self._of_bodies("inertia", np.flatnonzero(mask)), turn, spin
            )
        if "drive_position" in new:
            state.mover["position"][mask, bodies:] = new["drive_position"]
            state.mover["reference"][mask, bodies:] = new["drive_position"]
            state.mover["reference_velocity"][mask, bodies:] = 0.0
        if "drive_velocity" in new:
            inverse = self._base.mover["inverse_mass"][bodies:, None]
            state.mover["momentum"][mask, bodies:] = new["drive_velocity"] / inverse
        if "time" in new:
            state.world["time"][mask] = new["time"]
        self._forget(mask)

    def command_drives(self, velocity: Any) -> None:
        """Lets every tool's reference move from where the tool is now, at a velocity.

        Args:
            velocity: [count, tools, 3] m/s, or what broadcasts to it; it holds until changed.
        """
        shape = (self.count, len(self.scene.tools), 3)
        checked = array("velocity", velocity, shape)
        make_command()(self._state.mover, self._bodies, by_worlds(checked))
        self._table_valid = self._settled = False

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
        make_lead()(self._state.mover, self._bodies, by_worlds(checked), time)
        self._settled = False

    def snapshot(self) -> Snapshot:
        """Everything the worlds hold; `restore` continues from it to the last bit."""
        own = self.parameters if self._features.varied else None
        return Snapshot(self.scene, self.fidelity, copy_state(self._state), own)

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
        elif (saved.parameters is not None) != self._features.varied:
            what = f"varied: {saved.parameters is not None}"
        else:
            what = ""
        if what:
            raise ValueError(f"saved must be of the same worlds; it has another {what}")
        if saved.parameters is not None:
            pairs = zip(self._parameters, saved.parameters, strict=True)
            other = np.any([np.any(mine != theirs, axis=1) for mine, theirs in pairs], axis=0)
            self._write_parameters(other, saved.parameters.pick(other))
        for mine, theirs in zip(self._state, saved.state, strict=True):
            mine[...] = theirs
        self._table_valid = self._settled = False

    def _find_kernels(self) -> None:
        self._advance = make_advance(self._features)
        self._readout = make_readout(self._features)

    def __getstate__(self) -> dict[str, Any]:
        """All but the kernels, which are found again by the features."""
        return {k: v for k, v in self.__dict__.items() if k not in ("_advance", "_readout")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Takes the attributes back and finds the kernels."""
        self.__dict__.update(state)
        self._find_kernels()
