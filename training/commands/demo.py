"""The demo command: trains, evaluates, records a video and plots the learning curve."""

import time
from pathlib import Path

from training.policies.trained_policy import trained_policy
from training.results.evaluate import Evaluation, evaluate, print_evaluation
from training.results.plot import plot_learning_curves
from training.results.video import record
from training.runs.run_folder import RunFolder
from training.sb3.train import TrainResult, train
from training.settings.config import TrainConfig


def demo(
    config: TrainConfig,
    log_folder: Path = Path("runs"),
    *,
    episodes: int = 1000,
    device: str = "cpu",
    num_threads: int = 1,
) -> tuple[RunFolder, Evaluation]:
    """Trains, evaluates, writes a video and a learning curve, and prints a summary.

    Args:
        config: The settings of training.
        log_folder: Folder for run folders.
        episodes: Number of episodes of the evaluation.
        device: Torch device of the networks.
        num_threads: Number of torch threads.
    """
    start = time.perf_counter()
    trained = train(config, log_folder, device=device, num_threads=num_threads)
    print_training(trained)
    policy = trained_policy(trained.folder.path)
    result = evaluate(policy, episodes)
    video, still = record(policy, trained.folder.path / "video.mp4")
    curve = plot_learning_curves([trained.folder])
    print_evaluation(policy, result)
    print(f"success rate    {result.success_at_end.mean():.1%} of {episodes:,} episodes")
    print(f"wall time       {time.perf_counter() - start:.0f} s, training {trained.seconds:.0f} s")
    for name, path in (("video", video), ("still image", still), ("learning curve", curve)):
        print(f"{name:<15} {path}")
    return trained.folder, result


def print_training(trained: TrainResult) -> None:
    """Prints the outcome of training in one line, for the whole run if it was resumed."""
    fraction = trained.environment_time_fraction
    in_envs = "" if fraction is None else f", {fraction:.0%} of the time in the environments"
    reached = trained.target_reached
    if reached is not None:
        print(f"target reached: the mean action solved {reached:.1%} of the evaluation's episodes")
    print(
        f"{'interrupted' if trained.interrupted else 'trained'} after {trained.steps:,} steps in "
        f"{trained.seconds:.0f} s ({trained.steps / trained.seconds:,.0f} steps/s{in_envs}): "
        f"{trained.folder.path}"
    )
    if trained.interrupted:
        print(f"to go on: rigid-envs train --resume {trained.folder.path}")
