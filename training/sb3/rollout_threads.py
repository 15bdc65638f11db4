"""One thread for the network while worlds are stepped.

After each parallel region torch's other threads wait awake for the next one, on the cores that the
environments could step worlds on. The network's forward pass of a rollout is too small to gain
anything from more threads; the updates do.
"""

import torch
from stable_baselines3.common.callbacks import BaseCallback


class OneThreadRollouts(BaseCallback):
    """Gives torch a single thread during rollouts, and its own number back for updates."""

    def __init__(self) -> None:
        super().__init__()
        self.threads = torch.get_num_threads()

    def _on_rollout_start(self) -> None:
        torch.set_num_threads(1)

    def _on_rollout_end(self) -> None:
        torch.set_num_threads(self.threads)

    def _on_step(self) -> bool:
        return True
