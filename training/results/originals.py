"""Evaluates policies of twins in their originals: other suites' environments, in other processes.

The originals need older versions of packages than this project, so they run in child processes of
an interpreter that has them, see `original_worker`. The policy stays here: observations come,
actions go.
"""

import base64
import json
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import chain, pairwise
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from rigid_envs.twins import TWINS
from training.policies.policy import Policy
from training.results.evaluate import Evaluation
from training.settings.environments import task_of
from training.settings.errors import UsageError, nearest
from training.settings.seed_ranges import EVALUATION

Array = np.ndarray

WORKER = Path(__file__).with_name("original_worker.py")
INTERPRETER = Path(".venv/twins/bin/python")
"""What `make twins` creates, in the working directory."""
INSTALL = {
    "Fetch": 'gymnasium-robotics==1.4.2 "mujoco==3.2.7"',
    "Panda": "panda-gym==3.0.7",
}
"""What an interpreter needs, by the first word of the ids."""
PROCESSES, WORLDS = 2, 20
"""Of an evaluation, and of each process."""
GOAL_KEYS = ("observation", "achieved_goal", "desired_goal")


def evaluate_original(
    policy: Policy,
    env_id: str,
    episodes: int = 1000,
    *,
    seed: int = EVALUATION,
    python: Path | None = None,
) -> tuple[Policy, Evaluation, dict[str, str]]:
    """Plays episodes of a twin's policy in its original, with the seeds seed, seed + 1, ...

    Args:
        policy: A policy of the twin of `env_id`.
        env_id: Id of the original.
        episodes: Number of episodes.
        seed: Seed of the first one.
        python: See `Originals`.

    Returns:
        The policy, for `env_id`, the outcome, and the versions of the packages there.

    Raises:
        UsageError: The policy is none of the twin of `env_id`, or the original can't run.
    """
    if episodes < 1:
        raise UsageError(f"number of episodes is {episodes}, should be at least 1")
    check_twin(policy, env_id)
    worlds, start = min(episodes, WORLDS * PROCESSES), time.perf_counter()
    rounds = []
    with Originals(env_id, worlds, python=python, processes=min(PROCESSES, worlds)) as envs:
        for first in range(0, episodes, worlds):
            rounds.append(_play(envs, policy, range(seed + first, seed + first + worlds)))
    at_end, at_any_time, returns, length = (
        np.concatenate(parts)[:episodes] for parts in zip(*rounds, strict=True)
    )
    seconds = time.perf_counter() - start
    result = Evaluation(at_end, at_any_time, returns, length, seconds, seed, None, {})
    return replace(policy, env_id=env_id), result, envs.description["versions"]


def check_twin(policy: Policy, env_id: str) -> None:
    """Raises UsageError if a policy is none of the twin of `env_id`."""
    originals = {_name(twin.original): f"RigidEnvs/{twin.__name__}-v0" for twin in TWINS.values()}
    if _name(env_id) not in originals:
        names = sorted(twin.original for twin in TWINS.values())
        raise UsageError(
            f"--in is {env_id!r}, which has no twin here; did you mean {nearest(env_id, names)!r}? "
            f"There are twins of {', '.join(names)}"
        )
    task = TWINS.get(task_of(policy.env_id) or "")
    if task is None or _name(task.original) != _name(env_id):
        raise UsageError(
            f"the policy was trained on {policy.env_id}; only one of {originals[_name(env_id)]} "
            f"acts in {env_id}"
        )


def _name(env_id: str) -> str:
    """An id without its version, and without the word for a dense reward."""
    return re.sub(r"(Dense)?(-v\d+)?$", "", env_id)


def _play(envs: "Originals", policy: Policy, seeds: range) -> tuple[Array, ...]:
    """Success at the end and at any time, return and length of one episode in each world."""
    count = len(seeds)
    at_end, at_any_time, playing = np.zeros((3, count), dtype=bool)
    playing[:] = True
    returns, length = np.zeros(count), np.zeros(count, dtype=int)
    now = envs.reset(seeds)
    while playing.any():
        actions = np.clip(policy.act({key: now[key] for key in GOAL_KEYS}), -1.0, 1.0)
        now = envs.step(actions)
        success, ended = now["is_success"], playing & (now["terminated"] | now["truncated"])
        returns[playing] += now["reward"][playing]
        length[playing] += 1
        at_any_time |= playing & success
        at_end |= ended & success
        playing &= ~ended
    return at_end, at_any_time, returns, length


