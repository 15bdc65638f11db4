"""The result of a training run: one small file, from which all tables are generated.

results/<algo>/<environment>_seed<seed>/
    result.json      the result, see Result
    config.yaml      the settings, readable by `rigid-envs train --config`
    progress.csv     the learning curve, with fewer rows
    policy.safetensors    the policy
"""

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from training.settings.environment_ids import plain_id
from training.settings.errors import UsageError, nearest
from training.settings.settings import (
    InvalidValue,
    choice,
    integer,
    mapping,
    number,
    optional,
    setting,
    text,
)
from training.settings.tasks import changed_arguments, task_name

RESULT = "result.json"


def _rate(value: Any) -> dict[str, float]:
    """A success rate with the bounds of its confidence interval."""
    names = ("low", "rate", "high")
    fraction = number(at_least=0, at_most=1)
    found: dict[str, float] = mapping(dict.fromkeys(names, fraction))(value)
    if set(found) != set(names) or not found["low"] <= found["rate"] <= found["high"]:
        raise InvalidValue("a mapping of low, rate and high, in ascending order")
    return found


def _original(value: Any) -> dict[str, Any]:
    """An evaluation of a twin's policy in its original."""
    rules = {
        "env_id": text,
        "episodes": integer(1),
        "first_seed": integer(0),
        "success_at_end": _rate,
        "versions": mapping(),
    }
    found: dict[str, Any] = mapping(rules)(value)
    if set(found) != set(rules):
        raise InvalidValue(f"a mapping of {', '.join(rules)}")
    return found


@dataclass(frozen=True, kw_only=True)
class Result:
    """The outcome of a training run, and what is needed to repeat it."""

    algorithm: str = setting(choice("ppo", "sac"))
    """Name of the algorithm."""
    env_id: str = setting(text)
    """Environment id, with its version."""
    arguments: dict[str, Any] = setting(mapping())
    """Arguments of the environment at the end of training and in the evaluation."""
    seed: int = setting(integer(0))
    """Seed of training."""
    steps: int = setting(integer(1))
    """Environment steps of training, summed over worlds."""
    seconds: float = setting(number(above=0))
    """Wall time of training, in seconds."""
    environment_time_fraction: float = setting(number(at_least=0, at_most=1))
    """Fraction of that time spent in the environments."""
    episodes: int = setting(integer(1))
    """Number of episodes of the evaluation."""
    first_seed: int = setting(integer(0))
    """Seed of the first of these episodes."""
    fidelity: str | None = setting(optional(text))
    """Fidelity preset of these episodes; None for the default of the environment."""
    success_at_end: dict[str, float] = setting(_rate)
    """Fraction of the episodes that ended in success: low, rate, high (95 % Wilson interval)."""
    success_at_any_time: dict[str, float] = setting(_rate)
    """Fraction of the episodes that reached the goal after any step, likewise."""
    command: str = setting(text)
    """Command that repeats the training, with the code of `commit`."""
    commit: str | None = setting(optional(text))
    """Git commit of the training code, if known."""
    resumed: int = setting(integer(0))
    """Number of times that the run was resumed."""
    started: str = setting(text)
    """Start of training, in UTC."""
    versions: dict[str, Any] = setting(mapping())
    """Versions of Python, platform and packages in training."""
    original: dict[str, Any] | None = setting(optional(_original), None)
    """Of a twin, the evaluation in its original: env_id, episodes, first_seed, success_at_end and
    versions, those of the packages there."""

    @property
    def task(self) -> str:
        """Name of the task, as part of a folder name, see `task_name`."""
        return task_name(self.env_id, self.arguments)

    @property
    def kind(self) -> str:
        """Algorithm and task; results of the same kind differ only in their seed."""
        return f"{self.algorithm}-{self.task}"

    @property
    def title(self) -> str:
        """Task and algorithm for readers, as RigidEnvs/Stack-v0 with blocks=3, PPO.

        A value is shown if it is a number or a text.
        """
        changed = []
        for name in changed_arguments(self.env_id, self.arguments):
            value = self.arguments[name]
            shown = isinstance(value, (int, float, str)) and value is not True
            changed.append(f"{name}={value}" if shown else name)
        task = " with ".join([plain_id(self.env_id), *([", ".join(changed)] if changed else [])])
        return f"{task}, {self.algorithm.upper()}"

    def folder(self, repository: Path) -> Path:
        """The folder of the result in the repository."""
        return repository / "results" / self.algorithm / f"{self.task}_seed{self.seed}"

    def as_json(self) -> str:
        """The text of a file that `read_result` reads back to an equal result."""
        values = dataclasses.asdict(self)
        if self.original is None:
            del values["original"]
        return json.dumps(values, indent=2) + "\n"


def read_result(file: Path) -> Result:
    """Reads and validates a result.

    Raises:
        UsageError: The file is missing or not JSON, or a field is missing, unknown or invalid.
    """
    try:
        values = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(f"{file} cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{file} is not JSON: {error}") from None
    return parse_result(values, str(file))


def parse_result(values: Any, source: str) -> Result:
    """Validates the fields of a result and builds it.

    Args:
        values: Fields by name, as JSON parsed them.
        source: File, named in error messages.

    Raises:
        UsageError: As for `read_result`.
    """
    if not isinstance(values, dict):
        raise UsageError(f"{source} is {values!r:.80}, should be a mapping")
    fields = {field.name: field for field in dataclasses.fields(Result)}
    for key in values:
        if key not in fields:
            raise UsageError(
                f"{source}: unknown field {key!r}; did you mean {nearest(key, fields)!r}?"
            )
    found: dict[str, Any] = {}
    for name, field in fields.items():
        if name not in values:
            if field.default is not dataclasses.MISSING:
                continue
            raise UsageError(f"{source}: {name} is missing")
        try:
            found[name] = field.metadata["rule"](values[name])
        except InvalidValue as error:
            raise UsageError(
                f"{source}: {name} is {values[name]!r:.80}, should be {error}"
            ) from None
    return Result(**found)


def read_results(repository: Path) -> list[Result]:
    """All results of a repository, in the order of kind and seed.

    Raises:
        UsageError: A result is damaged, or is in a folder that contradicts its content.
    """
    results = []
    for file in (repository / "results").glob(f"*/*/{RESULT}"):
        if file.parent.suffix == ".tmp":  # left by a killed process
            continue
        result = read_result(file)
        if result.folder(repository) != file.parent:
            raise UsageError(f"{file} should be in {result.folder(repository)}")
        results.append(result)
    return sorted(results, key=lambda result: (result.kind, result.seed))
