"""GranularSimulation: heaps of particle bodies, with the methods of `physics.step.simulation`."""

import math
from typing import Any, ClassVar

import numpy as np

from physics.granular.advance import make_advance
from physics.granular.classes import bodies_of, constants_of
from physics.granular.coefficients import contact_coefficients, shear_loads
from physics.granular.packing import (
    allocate,
    forget,
    scratch_for,
    sort,
    with_room_for_pairs,
    with_room_for_walls,
)
from physics.granular.reports import touching_rows
from physics.granular.support import supports
from physics.granular.tables import (
    DIVERGED,
    DONE,
    MORE_FORCES,
    MORE_PAIRS,
    MORE_WALLS,
    NEEDED,
    REFRESH,
    SORT,
    STATUS,
    STEPS,
    Heap,
    HeapFeatures,
    Scratch,
)
from physics.model.build import build
from physics.model.features import GENERAL, ISOTROPIC, Features
from physics.model.free_memory import check_memory
from physics.model.state import DYNAMIC_STATE, STARTS_ANEW, State
from physics.model.state import allocate as allocate_state
from physics.model.tables import Model
from physics.rotation import rotate, rotate_back
from physics.scene.fidelity import INTEGRATORS, Fidelity
from physics.scene.parameters import Parameters
from physics.scene.scene import Scene
from physics.step.readout import WIDTH, Readout, make_readout
from physics.step.simulation import Simulation, angular_momentum_of, read_only
from physics.step.threads import run_together
from physics.step.time_layers import substep_count

Array = np.ndarray


