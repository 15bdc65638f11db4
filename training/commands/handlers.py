"""One function for each command: takes the parsed options and returns the exit status.

Each function imports what it needs, so that the command line starts without Stable-Baselines3 or
torch.
"""

import argparse
from pathlib import Path
from typing import Any

from training.commands.extras import RAY_EXTRA, require
from training.commands.options import (
    check_resumable,
    check_seeds,
    config_of,
    env_kwargs_of,
    policy_of,
    run_folder_of,
)
from training.commands.shared_flags import DEFAULT_ENV
from training.settings.errors import UsageError
from training.settings.seed_ranges import DATASET, EVALUATION

INTERRUPTED = 130
"""Exit status of a command that was ended by Ctrl-C, by the convention of shells."""


def train(options: argparse.Namespace) -> int:
    """Trains a policy, trains one for each seed, or resumes a run."""
    check_seeds(options)
    if options.ray is not None:
        require("ray", RAY_EXTRA)
    # before torch is imported, so that invalid settings are reported at once
    config = config_of(options) if options.resume is None else None
    if config is None:
        check_resumable(options)

    from training.commands import seeds
    from training.commands.demo import print_training
    from training.runs.run_folder import RunFolder
    from training.sb3 import train as training

    machine = {
        "device": options.device,
        "num_threads": options.num_threads,
        "save_every": options.save_freq,
    }
    if options.ray is not None:
        runs: Any = RunFolder(options.resume)
        if config is not None:
            runs = [config.replace(seed=seed) for seed in options.seeds or (config.seed,)]
        interrupted = seeds.train_on_ray(runs, options.log_folder, options.ray, **machine)
    elif config is not None and options.seeds is not None:
        interrupted = seeds.train_seeds(config, options.seeds, options.log_folder, **machine)
    else:
        if config is None:
            trained = training.resume(RunFolder(options.resume), **machine)
        else:
            trained = training.train(config, options.log_folder, **machine)
        print_training(trained)
        interrupted = trained.interrupted
    return INTERRUPTED if interrupted else 0


def evaluate(options: argparse.Namespace) -> int:
    """Prints the success rate of a policy."""
    from training.results import evaluate as evaluation

    kwargs = env_kwargs_of(options, evaluation.evaluate)
    policy = policy_of(options)
    seed = EVALUATION if options.seed is None else options.seed
    if getattr(options, "original", None) is not None:
        from training.results.originals import evaluate_original

        if kwargs:
            raise UsageError(f"--in has its own environment, which does not take {list(kwargs)}")
        policy, result, _ = evaluate_original(
            policy, options.original, options.n_episodes, seed=seed, python=options.python
        )
        evaluation.print_evaluation(policy, result)
        return 0
    result = evaluation.evaluate(policy, options.n_episodes, seed=seed, **kwargs)
    evaluation.print_evaluation(policy, result)
    return 0


def scripted(options: argparse.Namespace) -> int:
    """Prints the success rate of a scripted controller."""
    options.policy = "scripted"
    return evaluate(options)


def tune_fidelity(options: argparse.Namespace) -> int:
    """Prints the cheapest fidelity within a tolerance; 1 if there is none."""
    from training.commands import fidelity_tuning

    try:
        tuned = fidelity_tuning.run(
            policy_of(options), options.tolerance, options.metric, options.time, options.law,
            options.seed or 0, **env_kwargs_of(options, fidelity_tuning.run),
        )  # fmt: skip
    except ValueError as error:
        raise UsageError(str(error)) from None
    return 0 if tuned.fidelity is not None else 1


def record(options: argparse.Namespace) -> int:
    """Records a video of a policy."""
    from training.results import video

    policy = policy_of(options)
    given = Path(options.policy) if options.policy else None
    default = (policy.folder or options.log_folder / policy.name) / "video.mp4"
    if (
        given is not None and given.suffix == ".safetensors"
    ):  # its folder may contain other policies
        default = given.with_suffix(".mp4")
    path, still = video.record(
        policy,
        options.output or default,
        episodes=options.n_episodes,
        seed=EVALUATION if options.seed is None else options.seed,
        **env_kwargs_of(options, video.record),
    )
    print(f"video       {path}\nstill image {still}")
    return 0


def export(options: argparse.Namespace) -> int:
    """Copies the policy of a run into one file."""
    from training.policies.export import export_run
    from training.policies.policy_header import Success
    from training.policies.trained_policy import trained_policy
    from training.results import evaluate as evaluation

    folder = run_folder_of(options)
    success = None
    if options.n_episodes is not None:
        policy = trained_policy(folder.path, algo=options.algo)
        result = evaluation.evaluate(policy, options.n_episodes)
        success = Success(
            options.n_episodes,
            float(result.success_at_end.mean()),
            policy.env_kwargs.get("fidelity"),
            result.first_seed,
        )
    output = options.output or Path(f"{folder.path.name}.safetensors")
    for file in export_run(folder, output, success=success, sb3=options.sb3):
        print(file)
    return 0


def play(options: argparse.Namespace) -> int:
    """Opens a window in which the keyboard controls the environment."""
    from training.commands import play as game

    flags = {
        "fidelity": options.fidelity,
        "reward_type": options.reward,
        "blocks": options.blocks,
        "show_forces": options.show_forces or None,
        "show_particles": options.show_particles or None,
    }
    arguments = {name: value for name, value in flags.items() if value is not None}
    if options.env_kwargs:
        require("train", ("yaml",))
        arguments = {**env_kwargs_of(options, game.play), **arguments}
    game.play(options.env, seed=options.seed, **arguments)
    return 0


