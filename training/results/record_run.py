"""Records the result of a finished run: evaluates its policy and copies the small files."""

import csv
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from rigid_envs.twins import TWINS
from training.policies.export import export_run
from training.policies.policy import Policy
from training.policies.policy_header import Success
from training.policies.trained_policy import trained_policy
from training.results.evaluate import evaluate, wilson_interval
from training.results.originals import evaluate_original
from training.results.plot import read_learning_curve
from training.results.result import RESULT, Result, parse_result, read_results
from training.runs.run_folder import RunFolder
from training.sb3.model_state import read_state
from training.settings.algorithms import SACConfig
from training.settings.config import TrainConfig
from training.settings.config_file import load_config
from training.settings.environments import task_of
from training.settings.errors import UsageError
from training.settings.seed_ranges import EVALUATION, ORIGINAL
from training.settings.tasks import task_name

MAX_FILE_BYTES = 300_000
"""Largest policy or image, because a git repository stores every version of it."""
ROWS = 200
"""Largest number of rows of a learning curve: more than a plot can resolve."""
COLUMNS = ("rollout/", "time/", "eval/")
"""Prefixes of the columns of a learning curve that are copied."""


def record_run(
    folder: RunFolder,
    repository: Path,
    episodes: int = 1000,
    *,
    replace: bool = False,
    quiet: bool = False,
) -> Result:
    """Evaluates the policy of a finished run and writes its result atomically.

    That of a twin is evaluated in its original, too.

    Args:
        folder: The run.
        repository: Folder that contains the folder of results.
        episodes: Number of episodes of the evaluation.
        replace: Whether to replace a result of the same kind and seed.
        quiet: Show no progress.

    Raises:
        UsageError: The run is not finished or damaged, it or another run with its seed is recorded
            already, its policy is too large, the files cannot be written, or a twin's original
            can't run.
    """
    config = folder.config()
    state, run, versions = _finished(folder), *_descriptions(folder)
    if run.get("seed") != config.seed:
        raise UsageError(
            f"run.json is damaged: seed is {run.get('seed')!r}, but config.yaml has {config.seed}"
        )
    _check_place(folder, config, run, repository, replace)
    read_learning_curve(folder)
    if folder.policy.exists() and folder.policy.stat().st_size > MAX_FILE_BYTES:
        size = folder.policy.stat().st_size
        raise UsageError(f"its policy has {size:,} bytes, should have at most {MAX_FILE_BYTES:,}")
    policy = trained_policy(folder.path)
    outcome = evaluate(policy, episodes, seed=EVALUATION, quiet=quiet)
    seconds, resumed = float(state["seconds"]), run.get("resumed", [])
    original = _in_original(policy, episodes)
    values = {
        "algorithm": config.algo,
        "env_id": config.env_id,
        "arguments": config.final_env_kwargs,
        "seed": config.seed,
        "steps": state.get("steps"),
        "seconds": round(seconds, 3),
        "environment_time_fraction": round(float(state["seconds_in_envs"]) / seconds, 4),
        "episodes": episodes,
        "first_seed": EVALUATION,
        "fidelity": config.final_env_kwargs.get("fidelity"),
        "success_at_end": _rate(outcome.success_at_end),
        "success_at_any_time": _rate(outcome.success_at_any_time),
        "command": _command(config) + _threads(run),
        "commit": run.get("git_commit"),
        "resumed": len(resumed) if isinstance(resumed, list) else resumed,
        "started": run.get("started"),
        "versions": versions,
        "original": original,
    }
    result = parse_result(values, str(folder.path))
    try:
        _write(result, folder, config, repository)
    except OSError as error:
        raise UsageError(f"{result.folder(repository)} cannot be written: {error}") from None
    return result


def _in_original(policy: Policy, episodes: int) -> dict[str, Any] | None:
    """The evaluation of a twin's policy in its original, see `Result.original`; None of others."""
    twin = TWINS.get(task_of(policy.env_id) or "")
    if twin is None:
        return None
    there, outcome, versions = evaluate_original(policy, twin.original, episodes, seed=ORIGINAL)
    return {
        "env_id": there.env_id,
        "episodes": episodes,
        "first_seed": ORIGINAL,
        "success_at_end": _rate(outcome.success_at_end),
        "versions": versions,
    }


def _finished(folder: RunFolder) -> dict[str, Any]:
    """The last checkpoint's state of a finished run."""
    if not folder.checkpoints():
        raise UsageError("the run has no checkpoint yet")
    try:
        state = read_state(folder.checkpoint)
        finished, in_envs = state["finished"], state.get("seconds_in_envs")
        if in_envs is not None and not 0 <= float(in_envs) <= float(state["seconds"]) > 0:
            raise ValueError(f"seconds_in_envs is {in_envs} of {state['seconds']}")
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise UsageError(f"{folder.checkpoint.name}/state.json is damaged: {error}") from None
    if finished is not True:
        raise UsageError(
            f"the run is not finished; to finish it: rigid-envs train --resume {folder.path}"
        )
    if in_envs is None:
        raise UsageError("the run did not record the time spent in the environments; train again")
    return dict(state)