class GranularSimulation(Simulation):
    """`count` worlds of a heap of particle bodies, one after the other.

    Args:
        scene: what is in each world.
        fidelity: how finely it is simulated.
        count: number of worlds.
        threads: number of threads, which work on a world together. Results don't depend on it.

    Attributes:
        base: the model of the scene; it lists no pairs.
        model: the same.
        features: what a dense simulation of the bodies would compile in.
        parameters: [1, bodies] of the bodies.
        state: what changes: bodies and world; its other arrays are empty.
        heaps: the hidden state of each world: lists, contact memories and the order of bodies.

    Raises:
        ValueError: the scene or the fidelity is not supported, see `supports`.
    """

    engine: ClassVar[str] = "particles"

    def __init__(self, scene: Scene, fidelity: Fidelity, count: int, threads: int) -> None:
        """Builds the model and puts every world into the scene's state."""
        reason = supports(scene, fidelity)
        if reason:
            raise ValueError(f"a heap of particles: {reason}")
        self.scene, self.fidelity, self.count, self.threads = scene, fidelity, count, threads
        self.bodies = len(scene.bodies)
        self._bodies, classes = bodies_of(scene, fidelity)
        radii = self._bodies.radii
        self._constants = constants_of(scene, fidelity, classes, radii)
        self.heap_features = self._heap_features()
        self.base, self.features = self._model_and_features()
        self.needed = self.features
        self.model = self.base
        self.parameters = Parameters.of(scene)
        self.everyone = np.ones(count, dtype=bool)
        self.heaps: list[Heap] = [self._new_heap()]
        own = self.bodies * DYNAMIC_STATE.itemsize
        check_memory(count * (own + self.heaps[0].nbytes), f"{count} heaps of {self.bodies} bodies")
        self.heaps += [self._new_heap() for _ in range(count - 1)]
        self.state: State = allocate_state(self.base, self.features, count)
        self._scratch: Scratch = scratch_for(self.heaps[0], radii, threads)
        self._advance, self._readout = make_advance(self.heap_features), make_readout(self.features)
        self._fresh = False
        self._table = np.empty((0, WIDTH, count))  # allocated when it is read
        self._table_valid = False
        self.last_substep, self._last_worlds = math.nan, self.everyone
        self.reset(self.everyone)

    def _new_heap(self) -> Heap:
        particles = self.fidelity.geometry == "particle"
        return allocate(self._bodies, self._constants, self.heap_features, particles)

    def _heap_features(self) -> HeapFeatures:
        constants, moments = self._constants, self._bodies.dynamic["inertia"]
        friction = max(
            constants.contact["friction"].max(initial=0.0),
            constants.static_contact["friction"].max(initial=0.0),
        )
        return HeapFeatures(
            integrator=INTEGRATORS.index(self.fidelity.integrator),
            rotation=ISOTROPIC if np.all(moments == moments[:, :1]) else GENERAL,
            friction=bool(friction > 0.0),
            viscous=bool(friction > 0.0) and self.fidelity.friction == "viscous",
            equal=self._bodies.equal,
            kinds=tuple(sorted(set(constants.static["kind"].tolist()))),
        )

    def _model_and_features(self) -> tuple[Model, Features]:
        """The model without pairs, and the features of its bodies."""
        own = self.heap_features
        alone = Scene(bodies=self.scene.bodies[:1], statics=self.scene.statics)
        model, features = build(alone, self.fidelity)
        model = model._replace(dynamic=self._bodies.dynamic, half_pair=model.half_pair[:0])
        return model, features._replace(
            friction=own.friction, viscous=own.viscous, rotation=own.rotation
        )

    def _write_initial(self, rows: Array) -> None:
        """Writes the scene's state to rows [bodies] of DYNAMIC_STATE."""
        bodies, constants = self.scene.bodies, self._bodies.dynamic
        rows[...] = np.zeros(1, dtype=DYNAMIC_STATE)
        rows["position"] = rows["reference"] = [body.position for body in bodies]
        rows["orientation"] = [body.orientation for body in bodies]
        velocity = np.array([body.linear_velocity for body in bodies])
        spin = np.array([body.angular_velocity for body in bodies])
        rows["momentum"] = velocity / constants["inverse_mass"][:, None]
        rows["angular_momentum"] = angular_momentum_of(
            constants["inertia"], rows["orientation"], spin
        )

    def reset(self, worlds: Array) -> None:
        """Puts the worlds of a mask into the scene's state, at time zero."""
        chosen, rows = np.flatnonzero(worlds), self.state.dynamic
        for w in chosen[:1]:
            self._write_initial(rows[w])
        for w in chosen[1:]:
            rows[w] = rows[chosen[0]]
        self.state.world["time"][worlds] = 0.0
        self.forget(worlds)

    def forget(self, worlds: Array) -> None:
        """Clears the hidden state of worlds: lists, contact memories, forces, failures."""
        self.changed()
        self.state.world["needs_refresh"][worlds] = STARTS_ANEW
        self.state.world["diverged"][worlds] = 0
        self.state.world["overflow"][worlds] = 0
        for w in np.flatnonzero(worlds):
            forget(self.heaps[w])

    def changed(self, poses: bool = True) -> None:
        """Marks forces as out of date, and the readout if `poses` have changed too."""
        self._fresh = False
        self._table_valid = self._table_valid and not poses

    def advance(self, time: float, worlds: Array) -> bool:
        """Advances the worlds of a mask by `time` s, in whole substeps.

        Returns whether all went well; `failed` lists the worlds for which it didn't.
        """
        steps = substep_count(time, self.fidelity.substep)
        return self._run(time / steps, steps, worlds)

    def refresh(self) -> bool:
        """Computes forces of states that were set from outside, for queries; as `Simulation`'s."""
        if self._fresh:
            return True
        marks = self.state.world["needs_refresh"].copy()
        well = True
        if marks.any():
            well = self._run(self.fidelity.substep, 0, marks != 0)
            self.state.world["needs_refresh"] = marks
        self._fresh = well
        return well

    def _run(self, h: float, steps: int, worlds: Array) -> bool:
        """Advances worlds one after the other; returns whether all went well."""
        self.last_substep, self._last_worlds = h, worlds
        self._table_valid = False
        well, status = True, self.state.world
        for w in np.flatnonzero(worlds):
            if status["diverged"][w] == 0:
                refresh = bool(status["needs_refresh"][w] != 0)
                try:
                    bad = self._run_heap(int(w), h, steps, refresh)
                except BaseException:  # interrupted: the world is as before, contacts begin afresh
                    self.heaps[w] = self._new_heap()
                    self.forget(np.arange(self.count) == w)
                    raise
                status["time"][w] += int(self._scratch.result[STEPS]) * h
                status["diverged"][w] = bad + 1
                status["needs_refresh"][w] = 0
            well = well and status["diverged"][w] == 0
        self._fresh = self._fresh or (well and steps > 0 and bool(worlds.all()))
        return bool(well)

    def _run_heap(self, w: int, h: float, steps: int, refresh: bool) -> int:
        """Advances one world; returns the index of its first body that isn't finite, or -1."""
        resume, states = 0, self.state.dynamic[w]
        self._advance(self.heaps[w], self._constants, self._scratch, states, 0, 0, h, steps, 0)
        self._scratch.result[:] = 0
        self._scratch.result[REFRESH] = refresh
        while True:
            heap, scratch, constants = self.heaps[w], self._scratch, self._constants
            scratch.sync[:] = 0
            threads, advance = self.threads, self._advance
            arguments: tuple[Any, ...] = (threads, h, steps, resume)

            def run(thread: int) -> None:
                advance(heap, constants, scratch, states, thread, *arguments)  # noqa: B023

            run_together(run, threads)
            status, resume = int(scratch.result[STATUS]), 1
            if status == DONE:
                return -1
            if status == DIVERGED:
                places = scratch.bad[scratch.bad >= 0]
                return self._store(w, int(places[0]))
            self._make_room(w, status, int(scratch.result[NEEDED]))

    def _make_room(self, w: int, status: int, needed: int) -> None:
        """Does what a kernel returned for."""
        heap, scratch = self.heaps[w], self._scratch
        if status == SORT:
            heap = sort(heap, self._bodies)
        elif status == MORE_PAIRS:
            heap = with_room_for_pairs(heap, needed)
        elif status == MORE_WALLS:
            heap = with_room_for_walls(heap, needed)
        self.heaps[w] = heap
        listed = int((heap.force_range[:, 1] - heap.force_range[:, 0]).sum())
        rows = max(listed, needed if status == MORE_FORCES else 0)
        if rows > len(scratch.force):
            self._scratch = scratch._replace(force=np.zeros((rows + rows // 8, 8)))
        if heap.pair.shape[2] > self._scratch.touching.shape[1]:
            touching = np.zeros((self.threads, heap.pair.shape[2]), np.uint32)
            self._scratch = self._scratch._replace(touching=touching)

    def _store(self, w: int, place: int) -> int:
        """Writes the state of a world that diverged; returns the body at a place."""
        heap, rows = self.heaps[w], self.state.dynamic[w]
        for name in ("position", "orientation", "momentum", "angular_momentum", "force", "torque"):
            values = np.moveaxis(heap.body[name], 2, 1).reshape(-1, heap.body[name].shape[1])
            rows[name][heap.order] = values[: self.bodies]
        return int(heap.order[place])

    def failed(self, field: str) -> list[int]:
        """Worlds of the last call whose status says "diverged" or "overflow"; none overflows."""
        return np.flatnonzero((self.state.world[field] != 0) & self._last_worlds).tolist()

    def readout(self) -> Readout:
        """All poses and velocities now: read-only."""
        if not self._table_valid:
            self._table = np.empty((self.bodies, WIDTH, self.count))
            self._readout(self.model, self.state, self._table)
            self._table_valid = True
        return Readout(read_only(self._table[..., : self.count].transpose(2, 0, 1)))

    def of_bodies(self, name: str, worlds: Array | None = None) -> Array:
        """A column [bodies, ...] of the model's bodies, for any worlds."""
        return np.asarray(self.model.dynamic[name])

    def angular_velocity(self) -> Array:
        """[count, bodies, 3] rad/s, world frame."""
        rows, inverse = self.state.dynamic, self.of_bodies("inverse_inertia")
        back = inverse * rotate_back(rows["orientation"], rows["angular_momentum"])
        return np.asarray(rotate(rows["orientation"], back))

    @property
    def particles(self) -> tuple[Array, Array]:
        """Body [n] of each particle; and x y z in its frame and radius, [n, 4] in m."""
        return np.repeat(np.arange(self.bodies), self._bodies.particles), self._bodies.points

    def coefficients(self, first: int, second: int) -> dict[str, float]:
        """Coefficients of the contacts of a body with another solid, in scene order.

        Stiffness and shear_stiffness in N/m, damping (a ratio), shear_damping in N s/m,
        inverse_mass of the pair in 1/kg, friction, weight of each particle, and what `shear_loads`
        says of both bodies.
        """
        own, constants = self._bodies, self._constants
        body = own.class_of[first]
        if second < self.bodies:
            row = constants.contact[body, own.class_of[second]]
            other = own.dynamic["inverse_mass"][second]
        else:
            row, other = constants.static_contact[body, second - self.bodies], 0.0
        k, inverse_mass, shear, damping = contact_coefficients(
            row["unit_stiffness"], row["stiffness"], row["shear_ratio"], row["leverage"],
            row["first_compliance"], row["second_compliance"],
            own.dynamic["inverse_mass"][first], other, constants.step,
        )  # fmt: skip
        of_owner = row["first_compliance"] * own.dynamic["inverse_mass"][first]
        of_other = row["second_compliance"] * other
        spring = shear if self.heap_features.history else 0.0
        grip = shear_loads(spring, damping, of_owner, of_other, 1.0, constants.step)
        return {
            "owner_shear_load": grip[0],
            "surface_shear_load": grip[1],
            "spring_part": grip[2],
            "stiffness": k,
            "shear_stiffness": shear,
            "damping": float(row["damping"]),
            "shear_damping": damping,
            "inverse_mass": inverse_mass,
            "friction": float(row["friction"]),
            "weight": float(own.weight[first]),
        }

    def touching(self, world: int) -> Array:
        """Rows of `reports.ROW` of what touches in one world now."""
        self.refresh()
        return touching_rows(
            self.heaps[world], self._constants, self._scratch, self.heap_features,
            self.state.dynamic[world],
        )  # fmt: skip

    def classes(self) -> Array:
        """[solids] a number for each: equal ones have the same coefficients with any other."""
        statics = 1 + self._bodies.class_of.max() + np.arange(len(self.scene.statics))
        return np.concatenate([self._bodies.class_of, statics])

    @property
    def hidden_nbytes(self) -> int:
        """Bytes of lists and contact memories."""
        return sum(array.nbytes for heap in self.heaps for array in heap)

    def add_wrench(self, wrench: Array) -> None:
        """Not offered here.

        Raises:
            ValueError: always.
        """
        raise ValueError(
            f"apply_wrench is not offered in a heap of {self.bodies} bodies of particles with "
            'damping="dashpot"; Fidelity(damping="hunt_crossley") simulates the scene with it'
        )

    def saved(self) -> list[Heap]:
        """A deep copy of the hidden state; with one of `state` a run continues bitwise equal."""
        return [Heap(*(array.copy() for array in heap)) for heap in self.heaps]

    def restore(self, saved: list[Heap]) -> None:
        """Returns to a copy of the hidden state."""
        self.heaps = [Heap(*(array.copy() for array in heap)) for heap in saved]
        self.changed()
        for w in range(self.count):
            self._make_room(w, DONE, 0)

    def __getstate__(self) -> dict[str, Any]:
        """All attributes but the kernels, which follow from the features."""
        return {k: v for k, v in self.__dict__.items() if k not in ("_advance", "_readout")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restores the attributes and finds the kernels."""
        self.__dict__.update(state)
        self._advance, self._readout = make_advance(self.heap_features), make_readout(self.features)
