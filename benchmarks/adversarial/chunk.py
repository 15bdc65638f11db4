"""A part of a combination of task, preset, actions and parameters: runs it and counts."""

import zlib
from collections import deque
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from benchmarks.adversarial.actions import ACTIONS
from benchmarks.adversarial.balance import Balance
from benchmarks.adversarial.checks import (
    below_ground,
    differences,
    gained,
    not_finite,
    out_of_world,
    sunk,
    values_of,
)
from benchmarks.adversarial.failures import Failure
from benchmarks.adversarial.measured_runner import MeasuredRunner
from benchmarks.report.provenance import THREADS
from physics import SimulationDiverged

Array = np.ndarray

ALONE = 96  # worlds that are advanced a second time
LOOK = 150  # steps between two measurements of penetration
SAVED = 3  # failures of each kind that are saved
KINDS = ("not_finite", "sank", "escaped", "gained", "different")


class Combination(NamedTuple):
    """What is run.

    Attributes:
        task: name of the task.
        preset: name of the fidelity.
        actions: name of the actions.
        parameters: "scene" or "random".
    """

    task: str
    preset: str
    actions: str
    parameters: str


class Figures(NamedTuple):
    """What a chunk has found; `report` adds up those of a combination.

    Attributes:
        steps: environment steps.
        episodes: episodes that began.
        not_finite: episodes that diverged or returned a number that is not finite.
        sank: episodes in which the centre of a body was below the ground.
        escaped: episodes in which all of a body was, after two steps in a row. The ground pushes
            out what a hand has rammed below its surface; what stays there has escaped.
        gained: episodes in which a world gained energy.
        different: steps in which all worlds and a few by themselves were not bitwise equal.
        lowest: m, the lowest centre of a body.
        deepest: m, the deepest penetration.
        fastest: m/s.
        gain: J, the largest energy beyond the servos' work.
        gain_ratio: the largest of it over what is allowed.
        seconds: s.
    """

    steps: float
    episodes: float
    not_finite: float
    sank: float
    escaped: float
    gained: float
    different: float
    lowest: float
    deepest: float
    fastest: float
    gain: float
    gain_ratio: float
    seconds: float


