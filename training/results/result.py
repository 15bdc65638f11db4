"""What a recorded run says of itself: one small file, from which all tables are made.

results/<algo>/<environment>_seed<seed>/
result.json      this, see Result
config.yaml      the settings, readable by `rigid-envs train --config`
progress.csv     the learning curve, thinned
policy.policy    what acts
"""

import dataclasses
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym

import rigid_envs  # noqa: F401  (registers the ids)
from training.runs.run_folder import folder_name
from training.settings.errors import UsageError, nearest
from training.settings.settings import Unfit, choice, integer, mapping, number, optional, setting

RESULT = "result.json"
USUAL = ("reward_type", "fidelity", "guided")
"""Arguments of the environment that don't make it another task."""


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value:
        raise Unfit("text")
    return value


def _share(value: Any) -> dict[str, float]:
    """A share of episodes: how many, with the bounds of its interval."""
    names = ("low", "rate", "high")
    share = number(at_least=0, at_most=1)
    found: dict[str, float] = mapping(dict.fromkeys(names, share))(value)
    if set(found) != set(names) or not found["low"] <= found["rate"] <= found["high"]:
        raise Unfit("a mapping of low, rate and high, in rising order")
    return found


@dataclass(frozen=True, kw_only=True)
class Result:
    """How a run went, and what it takes to do it again."""

    algorithm: str = setting(choice("ppo", "sac"))
    """Name of the algorithm."""
    env_id: str = setting(_text)
    """Environment id, with its version."""
    arguments: dict[str, Any] = setting(mapping())
    """Arguments of the environment."""
    seed: int = setting(integer(0))
    """Seed of training."""
    steps: int = setting(integer(1))
    """Environment steps of training, summed over worlds."""
    seconds: float = setting(number(above=0))
    """Wall time of training, in seconds."""
    environment_share: float = setting(number(at_least=0, at_most=1))
    """Share of that time spent in the environments."""
    episodes: int = setting(integer(1))
    """How many the policy was evaluated on."""
    first_seed: int = setting(integer(0))
    """Seed of the first of them."""
    fidelity: str | None = setting(optional(_text))
    """Preset at which they were played; None for the environment's own."""
    success_at_end: dict[str, float] = setting(_share)
    """Share of episodes that ended in success, as low, rate, high; the interval is Wilson's."""
    success_at_any_time: dict[str, float] = setting(_share)
    """Share of episodes that met the goal after some step, likewise."""
    command: str = setting(_text)
    """What trains it again, with the source of `commit`."""
    commit: str | None = setting(optional(_text))
    """Git commit of the source that trained it, if known."""
    resumed: int = setting(integer(0))
    """How often the run was resumed."""
    started: str = setting(_text)
    """When training began, in UTC."""
    versions: dict[str, Any] = setting(mapping())
    """Python, platform and packages that trained it."""

    @property
    def task(self) -> str:
        """The environment and what makes it another task, as part of the name of a folder."""
        return task_name(self.env_id, self.arguments)

    @property
    def kind(self) -> str:
        """Algorithm and task: results of the same kind differ by their seed."""
        return f"{self.algorithm}-{self.task}"

    def folder(self, repository: Path) -> Path:
        """Where it is kept."""
        return repository / "results" / self.algorithm / f"{self.task}_seed{self.seed}"

    def as_json(self) -> str:
        """A file that `read_result` reads back to an equal result."""
        return json.dumps(dataclasses.asdict(self), indent=2) + "\n"


def task_name(env_id: str, arguments: dict[str, Any]) -> str:
    """An environment and its arguments as a name, as in RigidEnvs-Push-v0-target_yaw-true.

    Args:
        env_id: Environment id.
        arguments: Its arguments; those of USUAL are left away, and what asks for nothing: what is
            false or 0, and the steps that an episode has anyway.
    """
    words = [folder_name(env_id)]
    spec = gym.registry.get(env_id)
    asked = {name for name, value in arguments.items() if value}
    if spec is not None and arguments.get("max_episode_steps") == spec.max_episode_steps:
        asked.discard("max_episode_steps")
    for name in sorted(asked - set(USUAL)):
        value = re.sub(r"[^A-Za-z0-9.]+", "-", json.dumps(arguments[name], default=str))
        words.append(f"{name}-{value.strip('-')}")
    return "-".join(words)


def read_result(file: Path) -> Result:
    """Reads and checks a result.

    Raises:
        UsageError: It is missing or no JSON, or a field is missing, unknown or can't be.
    """
    try:
        values = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(f"{file} cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{file} is not JSON: {error}") from None
    return parse_result(values, str(file))


def parse_result(values: Any, source: str) -> Result:
    """Checks the fields of a result and builds it.

    Args:
        values: Fields by name, as JSON gave them.
        source: File to name in errors.

    Raises:
        UsageError: As of `read_result`.
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
            raise UsageError(f"{source}: {name} is missing")
        try:
            found[name] = field.metadata["rule"](values[name])
        except Unfit as error:
            raise UsageError(
                f"{source}: {name} is {values[name]!r:.80}, should be {error}"
            ) from None
    return Result(**found)


def read_results(repository: Path) -> list[Result]:
    """All results of a repository, by kind and seed.

    Raises:
        UsageError: One is damaged, or lies in another folder than its own.
    """
    results = []
    for file in (repository / "results").glob(f"*/*/{RESULT}"):
        if file.parent.suffix == ".tmp":  # of a process that was killed as it wrote
            continue
        result = read_result(file)
        if result.folder(repository) != file.parent:
            raise UsageError(f"{file} should lie in {result.folder(repository)}")
        results.append(result)
    return sorted(results, key=lambda result: (result.kind, result.seed))
