"""One torch thread during rollouts.

After each parallel region, torch's worker threads spin while they wait for the next one, on cores
that the environments could use. The network's forward pass in a rollout is too small to gain from
more threads; the updates gain.
"""

import torch
from stable_baselines3.common.callbacks import BaseCallback


class OneThreadRollouts(BaseCallback):
    """Sets torch to one thread during rollouts, and restores the number for updates."""

    def __init__(self) -> None:
        super().__init__()
        self.threads = torch.get_num_threads()

    def _on_rollout_start(self) -> None:
        torch.set_num_threads(1)

    def _on_rollout_end(self) -> None:
        torch.set_num_threads(self.threads)

    def _on_step(self) -> bool:
        return True
