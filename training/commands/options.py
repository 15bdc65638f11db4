"""What the words of a command amount to: settings, arguments of the environment, policy, run.

Like the command line it starts without Stable-Baselines3 or torch.
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from training.commands.flags import DEMO_ALGO, DEMO_ENV
from training.settings.errors import UsageError

if TYPE_CHECKING:
    from training.policies.policy import Policy
    from training.runs.run_folder import RunFolder
    from training.settings.config import TrainConfig

# what commands tell an environment, or a function beside its arguments, themselves
OWN = {
    "seed": "give --seed",
    "episodes": "give --n-episodes",
    "num_envs": "only train takes it, as --n-envs",
    "env_id": "give --env; play takes it as its first word",
    "render_mode": "the command chooses it",
    "autoreset_mode": "the command chooses it",
    "vectorization_mode": "the command chooses it",
    "fps": "it is 25",
    "policy": "it is the first word",
    "video": "give --output",
    "quiet": "there is no such choice",
    "gif_width": "there is no such choice",
}


def config_of(options: argparse.Namespace) -> "TrainConfig":
    """The settings of the file, with those that flags give in their place."""
    return _changed(configured(options), options)


def configured(options: argparse.Namespace) -> "TrainConfig":
    """The settings of the file."""
    from training.settings.config import load_config

    return load_config(options.algo or DEMO_ALGO, options.env or DEMO_ENV, options.config)


def _changed(config: "TrainConfig", options: argparse.Namespace) -> "TrainConfig":
    """The settings, with those that flags give in their place."""
    from training.settings.config import parse_settings

    changes = parse_settings(options.hyperparams, "--hyperparams")
    for name in ("n_timesteps", "n_envs", "seed"):
        if getattr(options, name) is not None:
            changes[name] = getattr(options, name)
    changed_env = env_kwargs_of(options)
    if changed_env:
        changes["env_kwargs"] = {**config.env_kwargs, **changed_env}
    return config.replace(**changes)


def refuse_contradictions(options: argparse.Namespace) -> None:
    """Raises UsageError where flags would make the run to resume another one."""
    from training.runs.run_folder import RunFolder

    if options.config is not None:
        raise UsageError("--config does not go with --resume: a run goes on with its own settings")
    config = RunFolder(options.resume).config()
    for name, given, own in (
        ("--algo", options.algo, config.algo),
        ("--env", options.env, config.env_id),
    ):
        if given not in (None, own):
            raise UsageError(f"{name} is {given!r}, but {options.resume} is a run of {own!r}")
    asked = _changed(config, options).as_mapping()
    for name, value in config.as_mapping().items():
        if asked[name] != value:
            raise UsageError(
                f"{name} is asked to be {asked[name]!r}, but {options.resume} has {value!r}, "
                "and a run goes on as it began: leave it away, or train anew"
            )


def env_kwargs_of(options: argparse.Namespace) -> dict[str, Any]:
    """Arguments of the environment; UsageError for one that is not the user's to give."""
    from training.settings.config import parse_settings

    given = parse_settings(options.env_kwargs, "--env-kwargs")
    for name in given:
        if name in OWN:
            raise UsageError(f"--env-kwargs: {name!r} is none of the environment's: {OWN[name]}")
    fidelity = {} if options.fidelity is None else {"fidelity": options.fidelity}
    return {**given, **fidelity}


def policy_of(options: argparse.Namespace) -> "Policy":
    """What acts: that of the first word, or of the latest run."""
    from training.policies.policy import SCRIPTED, scripted_policy
    from training.policies.trained_policy import trained_policy

    if options.policy == SCRIPTED:
        return scripted_policy(options.env or DEMO_ENV, **env_kwargs_of(options))
    return trained_policy(
        Path(options.policy) if options.policy else run_folder_of(options).path,
        algo=options.algo,
        env_id=options.env,
        deterministic=not options.stochastic,
        device=options.device,
        trust_pickle=options.trust_pickle,
    )


def run_folder_of(options: argparse.Namespace) -> "RunFolder":
    """The run of the first word, or the latest."""
    from training.runs.run_folder import RunFolder, latest_run

    if options.policy is not None:
        return RunFolder(Path(options.policy))
    return latest_run(options.log_folder, options.algo or DEMO_ALGO, options.env or DEMO_ENV)
