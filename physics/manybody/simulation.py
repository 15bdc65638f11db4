"""Simulation of worlds of many bodies: pairs of bodies side by side in vector lanes, not worlds."""

from typing import Any, ClassVar

import numpy as np

from physics.compiler.jit import LANES, aligned_zeros
from physics.manybody.impulse_steps import make_impulse_steps
from physics.manybody.kinds import Kinds, find_kinds
from physics.manybody.mechanisms import Mechanisms, find_mechanisms
from physics.manybody.pair_lists import PairLists
from physics.manybody.spring_steps import REFRESH, STEP, make_spring_steps
from physics.manybody.tables import FRAME_WIDTH, MOST_COLOURS, POSITION, ROTATION, Crowd, Pairs
from physics.manybody.team import SHARED
from physics.manybody.transfer import make_load_bodies, make_place_bodies, make_store_bodies
from physics.model.build import dynamic_rows, per_world_dtype
from physics.model.coefficients import dynamic_columns
from physics.model.features import Features, general
from physics.model.fields import field_rows
from physics.model.impulse_rows import CONTACT_ROW
from physics.model.joints import joint_rows
from physics.model.pairs import Layout
from physics.model.state import STARTS_ANEW
from physics.model.tables import DYNAMIC_PER_WORLD, Model
from physics.model.workspace import GIVEN, JOINT_WORK, NORMAL_SUMS, SOLID, START, Workspace
from physics.rotation import rotation_matrix
from physics.scene.parameters import Parameters
from physics.scene.solids import Ground
from physics.scene.validation import IDENTITY
from physics.step.readout import make_readout
from physics.step.simulation import Simulation
from physics.step.threads import run_together

Array = np.ndarray

# batches of pairs for which a second thread pays
_FEWEST_BATCHES = 32


