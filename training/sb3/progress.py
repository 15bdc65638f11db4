"""Progress display, wall time in the learning curve, and early stopping."""

import time
from typing import Any

import numpy as np
import torch
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from stable_baselines3.common.callbacks import BaseCallback

from training.sb3.evaluation import SuccessEvaluation
from training.sb3.finetune import FineTuning

SECONDS_BETWEEN_UPDATES = 0.5
SECONDS_BETWEEN_LINES = 15.0


class TrainingProgress(BaseCallback):
    """A progress bar with success rate, speed and remaining time.

    Without a terminal it prints a line every 15 s instead. It also records the wall time with each
    row of the learning curve.

    Args:
        total_steps: Environment steps of the run.
        rollout: Environment steps between two updates; a run has whole ones.
        quiet: Show nothing.
        seconds_before: Wall time of the run before it was resumed, in seconds.
    """

    def __init__(
        self, total_steps: int, rollout: int, quiet: bool = False, seconds_before: float = 0.0
    ):
        super().__init__()
        self.console = Console(quiet=quiet)
        self.bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TextColumn("success {task.fields[success]}"),
            TextColumn("{task.fields[speed]:,.0f} steps/s"),
            TimeRemainingColumn(),
            console=Console(quiet=quiet or not self.console.is_terminal),
            refresh_per_second=2,
        )
        self.asked, self.rollout = total_steps, rollout
        self.total_steps = -(-total_steps // rollout) * rollout
        self.seconds_before = seconds_before
        self.steps_before = 0
        self.task = self.bar.add_task("training", total=self.total_steps, success="–", speed=0.0)
        self.started = self.shown = self.printed = time.perf_counter()

    def close(self) -> None:
        """Removes the bar; safe to call at any time."""
        if getattr(self, "model", None) is not None and self.bar.live.is_started:
            self._show()
        self.bar.stop()

    def _on_training_start(self) -> None:
        self.steps_before = self.model.num_timesteps
        self.started = self.shown = self.printed = time.perf_counter()
        self.bar.start()
        if self.total_steps > 1.1 * self.asked:
            self.console.print(
                f"an update takes {self.rollout:,} steps: trains {self.total_steps:,} instead of "
                f"{self.asked:,}"
            )
        steps = getattr(self.model, "cloning_steps", 0)
        if steps and self.model._n_updates == 0:
            self.console.print(f"first, {steps:,} gradient steps imitate the demonstrations")

    def _on_step(self) -> bool:
        now = time.perf_counter()
        # off-policy algorithms write rows of the learning curve between two updates
        self.logger.record("time/wall_time", round(self.seconds_before + now - self.started, 3))
        if now - self.shown > SECONDS_BETWEEN_UPDATES:
            self.shown = now
            self._show()
        return True

    def _on_rollout_end(self) -> None:
        seconds = self.seconds_before + time.perf_counter() - self.started
        self.logger.record("time/wall_time", round(seconds, 3))

    def _show(self) -> None:
        now = time.perf_counter()
        speed = (self.model.num_timesteps - self.steps_before) / max(now - self.started, 1e-9)
        rate = success_rate(self.model)
        shown = "–" if rate is None else f"{rate:.1%}"
        fields: dict[str, Any] = {"success": shown, "speed": speed}
        self.bar.update(self.task, completed=self.num_timesteps, **fields)
        if not self.console.is_terminal and now - self.printed > SECONDS_BETWEEN_LINES:
            self.printed = now
            self.console.print(
                f"{self.num_timesteps:,} of {self.total_steps:,} steps, "
                f"success {shown}, {speed:,.0f} steps/s"
            )


class StopAtSuccess(BaseCallback):
    """Ends training when the success of the mean action reaches the target in an evaluation.

    Stable-Baselines3 updates the policy once more before it stops. The policy that was evaluated is
    kept: an update can change its success by several percent.

    Args:
        target: Fraction of the episodes.
        evaluation: The evaluations.
        finetuning: The fine-tuning stage, if any. Reaching the target before this stage starts the
            stage; reaching it during the stage ends training.
    """

    def __init__(
        self, target: float, evaluation: SuccessEvaluation, finetuning: FineTuning | None = None
    ):
        super().__init__()
        self.target, self.evaluation = target, evaluation
        self.finetuning = finetuning
        self.reached = False
        self._evaluated: dict[str, torch.Tensor] = {}

    def _on_rollout_end(self) -> None:
        if self.evaluation.at_step != self.num_timesteps:
            return
        reached = self.evaluation.rate >= self.target
        if self.finetuning is None or self.finetuning.started:
            self.reached = reached
            if reached:
                weights = self.model.policy.state_dict()
                self._evaluated = {name: value.clone() for name, value in weights.items()}
        elif reached:
            self.finetuning.from_steps = 0

    def _on_step(self) -> bool:
        return not self.reached

    def _on_training_end(self) -> None:
        if self.reached:
            self.model.policy.load_state_dict(self._evaluated)


def success_rate(model: Any) -> float | None:
    """Fraction of the last episodes that ended in success; None before the first one ended."""
    episodes = model.ep_success_buffer
    return float(np.mean(episodes)) if episodes else None