def view(options: argparse.Namespace) -> int:
    """Serves a page that shows many worlds."""
    if options.policy is not None or options.env_kwargs:
        require("train", ("yaml",))

    from training.commands import view as viewer

    arguments = {} if options.fidelity is None else {"fidelity": options.fidelity}
    if options.policy is not None or options.env_kwargs:
        arguments = env_kwargs_of(options, viewer.view)
    policy = policy_of(options) if options.policy is not None else None
    viewer.view(
        options.env or (policy.env_id if policy else DEFAULT_ENV),
        policy,
        num_worlds=options.num_worlds,
        seed=options.seed,
        host=options.host,
        port=options.port,
        **arguments,
    )
    return 0


def scene(options: argparse.Namespace) -> int:
    """Runs a scene of many bodies."""
    from training.commands import scene as scenes

    made = scenes.run(
        options.scene, options.bodies, options.seconds, options.seed or 0, options.threads,
        options.video, options.size, options.fidelity,
    )  # fmt: skip
    return INTERRUPTED if made.interrupted else 0


def compile_kernels(options: argparse.Namespace) -> int:
    """Compiles kernels."""
    from training.commands import compiling

    if options.level is not None or options.into is not None:
        return compiling.run_for(
            options.level, options.into, options.ids, options.fidelity, options.general_only
        )
    compiling.run(options.ids, options.fidelity, options.general_only)
    return 0


def plot(options: argparse.Namespace) -> int:
    """Plots learning curves."""
    from training.results.plot import plot_learning_curves
    from training.runs.run_folder import RunFolder

    folders = [RunFolder(path) for path in options.runs] or [run_folder_of(options)]
    print(plot_learning_curves(folders, options.output))
    return 0


def results(options: argparse.Namespace) -> int:
    """Records finished runs, or checks the pages of results."""
    from training.results.results import SOURCE, check_repository, update_results
    from training.results.results_page import check_pages

    repository = options.repository or SOURCE
    if not options.check:
        update_results(
            options.runs,
            options.log_folder,
            repository,
            episodes=options.n_episodes,
            replace=options.replace,
        )
        return 0
    if options.runs or options.replace:
        raise UsageError("--check records nothing: omit the run folders and --replace")
    check_repository(repository)
    check_pages(repository)
    print("docs/results.md and README.md are up to date")
    return 0


def dataset(options: argparse.Namespace) -> int:
    """Records a dataset of episodes."""
    from training.datasets import minari_store

    kwargs = env_kwargs_of(options, minari_store.write_dataset)
    if options.policy == minari_store.RANDOM:
        policy = minari_store.random_policy(options.env or DEFAULT_ENV, options.seed or 0, **kwargs)
    elif options.policy in ("scripted", "trained") or Path(options.policy).exists():
        policy = policy_of(options)
    else:
        raise UsageError(
            f"--policy is {options.policy!r}, should be scripted, trained, random, a run folder or "
            "a .safetensors file"
        )
    written = minari_store.write_dataset(
        policy,
        options.n_episodes,
        options.dataset_id,
        seed=DATASET if options.seed is None else options.seed,
        action_noise=options.action_noise,
        slowdown=options.slowdown,
        replace_existing=options.replace,
        **kwargs,
    )
    print(written)
    return 0


def tune(options: argparse.Namespace) -> int:
    """Searches settings and prints the best ones as YAML."""
    if options.ray is not None:
        require("ray", RAY_EXTRA)
    config = config_of(options)

    from training.commands import tuning
    from training.settings.algorithms import SACConfig
    from training.settings.config_file import parse_settings

    # the steps of the flag, or a fraction of those of the settings; no fine-tuning stage
    steps = config.n_timesteps
    if not options.n_timesteps:
        steps = max(1, config.n_timesteps // tuning.STEPS_DIVISOR)
    full = config_of(argparse.Namespace(**{**vars(options), "n_timesteps": None}))
    restored: dict[str, Any] = {}
    if isinstance(full, SACConfig) and "learning_starts" not in parse_settings(
        options.hyperparams, "--hyperparams"
    ):  # the same fraction of the steps has random actions
        restored["learning_starts"] = full.learning_starts
        random_steps = full.learning_starts * steps // full.n_timesteps
        config = config.replace(learning_starts=random_steps)
    short = config.replace(n_timesteps=steps, finetune_timesteps=0, finetune_env_kwargs={})
    best = tuning.tune(
        short,
        options.log_folder,
        trials=options.n_trials,
        episodes=options.n_episodes,
        storage=options.storage,
        study_name=options.study_name,
        device=options.device,
        num_threads=options.num_threads,
        ray=options.ray,
    )
    if best.settings is not None:
        print(f"# {best.summary}")
        settings = best.settings.replace(
            **restored,
            n_timesteps=full.n_timesteps,
            finetune_timesteps=full.finetune_timesteps,
            finetune_env_kwargs=full.finetune_env_kwargs,
        )
        print(settings.as_yaml(), end="")
    return INTERRUPTED if best.interrupted else 0


def demo(options: argparse.Namespace) -> int:
    """Trains, evaluates, records a video and plots the learning curve."""
    config = config_of(options)

    from training.commands import demo as demonstration

    demonstration.demo(
        config,
        options.log_folder,
        episodes=options.n_episodes,
        device=options.device,
        num_threads=options.num_threads,
    )
    return 0