class CrowdSimulation(Simulation):
    """`count` worlds of many bodies, one after the other; threads share the work of each.

    Attributes:
        kinds: of solids and pairs.
        mechanisms: what couples bodies otherwise than by contact.
    """

    engine: ClassVar[str] = "bodies"
    kinds: Kinds
    mechanisms: Mechanisms

    def _build(self) -> tuple[Model, Features]:
        """Tables of the bodies; those of pairs are in `kinds`."""
        scene = self.scene
        kinds, self.mechanisms = find_kinds(scene, self.fidelity), find_mechanisms(scene)
        model = kinds.model._replace(
            joint_row=self.mechanisms.joint_row,
            field=self.mechanisms.field,
            surface_point=self.mechanisms.surface_point,
        )
        self.kinds = kinds._replace(model=model)
        layout = Layout.of(scene, self.fidelity, no_half_pairs=True)
        dynamic = dynamic_rows(scene)
        for name, values in dynamic_columns(layout, Parameters.of(scene)).items():
            dynamic[name] = values[0]
        poses = [
            (0.0, 0.0, s.height, *IDENTITY) if isinstance(s, Ground) else
            (*s.position, *s.orientation)
            for s in scene.statics
        ]  # fmt: skip
        base = model._replace(
            dynamic=dynamic,
            half_pair=model.half_pair[:0],
            compound_part=model.compound_part[:0],
            static=np.array(poses, dtype=float).reshape(-1, 7),
            field=field_rows(scene)[0],
            joint_row=joint_rows(scene, len(dynamic) + len(poses)),
        )
        return base, self.kinds.features

    def _choose(self, kernel: str) -> Features:
        """What is compiled in: what is needed, unless a general kernel is asked for."""
        more = general(self.needed) if kernel == "general" else None
        if more is None:
            return self.needed
        features = more._replace(rotation=self.needed.rotation)
        self.kinds = self.kinds._replace(features=features)
        return features

    def _prepare(self) -> None:
        """Left to the first call, which has the arrays."""

    def _find_kernels(self) -> None:
        impulse = self.kinds.features.impulse
        make: Any = make_impulse_steps if impulse else make_spring_steps
        self._advance, self._compiled = make(self.kinds.features), False
        self._load, self._store = make_load_bodies(), make_store_bodies()
        self._readout = make_readout(self.features)

    def _allocate(self) -> None:
        """The arrays of all worlds, without pairs."""
        self._rows = aligned_zeros(0, CONTACT_ROW)
        self._worlds = [[self._empty_world()] for _ in range(self.count)]
        blocks = len(self._worlds[0][0].solid)
        self._lists = [
            PairLists(self.scene, self.kinds, self.mechanisms, blocks) for _ in range(self.count)
        ]

    def _empty_world(self) -> Crowd:
        """The arrays of a world whose bodies rest at the origin."""
        found, static = self.mechanisms, self.base.static
        blocks, groups = len(found.body) // LANES, len(found.group)
        places = blocks * LANES + len(static)
        dtype = per_world_dtype(self.base.dynamic.dtype, DYNAMIC_PER_WORLD)
        constants, rows = aligned_zeros(blocks, dtype), self.base.dynamic[found.body]
        copies = np.ones(len(rows), dtype=bool)
        copies[found.place] = False
        rows["weight"][copies] = 0.0
        rows["gripper_partner"] = self._local_partners(rows)
        for name in dtype.names or ():
            values = rows[name].reshape(blocks, LANES, *rows[name].shape[1:])
            if name in DYNAMIC_PER_WORLD:
                constants[name] = np.moveaxis(values, 1, -1)
            else:
                constants[name] = values[:, 0]
        solid = aligned_zeros(blocks, SOLID)
        solid["orientation"][:, 3] = 1.0
        solid["weight"] = constants["weight"]
        frame = np.zeros((places, FRAME_WIDTH))
        frame[blocks * LANES :, POSITION : POSITION + 3] = static[:, :3]
        frame[blocks * LANES :, ROTATION : ROTATION + 9] = rotation_matrix(static[:, 3:]).reshape(
            -1, 9
        )
        return Crowd(
            constants=constants,
            solid=solid,
            group=found.group,
            present=found.present,
            body=found.body,
            place=found.place,
            joint=aligned_zeros(len(found.joint_row), JOINT_WORK),
            joint_factor=aligned_zeros((found.entries, LANES), np.dtype(float)),
            motor=np.zeros((groups * LANES, found.motor[:, 1].max(initial=-1) + 1, 2)),
            frame=frame,
            tensor=np.zeros((places, 8)),
            normals=np.zeros((places, NORMAL_SUMS)),
            margin=np.zeros((blocks, LANES)),
            motion=np.zeros((blocks, LANES)),
            wrench=np.zeros((0, 6)),
            incident_first=np.zeros(blocks * LANES + 1, np.int64),
            incident=np.zeros(0, np.int64),
            order=np.zeros(0, np.int64),
            colour_first=np.zeros(MOST_COLOURS + 2, np.int64),
            pair_kind=self.kinds.pair_kind,
            stirred=np.zeros(blocks * LANES, np.int64),
            joint_work=np.zeros(groups),
            kept=aligned_zeros((4 * int(self.kinds.features.finds_impacts), blocks), SOLID),
            path=np.zeros(3),
        )  # fmt: skip

    def _local_partners(self, rows: Array) -> Array:
        """Of each place the finger that is its partner, counted within the mechanism; -1: none."""
        local, first = np.full(len(rows), -1), self.mechanisms.group["first_block"]
        for p in np.flatnonzero(rows["gripper_partner"] >= 0):
            block = self.mechanisms.place[rows["gripper_partner"][p]] // LANES
            local[p] = block - first[np.searchsorted(first, block, side="right") - 1]
        return local

    def _run(self, h: float, substeps: int, worlds: Array) -> bool:
        """Advances the worlds of a mask; returns whether all went well."""
        self.last_substep, self._last_worlds = h, worlds
        self._table_valid = False
        well = True
        for w in np.flatnonzero(worlds):
            well = self._run_world(int(w), h, substeps) and well
        self._fresh = self._fresh or (well and bool(worlds.all()) and substeps > 0)
        return well

    def _run_world(self, w: int, h: float, substeps: int) -> bool:
        """Advances one world; returns whether it went well.

        If a call is interrupted, the world is as it was before it, and its contacts begin afresh.
        """
        if self.state.world["diverged"][w]:
            return False
        try:
            return self._run_substeps(w, h, substeps)
        except BaseException:
            self.forget(np.arange(self.count) == w)
            raise

    def _run_substeps(self, w: int, h: float, substeps: int) -> bool:
        status, lists, crowd = self.state.world[w : w + 1], self._lists[w], self._worlds[w][0]
        if self.state.wrench.size > 0:
            wrench = np.zeros((crowd.motion.size, 6))
            wrench[crowd.place] = self.state.wrench[w]
            crowd = crowd._replace(wrench=wrench)
        self._load(self.state.dynamic, w, crowd)
        row, column = self.mechanisms.motor.T
        crowd.motor[row, column] = self.state.motor[w]
        mark = int(status["needs_refresh"][0])
        status["overflow"] = 0
        progress = np.zeros(7, np.int64)
        progress[1], progress[6] = REFRESH if mark else STEP, mark
        crowd.stirred[...] = 0
        crowd.kept[GIVEN:] = np.zeros(1, SOLID)
        if mark == STARTS_ANEW:
            lists.clear()
            self._place(crowd)
            crowd = lists.search(crowd)
        finite = True
        while finite:
            self._call(crowd, lists, w, h, substeps, progress)
            if progress[2] == 0:
                break
            if progress[2] == 2:
                needed = int(progress[3])
                self._rows = aligned_zeros(needed + needed // 4, CONTACT_ROW)
                continue
            finite = bool(np.isfinite(crowd.frame[crowd.place]).all())
            if finite:
                crowd = lists.search(crowd)
        diverged = self._store(self.state.dynamic, w, crowd)
        if not finite and diverged == 0:
            diverged = 1 + int(np.argmin(np.isfinite(crowd.frame[crowd.place]).all(axis=1)))
        status["time"] += int(progress[0]) * h
        status["needs_refresh"] = 0
        status["diverged"] = diverged
        self._worlds[w][0] = crowd
        return diverged == 0 and not status["overflow"][0]

    def _place(self, crowd: Crowd) -> None:
        """Writes the frames of bodies at their present state."""
        if not self._idle:
            self._idle.append(self.working_memory())
        make_place_bodies(self.kinds.features)(self.kinds.model, self._idle[0], crowd)

    def place(self, world: int) -> None:
        """Brings the frames of a world's bodies to its present state, for queries."""
        crowd = self._worlds[world][0]
        self._load(self.state.dynamic, world, crowd)
        self._place(crowd)

    def _call(
        self, crowd: Crowd, lists: PairLists, w: int, h: float, substeps: int, progress: Array
    ) -> None:
        """Runs the kernel on as many threads as pay."""
        work = max(len(crowd.order), len(crowd.group))
        threads = self.threads if work >= _FEWEST_BATCHES else 1
        while len(self._idle) < threads:
            self._idle.append(self.working_memory())
        state = self.state._replace(world=self.state.world[w : w + 1])
        barrier = np.zeros(SHARED, np.int64)

        impulse = self.kinds.features.impulse
        shared = np.zeros((threads, SHARED))

        def run(thread: int, threads: int, substeps: int, progress: Array) -> Any:
            return self._advance(
                self.kinds.model, state, self._idle[thread], *([self._rows] if impulse else []),
                crowd, lists.pairs, h, substeps, self.fidelity.collision_substeps, progress,
                barrier, shared, thread, threads,
            )  # fmt: skip

        if not self._compiled:  # by one thread, without a step: the others can't wait for it
            run(0, 1, 0, np.zeros_like(progress))
            self._compiled = True
        run_together(lambda n: run(n, threads, substeps, progress), threads)

    @property
    def hidden_nbytes(self) -> int:
        """Bytes of bodies in blocks and of pairs."""
        return sum(
            array.nbytes for one, lists in zip(self._worlds, self._lists, strict=True)
            for array in (*one[0], *lists.pairs)
        )  # fmt: skip

    def saved(self) -> Any:
        """A copy of the pairs, how far bodies have moved since they were found, what they touch."""
        return [
            (one[0].motion.copy(), one[0].margin.copy(), one[0].normals.copy(), lists.saved())
            for one, lists in zip(self._worlds, self._lists, strict=True)
        ]

    def _compile_wrenches(self) -> None:
        """Adds the state of forces from the user, unless it is there; kernels need nothing new."""
        if self.state.wrench.size == 0:
            self.features = self.features._replace(wrench=True)
            rows = np.zeros((self.count, len(self.base.dynamic), 6))
            self.state = self.state._replace(wrench=rows)

    def restore(self, saved: Any) -> None:
        """Returns to what `saved` gave."""
        for one, lists, (motion, margin, normals, pairs) in zip(
            self._worlds, self._lists, saved, strict=True
        ):
            lists.restore(pairs)
            one[0] = lists.listed(one[0], margin)
            one[0].motion[...] = motion
            one[0].normals[...] = normals

    def arrays(self, world: int) -> tuple[Crowd, Pairs]:
        """The arrays of a world."""
        return self._worlds[world][0], self._lists[world].pairs

    def home(self, world: int, first: int, second: int) -> int:
        """Home of the pair of two places, -1 if they aren't near each other."""
        return self._lists[world].home(first, second)

    def working_memory(self) -> Workspace:
        """Of one thread, for any kind of pair."""
        kinds = self.kinds
        # joints have theirs in `Crowd`; a batch is of two solids
        model = kinds.model._replace(
            dynamic=kinds.model.dynamic[:2], joint_row=kinds.model.joint_row[:0]
        )
        whole = Workspace.of(model, self.features)
        parts = int(kinds.pair_kind["part_count"].max(initial=0))
        return whole._replace(
            solid=aligned_zeros(2 + parts, SOLID),
            start=aligned_zeros(self.mechanisms.most_blocks, START),
        )