def _descriptions(folder: RunFolder) -> tuple[dict[str, Any], dict[str, Any]]:
    """Content of run.json and versions.json."""
    found = []
    for name in ("run.json", "versions.json"):
        try:
            found.append(json.loads((folder.path / name).read_text(encoding="utf-8")))
        except (OSError, ValueError) as error:
            raise UsageError(f"{name} is damaged: {error}") from None
        if not isinstance(found[-1], dict):
            raise UsageError(f"{name} is damaged: it should be a mapping")
    return found[0], found[1]


def _check_place(
    folder: RunFolder, config: TrainConfig, run: dict[str, Any], repository: Path, replace: bool
) -> None:
    """Raises UsageError if the result would replace another one, or does not fit its table."""
    task = task_name(config.env_id, config.final_env_kwargs)
    for other in read_results(repository):
        if (other.algorithm, other.task) != (config.algo, task):
            continue
        place = other.folder(repository).relative_to(repository)
        again = other.seed == config.seed
        if again and replace:
            continue
        same = again and other.started == run.get("started")
        if same and other.arguments == config.final_env_kwargs:
            raise UsageError(f"the run is recorded already, in {place}")
        settings = load_config(
            other.algorithm, other.env_id, other.folder(repository) / "config.yaml"
        )
        for name, value in settings.replace(seed=config.seed).as_mapping().items():
            if (own := config.as_mapping()[name]) != value:
                raise UsageError(
                    f"its {name} is {own}, but {place}, in the same table, has {value}; runs in a "
                    "table should differ only in their seed; to start the table again, delete its "
                    "folders in results/"
                )
        if again:
            raise UsageError(
                f"{place} is another run with the same seed; to replace it: "
                f"rigid-envs results --replace {folder.path}"
            )


def _rate(outcome: np.ndarray) -> dict[str, float]:
    low, high = wilson_interval(int(outcome.sum()), len(outcome))
    rate = float(outcome.mean())
    # at 0 and 100 %, rounding can put the rate outside the interval
    return {"low": min(low, rate), "rate": rate, "high": max(high, rate)}


def _command(config: TrainConfig) -> str:
    """The shortest command that repeats the training, in the repository's folder."""
    words = f"rigid-envs train --algo {config.algo} --env {config.env_id}"
    given: dict[str, Any] = {"seed": config.seed}
    if isinstance(config, SACConfig) and config.demonstrations is not None:
        given["demonstrations"] = config.demonstrations
        words += f" --demonstrations {config.demonstrations}"
    try:
        packaged = load_config(config.algo, config.env_id)
        if packaged.replace(**given) == config:
            return f"{words} --seed {config.seed}"
        if packaged.replace(**given).with_steps(config.n_timesteps) == config:
            return f"{words} --seed {config.seed} -n {config.n_timesteps}"
    except UsageError:  # there are no packaged settings for it
        pass
    task = task_name(config.env_id, config.final_env_kwargs)
    return f"{words} --config results/{config.algo}/{task}_seed{config.seed}/config.yaml"


def _threads(run: dict[str, Any]) -> str:
    """The option --num-threads of a run: rounding, and so the policy, depends on it."""
    command = run.get("command")
    words = [str(word) for word in command] if isinstance(command, list) else []
    for word, following in zip(words, [*words[1:], ""], strict=True):
        name, _, value = word.partition("=")
        if name == "--num-threads":
            return f" --num-threads {value or following}"
    return ""


def _write(result: Result, folder: RunFolder, config: TrainConfig, repository: Path) -> None:
    place = result.folder(repository)
    unfinished = place.with_name(place.name + ".tmp")
    shutil.rmtree(unfinished, ignore_errors=True)
    unfinished.mkdir(parents=True)
    try:
        rate = result.success_at_end["rate"]
        success = Success(result.episodes, rate, result.fidelity, result.first_seed)
        export_run(folder, unfinished / "policy.safetensors", success=success)
        (unfinished / "config.yaml").write_text(config.as_yaml(), encoding="utf-8")
        _thin(folder.progress, unfinished / "progress.csv")
        (unfinished / RESULT).write_text(result.as_json(), encoding="utf-8")
        shutil.rmtree(place, ignore_errors=True)
        unfinished.rename(place)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def _thin(source: Path, target: Path) -> None:
    """Copies a learning curve with ROWS rows, including the first and the last, and evaluations."""
    with source.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    columns = [name for name in rows[0] if name.startswith(COLUMNS)]
    evenly = np.linspace(0, len(rows) - 1, min(ROWS, len(rows))).round().astype(int)
    evaluated = [n for n, row in enumerate(rows) if row.get("eval/success_rate")]
    kept = sorted({*evenly.tolist(), *evaluated})
    with target.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows[index] for index in kept)
