"""Simulation: the arrays of many worlds, and the kernels that advance them."""

import math
from typing import Any

import numpy as np

from physics.jit import LANES, columns
from physics.model.build import build, spread, vary
from physics.model.features import ISOTROPIC, Features
from physics.model.pairs import Layout
from physics.model.state import FIRST_TOUCH, MOVING, PRESSED, State, allocate
from physics.model.tables import Model
from physics.model.workspace import Work
from physics.rotation import rotate, rotate_back
from physics.scene.fidelity import Fidelity
from physics.scene.parameters import Parameters
from physics.scene.scene import Body, Drive, Scene
from physics.step.readout import WIDTH, Readout, make_readout
from physics.step.threads import share_out
from physics.step.time_layers import cut, make_advance

Array = np.ndarray


class Simulation:
    """`count` worlds of a scene: their model, their state and the kernels compiled for them.

    Args:
        scene: what is in each world.
        fidelity: how finely it is simulated.
        count: number of worlds.
        threads: number of threads that share the worlds.
        varied: whether worlds have parameters of their own.

    Attributes:
        base: the model of the scene itself.
        model: the model that the kernels read; with per-world rows if `varied`.
        features: what is compiled in.
        parameters: [count, bodies] of the bodies; of identical worlds [1, bodies].
        state: what changes.
    """

    def __init__(
        self, scene: Scene, fidelity: Fidelity, count: int, threads: int, varied: bool
    ) -> None:
        """Builds the model and puts every world into the scene's state."""
        self.scene, self.fidelity, self.count, self.threads = scene, fidelity, count, threads
        self.bodies = len(scene.bodies)
        self.base: Model
        self.features: Features
        self.base, self.features = build(scene, fidelity, varied)
        self.model = spread(self.base, count) if varied else self.base
        self._layout = Layout.of(scene, fidelity) if varied else None
        self.parameters = Parameters.of(scene, count if varied else 1)
        self.state: State = allocate(self.base, self.features, count)
        self.everyone = np.ones(count, dtype=bool)
        self._find_kernels()
        self._idle: list[Work] = []
        self._settled = False
        self._table = columns((len(self.base.mover), WIDTH), count, float)
        self._table_valid = self._lent = False
        self._span, self._substeps = math.nan, 0
        self.last_substep, self._last_worlds = math.nan, self.everyone  # of the last call; s
        self._initial = self._initial_rows()
        self.reset(self.everyone)

    def _initial_rows(self) -> Array:
        """The scene's poses as rows [movers] of MOVING."""
        movers: list[Body | Drive] = [*self.scene.bodies, *self.scene.tools]
        rows = np.zeros(len(movers), dtype=MOVING)
        rows["position"] = rows["reference"] = [m.position for m in movers]
        rows["orientation"] = [m.orientation for m in movers]
        return rows

    def reset(self, worlds: Array) -> None:
        """Puts the worlds of a mask into the scene's state, at time zero."""
        bodies, mover = self.scene.bodies, self.state.mover
        mover[worlds] = self._initial
        velocity = np.array([b.linear_velocity for b in bodies]).reshape(-1, 3)
        spin = np.array([b.angular_velocity for b in bodies]).reshape(-1, 3)
        turn = np.array([b.orientation for b in bodies]).reshape(-1, 4)
        chosen = np.flatnonzero(worlds)
        inverse, inertia = (self.of_bodies(name, chosen) for name in ("inverse_mass", "inertia"))
        mover["momentum"][worlds, : self.bodies] = velocity / inverse[..., None]
        mover["angular_momentum"][worlds, : self.bodies] = spin_momentum(inertia, turn, spin)
        self.state.world["time"][worlds] = 0.0
        self.forget(worlds)

    def forget(self, worlds: Array) -> None:
        """Clears what is hidden: candidates, contact memories, forces, divergence."""
        state = self.state
        self.changed()
        state.world["stale"][worlds] = 1
        state.world["diverged"][worlds] = 0
        touch = state.touch[..., : self.count]
        touch[:, PRESSED, worlds], touch[:, FIRST_TOUCH, worlds] = 0.0, np.nan
        state.world["overflow"][worlds] = 0

    def changed(self, poses: bool = True) -> None:
        """Notes that the state was written from outside; with `poses`, what `readout` holds too."""
        self._settled = False
        self._table_valid = self._table_valid and not poses

    def advance(self, time: float, worlds: Array) -> bool:
        """Advances the worlds of a mask by `time` s, in whole substeps; whether all are whole.

        `failed` says which aren't.
        """
        if time != self._span:  # frames are all of one length
            self._span, self._substeps = time, cut(time, self.fidelity.substep)
        return self._run(self._span / self._substeps, self._substeps, worlds)

    def failed(self, field: str) -> list[int]:
        """Worlds of the last call whose status says "diverged" or "overflow"."""
        return np.flatnonzero((self.state.world[field] != 0) & self._last_worlds).tolist()

    def settle(self) -> bool:
        """Brings candidates and forces up to a state that was set from outside, for a look at it.

        Such worlds stay marked: their first step works the forces out under its own commands, so
        that looking changes no bit. Returns whether that went well.
        """
        if self._settled:
            return True
        stale, well = self.state.world["stale"] != 0, True
        if stale.any():
            try:
                well = self._run(self.fidelity.substep, 0, stale)
            finally:
                self.state.world["stale"][stale] = 1
        self._settled = well
        return well

    def _run(self, h: float, substeps: int, worlds: Array) -> bool:
        """Runs the kernel on the worlds of a mask; whether all of them are whole."""
        kernel, everyone = self._advance, bool(worlds.all())
        self.last_substep, self._last_worlds = h, worlds
        if self._lent:  # who has read the table keeps it
            before = self._table
            self._table, self._lent = np.empty_like(before), False
            if self._table_valid and not everyone:
                self._table[...] = before
        model, state, table = self.model, self.state, self._table
        together = self.fidelity.collision_substeps
        groups, idle = -(-self.count // LANES), self._idle

        def run(first: int, last: int) -> Any:
            try:
                work = idle.pop()
            except IndexError:  # as many as threads are made, once
                work = Work.of(self.base, self.features)
            failed = kernel(model, state, work, table, worlds, first, last, h, substeps, together)
            idle.append(work)
            return failed

        if share_out(run, groups, self.threads) == 0:
            # a world that diverged before isn't written, nor one that isn't advanced
            self._table_valid = self._table_valid or everyone
            self._settled = self._settled or (everyone and substeps > 0)
            return True
        self._table_valid = False
        return False

    def readout(self) -> Readout:
        """All poses and velocities as they are now, drives after the bodies: read-only."""
        if not self._table_valid:
            self._table = np.empty_like(self._table) if self._lent else self._table
            self._readout(self.model, self.state, self._table)
            self._table_valid = True
        self._lent = True
        return Readout(read_only(self._table[..., : self.count].transpose(2, 0, 1)))

    def of_bodies(self, name: str, worlds: Array | None = None) -> Array:
        """A field of the model's bodies: [bodies, ...], or [n, bodies, ...] of varied worlds [n].

        Both go with an array [n, bodies, ...]. All worlds if None.
        """
        rows = self.model.mover[name]
        if self.model.mover.ndim == 1:
            return rows[: self.bodies]
        worlds = np.arange(self.count) if worlds is None else worlds
        group, lane = np.divmod(worlds, LANES)
        return rows[group, ..., lane][:, : self.bodies]

    def spin(self, inverse_inertia: Array, orientation: Array, momentum: Array) -> Array:
        """Angular velocity [..., 3] of an angular momentum."""
        if self.features.rotation == ISOTROPIC:  # the same about every axis: no need to turn
            return np.asarray(inverse_inertia * momentum)
        turned = inverse_inertia * rotate_back(orientation, momentum)
        return np.asarray(rotate(orientation, turned))

    def angular_velocity(self) -> Array:
        """[count, bodies, 3] rad/s, world frame."""
        mover = self.state.mover[:, : self.bodies]
        inverse = self.of_bodies("inverse_inertia")
        return self.spin(inverse, mover["orientation"], mover["angular_momentum"])

    def write_parameters(self, worlds: Array, new: Parameters) -> None:
        """Writes parameters [n, bodies] of the worlds of a mask, and what follows from them."""
        assert self._layout is not None
        for mine, values in zip(self.parameters, new, strict=True):
            mine[worlds] = values
        vary(self.model, self._layout, np.flatnonzero(worlds), new)

    def vary_bodies(self, worlds: Array, new: Parameters) -> None:
        """Gives the worlds of a mask other parameters [n, bodies]; poses and velocities stay."""
        chosen, before = np.flatnonzero(worlds), self.parameters.pick(worlds)
        rows = self.state.mover[worlds, : self.bodies]  # a copy
        momentum, turning, orientation = (
            rows[name] for name in ("momentum", "angular_momentum", "orientation")
        )
        velocity = momentum * self.of_bodies("inverse_mass", chosen)[..., None]
        spin = self.spin(self.of_bodies("inverse_inertia", chosen), orientation, turning)
        self.write_parameters(worlds, new)
        # velocities stay; where nothing bears on them their momenta do, to the last bit
        heavier = (new.mass != before.mass)[..., None]
        other = heavier | (new.size != before.size)[..., None]
        kept = velocity / self.of_bodies("inverse_mass", chosen)[..., None]
        rows["momentum"] = np.where(heavier, kept, momentum)
        kept = spin_momentum(self.of_bodies("inertia", chosen), orientation, spin)
        rows["angular_momentum"] = np.where(other, kept, turning)
        self.state.mover[worlds, : self.bodies] = rows
        self.forget(worlds)

    def _find_kernels(self) -> None:
        self._advance = make_advance(self.features)
        self._readout = make_readout(self.features)

    def __getstate__(self) -> dict[str, Any]:
        """All but the kernels, which are found again by the features."""
        return {k: v for k, v in self.__dict__.items() if k not in ("_advance", "_readout")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Takes the attributes back and finds the kernels."""
        self.__dict__.update(state)
        self._find_kernels()


def read_only(values: Array) -> Array:
    """A view that can't be written to."""
    view = values[:]
    view.flags.writeable = False
    return view


def spin_momentum(inertia: Array, orientation: Array, spin: Array) -> Array:
    """L = R J0 R^T omega, [..., 3], of principal moments [..., 3]."""
    return rotate(orientation, inertia * rotate_back(orientation, spin))
