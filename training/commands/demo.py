"""The whole way in one command: train, evaluate, film, draw."""

import time
from pathlib import Path

from training.policies.trained_policy import trained_policy
from training.results.evaluate import Evaluation, evaluate, print_evaluation
from training.results.plot import plot_learning_curves
from training.results.record import record
from training.runs.run_folder import RunFolder
from training.sb3.train import TrainResult, train
from training.settings.config import TrainConfig


def demo(
    config: TrainConfig,
    log_folder: Path = Path("runs"),
    *,
    episodes: int = 1000,
    device: str = "cpu",
    num_threads: int | None = None,
) -> tuple[RunFolder, Evaluation]:
    """Trains as configured, evaluates, writes a video and a learning curve, and says where.

    Args:
        config: What to train, and how.
        log_folder: Where run folders are made.
        episodes: How many to evaluate on.
        device: Torch device of the networks.
        num_threads: Threads of torch.
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
    for name, path in (("video", video), ("picture", still), ("learning curve", curve)):
        print(f"{name:<15} {path}")
    return trained.folder, result


def print_training(trained: TrainResult) -> None:
    """Prints how training went, in a line."""
    speed = (trained.steps - trained.steps_before) / trained.seconds
    print(
        f"{'interrupted' if trained.interrupted else 'trained'} after {trained.steps:,} steps in "
        f"{trained.seconds:.0f} s ({speed:,.0f} steps/s, "
        f"{trained.environment_share:.0%} of the time in the environments): {trained.folder.path}"
    )