class Run:
    """A chunk while it runs.

    Args:
        combination: what is run.
        number: of the chunk; it decides all seeds.
        worlds: their number.
        compares: advance the first of them a second time, by themselves.
    """

    def __init__(
        self, combination: Combination, number: int, worlds: int, compares: bool = False
    ) -> None:
        """Starts the first episode of every world."""
        self.combination, self.number = combination, number
        task, preset, actions, parameters = combination
        self.runner = MeasuredRunner(task, preset, parameters, worlds, THREADS)
        few = min(ALONE, worlds) if compares else 0
        self.few = MeasuredRunner(task, preset, parameters, few, 1) if few else None
        seeds = number * worlds + np.arange(worlds)
        for runner in self._runners:
            runner.reset(np.ones(runner.count, dtype=bool), seeds[: runner.count])
        draw = np.random.default_rng([number, zlib.crc32("/".join(combination).encode())])
        self._next_commands = ACTIONS[actions](self.runner, draw)
        self._balance = Balance(self.runner.world)
        self._ended = np.zeros(worlds, dtype=bool)
        self._under = np.zeros(worlds, dtype=bool)  # all of a body was below the ground
        # kind of failure that the episode of each world has already counted
        self._counted = {name: np.zeros(worlds, dtype=bool) for name in KINDS[1:4]}
        steps = self.runner.max_episode_steps or self.runner.task.max_episode_steps
        self._actions: deque[Array] = deque(maxlen=steps)
        self._counts = dict.fromkeys(KINDS, 0)
        self._saved = dict(self._counts)
        self._episodes, self._steps, self._spent = worlds, 0, 0.0
        self._lowest, self._deepest, self._fastest = np.inf, 0.0, 0.0
        self._gain, self._gain_ratio = 0.0, 0.0

    @property
    def _runners(self) -> list[MeasuredRunner]:
        return [self.runner] if self.few is None else [self.runner, self.few]

    def advance(self, steps: int) -> Figures:
        """Takes steps of all worlds and returns what has been found so far."""
        start = perf_counter()
        for _ in range(steps):
            self._step()
        self._spent += perf_counter() - start
        return Figures(
            steps=float(self._steps * self.runner.count), episodes=float(self._episodes),
            **{name: float(count) for name, count in self._counts.items()},
            lowest=self._lowest, deepest=self._deepest, fastest=self._fastest,
            gain=self._gain, gain_ratio=self._gain_ratio, seconds=self._spent,
        )  # fmt: skip

    def _step(self) -> None:
        commands = self._next_commands()
        began = self._ended | commands.resets
        self._actions.append(commands.actions)
        results: list[Any] = []
        for runner in self._runners:
            try:
                results.append(runner.step(commands.actions[: runner.count], began[: runner.count]))
            except SimulationDiverged as error:
                if runner is self.runner:
                    self._note("not_finite", dict.fromkeys(error.worlds, str(error)))
                results.append(None)
        if any(result is None for result in results):
            # the other worlds haven't completed their step either: all are reset
            for runner in self._runners:
                runner.reset(np.ones(runner.count, dtype=bool))
            began[:] = True
            results[0] = None
        self._steps += 1
        self._episodes += int(began.sum())
        self._ended = np.zeros(self.runner.count, dtype=bool)
        whole = results[0]
        if whole is not None:
            self._ended = whole.terminated | whole.truncated
            values = values_of(whole.observation, whole.reward)
            self._note("not_finite", not_finite(values))
            if self.few is not None and results[1] is not None:
                other = results[1]
                what = differences(values, values_of(other.observation, other.reward))
                self._note("different", {0: what} if what else {})
        self._check_world(began)

    def _check_world(self, began: Array) -> None:
        world = self.runner.world
        for counted in self._counted.values():
            counted &= ~began
        below, before = below_ground(world), self._under & ~began
        self._under = below & out_of_world(world) if below.any() else below
        if below.any():
            for kind, mask in (("sank", below), ("escaped", self._under & before)):
                new = mask & ~self._counted[kind]
                self._counted[kind] |= new
                self._note(kind, sunk(world, new))
        balance = self._balance
        balance.update(world, began)
        ratio = balance.gain / balance.allowed
        gains = (ratio > 1.0) & ~self._counted["gained"]
        if gains.any():
            self._counted["gained"] |= gains
            self._note("gained", gained(balance, gains))
        self._gain = max(self._gain, float(balance.gain.max()))
        self._gain_ratio = max(self._gain_ratio, float(ratio.max()))
        self._lowest = min(self._lowest, float(world.position[..., 2].min()))
        self._fastest = max(self._fastest, float(np.abs(world.linear_velocity).max()))
        if self._steps % LOOK == LOOK // 3:
            self._deepest = max(self._deepest, float(world.penetration().max()))

    def _note(self, kind: str, found: dict[int, str]) -> None:
        """Counts failures by world, and saves the first of them."""
        self._counts[kind] += len(found)
        task, preset, _, parameters = self.combination
        for world, what in found.items():
            if self._saved[kind] >= SAVED:
                return
            self._saved[kind] += 1
            steps = int(self.runner.elapsed[world])
            own = [row[world] for row in list(self._actions)[len(self._actions) - steps :]]
            names = (task, preset, parameters)
            failure = Failure.of(self.runner, names, what, world, np.array(own))
            name = "_".join((*self.combination, str(self.number), kind, str(self._saved[kind])))
            failure.save(name)


def run_chunk(
    combination: Combination, number: int, worlds: int, steps: int, compares: bool
) -> Figures:
    """Runs a chunk of `steps` steps of all worlds."""
    return Run(combination, number, worlds, compares).advance(steps)
