"""Simulation: the arrays of many worlds, and the kernels that advance them."""

import math
from typing import Any, ClassVar

import numpy as np

from physics.compiler.jit import LANES, columns
from physics.model.build import build, expand_per_world, write_per_world
from physics.model.features import ISOTROPIC, Features
from physics.model.joints import motor_commands
from physics.model.pairs import Layout
from physics.model.state import (
    DYNAMIC_STATE,
    FIRST_TOUCH,
    NEW_FORCES,
    NORMAL_FORCE,
    STARTS_ANEW,
    State,
    allocate,
)
from physics.model.tables import Model
from physics.model.workspace import Workspace
from physics.rotation import rotate, rotate_back
from physics.scene.drives import Drive
from physics.scene.fidelity import Fidelity
from physics.scene.parameters import Parameters
from physics.scene.scene import Scene
from physics.scene.solids import Body
from physics.step.kernel_choice import choose, find_advance, prepare
from physics.step.lane_order import PAUSE, Scratch, can_sort, make_sort, sort_worlds
from physics.step.readout import WIDTH, Readout, make_readout
from physics.step.threads import run_in_blocks
from physics.step.time_layers import substep_count

Array = np.ndarray


class Simulation:
    """`count` worlds of a scene: their model, their state and the kernels compiled for them.

    Args:
        scene: what is in each world.
        fidelity: how finely it is simulated.
        count: number of worlds.
        threads: number of threads.
        per_world_parameters: whether parameters may differ between worlds.
        measures_work: whether the work of servos is summed up.
        kernel: see `kernel_choice`.

    Attributes:
        base: the model of the scene itself.
        model: the model that the kernels read, with rows for each lane group if
            `per_world_parameters`.
        engine: see `physics.engines`.
        needed: the features that the scene needs.
        features: what is compiled in, which may be more.
        parameters: [count, bodies] of the bodies; of identical worlds [1, bodies].
        state: what changes.
    """

    engine: ClassVar[str] = "worlds"

    def __init__(
        self,
        scene: Scene,
        fidelity: Fidelity,
        count: int,
        threads: int,
        per_world_parameters: bool,
        measures_work: bool = False,
        kernel: str = "special",
    ) -> None:
        """Builds the model and puts every world into the scene's state."""
        self.scene, self.fidelity, self.count, self.threads = scene, fidelity, count, threads
        self.bodies = len(scene.bodies)
        self.base: Model
        self.needed: Features
        self._per_world = per_world_parameters
        self.base, self.needed = self._build()
        if measures_work:
            self.needed = self.needed._replace(measures_work=True)
        self.features = self._choose(kernel)
        self.model = expand_per_world(self.base, count) if per_world_parameters else self.base
        self._layout = Layout.of(scene, fidelity) if per_world_parameters else None
        self.parameters = Parameters.of(scene, count if per_world_parameters else 1)
        self.state: State = allocate(self.base, self.features, count)
        self.everyone = np.ones(count, dtype=bool)
        self._idle: list[Workspace] = []
        self._scratches: list[Scratch] = []
        self._allocate()
        self._find_kernels()
        self._calls_to_sort = 0
        self._fresh = False
        self._table = columns((len(self.base.dynamic), WIDTH), count, float)
        self._table_valid = self._lent = self._prepared = False
        self._span, self._substeps = math.nan, 0
        self.last_substep, self._last_worlds = math.nan, self.everyone  # of the last call; s
        self._initial = self._initial_rows()
        self.reset(self.everyone)

    def _build(self) -> tuple[Model, Features]:
        """The model of the scene itself, and what is compiled in."""
        return build(self.scene, self.fidelity, self._per_world)

    def _choose(self, kernel: str) -> Features:
        """What is compiled in."""
        return choose(kernel, self.needed, self.base, self.fidelity, self.count)

    def _prepare(self) -> None:
        """A second process starts to compile the kernel, if that has to be done."""
        if not self._prepared:
            prepare(self.features, self.base, self.fidelity)
            self._prepared = True

    def _allocate(self) -> None:
        """Arrays beside the state: none."""

    def _initial_rows(self) -> Array:
        """The scene's state as rows [dynamic bodies] of DYNAMIC_STATE."""
        dynamic_bodies: list[Body | Drive] = [*self.scene.bodies, *self.scene.driven_bodies]
        rows = np.zeros(len(dynamic_bodies), dtype=DYNAMIC_STATE)
        rows["position"] = rows["reference"] = [body.position for body in dynamic_bodies]
        rows["orientation"] = [body.orientation for body in dynamic_bodies]
        bodies = self.base.dynamic[: self.bodies]
        rows[: self.bodies] = self._moving(
            rows[: self.bodies], bodies["inverse_mass"], bodies["inertia"]
        )
        return rows

    def _moving(self, rows: Array, inverse_mass: Array, inertia: Array) -> Array:
        """Rows [..., bodies] of DYNAMIC_STATE with the momenta of the scene's velocities."""
        bodies = self.scene.bodies
        velocity = np.array([b.linear_velocity for b in bodies]).reshape(-1, 3)
        angular_velocity = np.array([b.angular_velocity for b in bodies]).reshape(-1, 3)
        orientation = np.array([b.orientation for b in bodies]).reshape(-1, 4)
        rows["momentum"] = velocity / inverse_mass[..., None]
        rows["angular_momentum"] = angular_momentum_of(inertia, orientation, angular_velocity)
        return rows

    def reset(self, worlds: Array) -> None:
        """Puts the worlds of a mask into the scene's state, at time zero."""
        dynamic = self.state.dynamic
        dynamic[worlds] = self._initial
        if self.features.per_world_parameters:  # the same velocities are other momenta
            chosen = np.flatnonzero(worlds)
            inverse_mass, inertia = (self.of_bodies(x, chosen) for x in ("inverse_mass", "inertia"))
            rows = dynamic[worlds, : self.bodies]  # a copy
            dynamic[worlds, : self.bodies] = self._moving(rows, inverse_mass, inertia)
        self.state.world["time"][worlds] = 0.0
        self.state.motor[worlds] = motor_commands(self.scene)
        if self.state.wrench.size > 0:
            self.state.wrench[worlds] = 0.0
        self.forget(worlds)

    def forget(self, worlds: Array) -> None:
        """Clears the hidden state of worlds: candidates, contact memories, forces, failures."""
        state = self.state
        self.changed()
        state.world["needs_refresh"][worlds] = STARTS_ANEW
        state.world["diverged"][worlds] = 0
        if state.pace.size > 0:
            state.pace[worlds] = 0
        touch = state.touch[..., : self.count]
        touch[:, NORMAL_FORCE, worlds], touch[:, FIRST_TOUCH, worlds] = 0.0, np.nan
        state.world["overflow"][worlds] = 0
        if state.servo.size > 0:
            state.servo[worlds] = 0

    @property
    def hidden_nbytes(self) -> int:
        """Bytes of what the next steps depend on besides `state`."""
        return 0

    def saved(self) -> Any:
        """A copy of what the next steps depend on besides `state`: nothing."""
        return None

    def restore(self, saved: Any) -> None:
        """Returns to what `saved` gave."""

    def changed(self, poses: bool = True) -> None:
        """Marks forces as out of date, and the readout if `poses` have changed too."""
        self._fresh = False
        self._table_valid = self._table_valid and not poses

    def advance(self, time: float, worlds: Array) -> bool:
        """Advances the worlds of a mask by `time` s, in whole substeps.

        Returns whether all went well; `failed` lists the worlds for which it didn't.
        """
        if time != self._span:  # most frames have the same length
            self._span, self._substeps = time, substep_count(time, self.fidelity.substep)
        pushed = self.state.wrench.size > 0 and self.state.wrench[worlds].any()
        try:
            return self._run(self._span / self._substeps, self._substeps, worlds)
        finally:
            if pushed:
                self._end_wrenches(worlds)

    def add_wrench(self, wrench: Array) -> None:
        """Adds forces and torques [count, bodies, 6] that act during the next `advance`."""
        self._compile_wrenches()
        self.state.wrench[:, : self.bodies] += wrench
        self._new_forces(np.asarray(wrench.any(axis=(1, 2))))

    def _compile_wrenches(self) -> None:
        """Adds the stage and the state of forces from the user, unless they are there."""
        if self.state.wrench.size > 0:
            return
        rows = np.zeros((self.count, len(self.base.dynamic), 6))
        self.state = self.state._replace(wrench=rows)
        if not self.features.wrench:
            self.features = self.features._replace(wrench=True)
            self._find_kernels()

    def set_wrenches(self, wrench: Array) -> None:
        """Sets the forces from the user to those of a state, which has none if it is empty."""
        if wrench.size > 0:
            self._compile_wrenches()
        if self.state.wrench.size > 0:
            self.state.wrench[...] = wrench if wrench.size > 0 else 0.0

    def _end_wrenches(self, worlds: Array) -> None:
        """Clears the forces of the worlds of a mask: they hold for one call of `advance`."""
        pushed = np.asarray(worlds & self.state.wrench.any(axis=(1, 2)))
        self.state.wrench[pushed] = 0.0
        self._new_forces(pushed)

    def renew_forces(self) -> None:
        """Marks the forces of all worlds as out of date; contacts keep their memory."""
        self._new_forces(self.everyone)

    def _new_forces(self, worlds: Array) -> None:
        """Marks the forces of the worlds of a mask as out of date; contacts keep their memory."""
        marks = self.state.world["needs_refresh"]
        marks[worlds & (marks == 0)] = NEW_FORCES
        self.changed(poses=False)

    def failed(self, field: str) -> list[int]:
        """Worlds of the last call whose status says "diverged" or "overflow"."""
        return np.flatnonzero((self.state.world[field] != 0) & self._last_worlds).tolist()

    def refresh(self) -> bool:
        """Computes candidates and forces of states that were set from outside, for queries.

        Such worlds stay marked: their next step computes the forces again, with the commands valid
        then, so a query changes no bit of the result. Returns whether all went well.
        """
        if self._fresh:
            return True
        marks, well = self.state.world["needs_refresh"].copy(), True
        if marks.any():
            try:
                well = self._run(self.fidelity.substep, 0, marks != 0)
            finally:
                self.state.world["needs_refresh"] = marks
        self._fresh = well
        return well

    def _run(self, h: float, substeps: int, worlds: Array) -> bool:
        """Runs the kernel on the worlds of a mask; returns whether all went well."""
        kernel, everyone = self._advance, worlds is self.everyone or bool(worlds.all())
        self.last_substep, self._last_worlds = h, worlds
        if self._lent:  # a reader holds the table
            before = self._table
            self._table, self._lent = np.empty_like(before), False
            if self._table_valid and not everyone:
                self._table[...] = before
        model, state, table = self.model, self.state, self._table
        collision_substeps = self.fidelity.collision_substeps
        groups, scratches = -(-self.count // LANES), self._scratches
        self._calls_to_sort -= 1 if substeps > 0 else 0
        sort = substeps > 0 and self._calls_to_sort <= 0
        sort = sort and can_sort(model, self.features, self.count)
        if sort:
            make_sort()  # once, before several threads ask for it
        moved: list[int] = []

        def run(first: int, last: int) -> Any:
            workspace = self.take_workspace()
            if sort:
                try:
                    scratch = scratches.pop()
                except IndexError:
                    scratch = Scratch.of(model, state)
                moved.append(sort_worlds(model, state, scratch, first, last))
                scratches.append(scratch)
            failed = kernel(
                model, state, workspace, table, worlds, first, last, h, substeps, collision_substeps
            )
            self.return_workspace(workspace)
            return failed

        failed = run_in_blocks(run, groups, self.threads)
        if sort:
            self._calls_to_sort = 1 if any(moved) else PAUSE
        if failed == 0:
            # worlds that aren't advanced or that diverged before aren't written
            self._table_valid = self._table_valid or everyone
            self._fresh = self._fresh or (everyone and substeps > 0)
            return True
        self._table_valid = False
        return False

    def take_workspace(self) -> Workspace:
        """Working arrays that no other thread has; `return_workspace` keeps them."""
        try:
            return self._idle.pop()
        except IndexError:  # happens once per thread
            return Workspace.of(self.base, self.features)

    def return_workspace(self, workspace: Workspace) -> None:
        """Keeps working arrays for later calls."""
        self._idle.append(workspace)

    def readout(self) -> Readout:
        """All poses and velocities now, drives after the bodies: read-only."""
        if not self._table_valid:
            self._prepare()  # before the first step, if this is the first call of a kernel
            self._table = np.empty_like(self._table) if self._lent else self._table
            self._readout(self.model, self.state, self._table)
            self._table_valid = True
        self._lent = True
        return Readout(read_only(self._table[..., : self.count].transpose(2, 0, 1)))

    def of_bodies(self, name: str, worlds: Array | None = None) -> Array:
        """A column of the model's bodies: [bodies, ...], or [n, bodies, ...] of the worlds [n].

        The latter with per-world parameters; both broadcast with an array [n, bodies, ...]. All
        worlds if None.
        """
        rows = self.model.dynamic[name]
        if self.model.dynamic.ndim == 1:
            return rows[: self.bodies]
        worlds = np.arange(self.count) if worlds is None else worlds
        group, lane = np.divmod(worlds, LANES)
        return rows[group, ..., lane][:, : self.bodies]

    def _angular_velocity_from(
        self, inverse_inertia: Array, orientation: Array, momentum: Array
    ) -> Array:
        """Angular velocity [..., 3] of an angular momentum."""
        if self.needed.rotation == ISOTROPIC:  # the same about every axis, in any frame
            return np.asarray(inverse_inertia * momentum)
        rotated = inverse_inertia * rotate_back(orientation, momentum)
        return np.asarray(rotate(orientation, rotated))

    def angular_velocity(self) -> Array:
        """[count, bodies, 3] rad/s, world frame."""
        dynamic = self.state.dynamic[:, : self.bodies]
        inverse = self.of_bodies("inverse_inertia")
        return self._angular_velocity_from(
            inverse, dynamic["orientation"], dynamic["angular_momentum"]
        )

    def write_parameters(self, worlds: Array, new: Parameters) -> None:
        """Writes parameters [n, bodies] of the worlds of a mask, and what depends on them."""
        assert self._layout is not None
        for mine, values in zip(self.parameters, new, strict=True):
            mine[worlds] = values
        write_per_world(self.model, self._layout, np.flatnonzero(worlds), new)

    def change_parameters(self, worlds: Array, new: Parameters) -> None:
        """Changes the parameters [n, bodies] of the worlds of a mask; poses and velocities stay."""
        chosen, before = np.flatnonzero(worlds), self.parameters.pick(worlds)
        rows = self.state.dynamic[worlds, : self.bodies]  # a copy
        momentum, turning, orientation = (
            rows[name] for name in ("momentum", "angular_momentum", "orientation")
        )
        velocity = momentum * self.of_bodies("inverse_mass", chosen)[..., None]
        angular_velocity = self._angular_velocity_from(
            self.of_bodies("inverse_inertia", chosen), orientation, turning
        )
        self.write_parameters(worlds, new)
        # where mass or inertia is unchanged, the momentum stays bitwise the same
        heavier = (new.mass != before.mass)[..., None]
        other = heavier | (new.size != before.size)[..., None]
        kept = velocity / self.of_bodies("inverse_mass", chosen)[..., None]
        rows["momentum"] = np.where(heavier, kept, momentum)
        kept = angular_momentum_of(self.of_bodies("inertia", chosen), orientation, angular_velocity)
        rows["angular_momentum"] = np.where(other, kept, turning)
        self.state.dynamic[worlds, : self.bodies] = rows
        self.forget(worlds)

    def _find_kernels(self) -> None:
        self._advance = find_advance(self.features, self.fidelity)
        self._readout = make_readout(self.features)

    def __getstate__(self) -> dict[str, Any]:
        """All attributes but kernels and working arrays, which follow from the features."""
        left_out = ("_advance", "_readout", "_idle", "_scratches", "_load", "_store")
        return {k: v for k, v in self.__dict__.items() if k not in left_out}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restores the attributes and finds the kernels."""
        self.__dict__.update(state)
        self._idle, self._scratches = [], []
        self._find_kernels()


def read_only(values: Array) -> Array:
    """A view that can't be written to."""
    view = values[:]
    view.flags.writeable = False
    return view


def angular_momentum_of(inertia: Array, orientation: Array, angular_velocity: Array) -> Array:
    """L = R J0 R^T omega, [..., 3], of principal moments [..., 3]."""
    return rotate(orientation, inertia * rotate_back(orientation, angular_velocity))
