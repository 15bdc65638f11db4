"""Converts parsed options to settings, arguments of the environment, policies and runs.

Like the command line, this module imports neither Stable-Baselines3 nor torch.
"""

import argparse
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from training.commands.shared_flags import DEFAULT_ALGO, DEFAULT_ENV
from training.settings.errors import UsageError

if TYPE_CHECKING:
    from training.policies.policy import Policy
    from training.runs.run_folder import RunFolder
    from training.settings.config import TrainConfig

# names that --env-kwargs must not contain, because the commands set them, and the alternative
RESERVED = {
    "seed": "use --seed",
    "episodes": "use -n",
    "num_envs": "use --n-envs of train or --num-worlds of view",
    "env_id": "use --env, or for play the first argument",
    "render_mode": "the command sets it",
    "autoreset_mode": "the command sets it",
    "vectorization_mode": "the command sets it",
}


def config_of(options: argparse.Namespace) -> "TrainConfig":
    """The settings of the file, with those of the flags in their place."""
    from training.settings.config_file import load_config

    config = load_config(options.algo or DEFAULT_ALGO, options.env or DEFAULT_ENV, options.config)
    return _with_flags(config, options)


def _with_flags(config: "TrainConfig", options: argparse.Namespace) -> "TrainConfig":
    """The settings, with those of the flags in their place."""
    from training.settings.config_file import parse_settings

    changes = parse_settings(options.hyperparams, "--hyperparams")
    own_stage = "finetune_timesteps" in changes
    for name in ("n_timesteps", "n_envs", "seed"):
        if getattr(options, name) is not None:
            changes[name] = getattr(options, name)
    if options.demonstrations is not None:
        if config.algo != "sac":
            raise UsageError(
                f"--demonstrations is {options.demonstrations!r}, but {config.algo} learns from "
                "its own steps only: add --algo sac"
            )
        changes["demonstrations"] = options.demonstrations
    for name, value in env_kwargs_of(options).items():
        # what is given holds throughout, also in the last stage and in evaluations
        for group in ("env_kwargs", "finetune_env_kwargs", "eval_env_kwargs"):
            own = changes.get(group, getattr(config, group))
            if group == "env_kwargs" or name in own:
                changes[group] = {**own, name: value}
    before, after = (
        kwargs.get("observe_task_guide", False)
        for kwargs in (config.env_kwargs, changes.get("env_kwargs", config.env_kwargs))
    )
    if after != before and "components" in config.policy_kwargs and "policy_kwargs" not in changes:
        raise UsageError(
            f"observe_task_guide is {after}, but the components in policy_kwargs are those of an "
            f"observation where it is {before}: give policy_kwargs too, by --hyperparams"
        )
    if "n_timesteps" in changes and not own_stage:
        return config.with_steps(changes.pop("n_timesteps"), **changes)
    return config.replace(**changes)


def check_seeds(options: argparse.Namespace) -> None:
    """Raises UsageError if --seeds is given together with another choice of seeds."""
    from training.settings.config_file import parse_settings

    if options.seeds is None:
        return
    if options.seed is not None:
        raise UsageError("--seed cannot be used with --seeds: omit one of them")
    if options.resume is not None:
        raise UsageError("--seeds cannot be used with --resume: a run keeps its seed")
    if "seed" in parse_settings(options.hyperparams, "--hyperparams"):
        raise UsageError("--hyperparams seed cannot be used with --seeds: omit one of them")


def check_resumable(options: argparse.Namespace) -> None:
    """Raises UsageError if flags contradict the settings of the run to resume."""
    from training.runs.run_folder import RunFolder

    if options.config is not None:
        raise UsageError("--config cannot be used with --resume: a run keeps its settings")
    config = RunFolder(options.resume).config()
    for name, given, own in (
        ("--algo", options.algo, config.algo),
        ("--env", options.env, config.env_id),
    ):
        if given not in (None, own):
            raise UsageError(f"{name} is {given!r}, but {options.resume} is a run of {own!r}")
    requested = _with_flags(config, options).as_mapping()
    for name, value in config.as_mapping().items():
        if requested[name] != value:
            raise UsageError(
                f"{name} is {requested[name]!r}, but {options.resume} has {value!r}, and a resumed "
                "run keeps its settings: omit this option, or start a new run"
            )


def env_kwargs_of(
    options: argparse.Namespace, function: Callable[..., Any] | None = None
) -> dict[str, Any]:
    """Arguments of the environment from --env-kwargs and --fidelity.

    Args:
        options: The parsed options.
        function: What they are passed to, among arguments of its own.

    Raises:
        UsageError: A name is reserved for the command, or is an argument of the function itself.
    """
    from training.settings.config_file import parse_settings

    given = parse_settings(options.env_kwargs, "--env-kwargs")
    own = inspect.signature(function).parameters if function is not None else ()
    for name in given:
        if name in RESERVED or name in own:
            hint = RESERVED.get(name, "it is no argument of the environment")
            raise UsageError(f"--env-kwargs: {name!r} is not allowed here: {hint}")
    fidelity = {} if options.fidelity is None else {"fidelity": options.fidelity}
    return {**given, **fidelity}


def policy_of(options: argparse.Namespace) -> "Policy":
    """The policy that the first argument names, or that of the latest run."""
    from training.policies.policy import SCRIPTED, scripted_policy
    from training.policies.trained_policy import SHIPPED, shipped_policy, trained_policy

    if options.policy in (SCRIPTED, SHIPPED) and getattr(options, "stochastic", False):
        raise UsageError(
            f"--stochastic samples actions, which needs a run folder or a model.zip; "
            f'"{options.policy}" has only one action for each observation'
        )
    if options.policy == SCRIPTED:
        return scripted_policy(
            options.env or DEFAULT_ENV, **env_kwargs_of(options, scripted_policy)
        )
    if options.policy is not None and options.policy.startswith("RigidEnvs/"):
        raise UsageError(
            f"{options.policy} is an environment, should come after --env; a policy is a run "
            'folder, a .safetensors file, "trained" or "scripted"'
        )
    if options.policy == SHIPPED:
        return shipped_policy(options.env or DEFAULT_ENV)
    return trained_policy(
        Path(options.policy) if options.policy else run_folder_of(options).path,
        algo=options.algo,
        env_id=options.env,
        deterministic=not options.stochastic,
        device=options.device,
        trust_pickle=options.trust_pickle,
    )


def run_folder_of(options: argparse.Namespace) -> "RunFolder":
    """The run that the first argument names, or the latest one."""
    from training.runs.run_folder import RunFolder, latest_run

    if options.policy is not None:
        return RunFolder(Path(options.policy))
    return latest_run(options.log_folder, options.algo, options.env)