class Originals:
    """An environment of another suite in several worlds, divided among processes.

    Args:
        env_id: Its id there, as FetchPush-v4.
        worlds: Number of worlds.
        python: Interpreter that has the suite; `.venv/twins/bin/python` if that exists, otherwise
            the running one.
        processes: Among which the worlds are divided.
        render: Whether frames are asked for.

    Attributes:
        description: Spaces, length of episodes and versions, from the worker.

    Raises:
        UsageError: There is no such interpreter, or it lacks the suite, or the suite fails.
    """

    def __init__(
        self,
        env_id: str,
        worlds: int,
        *,
        python: Path | None = None,
        processes: int = 1,
        render: bool = False,
    ):
        self.python = find_interpreter(python)
        self.env_id, self.worlds = env_id, worlds
        self._shares = [len(part) for part in np.array_split(np.arange(worlds), processes)]
        self._workers: list[subprocess.Popen[str]] = []
        self._errors = tempfile.TemporaryFile("w+")  # noqa: SIM115  (closed by `close`)
        mode = "rgb_array" if render else None
        try:
            for _ in self._shares:
                self._workers.append(self._start())
            self.description = self._ask(
                [{"make": env_id, "worlds": n, "render_mode": mode} for n in self._shares]
            )[0]
        except BaseException:
            self.close()
            raise

    def _start(self) -> "subprocess.Popen[str]":
        """A new worker."""
        try:
            return subprocess.Popen(
                [str(self.python.absolute()), str(WORKER)], stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, stderr=self._errors, text=True,
            )  # fmt: skip
        except OSError as error:
            raise UsageError(f"{self.python} can't run: {error.strerror}") from None

    def reset(self, seeds: Sequence[int]) -> dict[str, Array]:
        """Starts an episode in each world, with its seed; returns observations (worlds, ...)."""
        return self._join(self._ask([{"reset": part} for part in self._split(list(seeds))]))

    def step(self, actions: Array) -> dict[str, Array]:
        """Observations by key, and reward, terminated, truncated and is_success, of each world."""
        return self._join(self._ask([{"step": part} for part in self._split(actions.tolist())]))

    def frame(self) -> Array:
        """A frame (height, width, 3) uint8 of the first world."""
        reply = self._exchange(self._workers[:1], [{"render": 0}])[0]
        pixels = np.frombuffer(base64.b64decode(reply["pixels"]), dtype=np.uint8)
        return pixels.reshape(reply["shape"])

    def close(self) -> None:
        """Ends the processes."""
        for worker in self._workers:
            worker.kill()
            worker.wait()
            for stream in (worker.stdin, worker.stdout):
                if stream is not None:
                    with suppress(BrokenPipeError):  # of what an ended worker didn't read
                        stream.close()
        self._errors.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        self.close()

    def _split(self, rows: list[Any]) -> list[list[Any]]:
        ends = np.cumsum([0, *self._shares])
        return [rows[a:b] for a, b in pairwise(ends)]

    def _ask(self, requests: list[dict[str, Any]]) -> list[dict[str, Any]]:
        return self._exchange(self._workers, requests)

    def _exchange(
        self, workers: list["subprocess.Popen[str]"], requests: list[dict[str, Any]]
    ) -> list[dict[str, Any]]:
        """Sends each worker its request, then reads all replies."""
        try:
            for worker, request in zip(workers, requests, strict=True):
                assert worker.stdin is not None
                worker.stdin.write(json.dumps(request) + "\n")
                worker.stdin.flush()
            lines = []
            for worker in workers:
                assert worker.stdout is not None
                lines.append(worker.stdout.readline())
        except BrokenPipeError:
            lines = [""]
        if not all(lines):
            last = self._last_error()
            raise UsageError(
                self._explain(last) if last else f"{self.python} ended while it ran {self.env_id}"
            )
        try:
            replies: list[dict[str, Any]] = [json.loads(line) for line in lines]
        except json.JSONDecodeError:
            raise UsageError(
                f"{self.python} is no Python interpreter: it said {lines[0]!r}"
            ) from None
        for reply in replies:
            if "error" in reply:
                raise UsageError(self._explain(reply["error"]))
        return replies

    def _last_error(self) -> str:
        """The last line that workers wrote to stderr."""
        self._errors.seek(0)
        lines = [line.strip() for line in self._errors if line.strip()]
        return lines[-1] if lines else ""

    def _explain(self, error: str) -> str:
        """What went wrong in a worker, with the command that mends it."""
        family = next(word for word in INSTALL if self.env_id.startswith(word))
        missing = "No module named" in error
        install = f"{self.python} -m pip install {INSTALL[family]}"
        if missing or (family == "Fetch" and "AssertionError" in error):
            why = "lacks it" if missing else "has a mujoco that Gymnasium-Robotics 1.4.2 can't use"
            return f"{self.env_id} can't run: {self.python} {why}; run `make twins`, or `{install}`"
        return f"{self.env_id} failed in {self.python}: {error}"

    @staticmethod
    def _join(replies: list[dict[str, Any]]) -> dict[str, Array]:
        return {key: np.array([*chain(*(one[key] for one in replies))]) for key in replies[0]}


def find_interpreter(python: Path | None) -> Path:
    """The interpreter to use, see `Originals`.

    Raises:
        UsageError: It does not exist.
    """
    if python is None:
        return INTERPRETER if INTERPRETER.exists() else Path(sys.executable)
    if not python.is_file():
        raise UsageError(f"--python is {str(python)!r}, which is no file; `make twins` makes one")
    return python
