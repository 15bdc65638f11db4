"""Replay buffers that take a part of every batch from demonstrations.

So the critic sees success from the first gradient step on, although the policy has none yet (Ball
et al., Efficient online reinforcement learning with offline data, ICML 2023). Demonstrations are
never overwritten; with HER, their goals are replaced as those of other episodes.
"""

import hashlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.buffers import DictReplayBuffer
from stable_baselines3.common.type_aliases import DictReplayBufferSamples
from stable_baselines3.common.vec_env import VecNormalize
from stable_baselines3.her import HerReplayBuffer

from training.datasets.record import Recorded


class DemonstrationBuffer(DictReplayBuffer):
    """A replay buffer with demonstrations.

    Args:
        *arguments, **keywords: Those of the buffer without demonstrations.
        episodes: The demonstrations.
        fraction: Part of each batch that is sampled from them.
    """

    def __init__(
        self, *arguments: Any, episodes: Sequence[Recorded], fraction: float, **keywords: Any
    ):
        super().__init__(*arguments, **keywords)
        self.fraction = fraction
        self.demonstrations = self._empty(sum(len(episode.rewards) for episode in episodes))
        _fill(self.demonstrations, episodes)
        self._intended = np.concatenate([episode.intended for episode in episodes])
        digest = hashlib.sha256()
        for episode in episodes:
            for values in (episode.actions, episode.intended, episode.rewards):
                digest.update(np.ascontiguousarray(values).tobytes())
        self.fingerprint = digest.hexdigest()
        """Of the demonstrations, to notice others when a run is resumed."""

    def sample_intended(
        self, batch_size: int, env: VecNormalize | None = None
    ) -> tuple[dict[str, torch.Tensor], torch.Tensor]:
        """Demonstrated observations, and the actions that were intended there."""
        rows = np.random.randint(len(self._intended), size=batch_size)  # noqa: NPY002  (as SB3's)
        stored = self.demonstrations.observations
        seen: Any = {key: values[rows, 0] for key, values in stored.items()}
        seen = self._normalize_obs(seen, env)
        tensors = {key: self.to_torch(values) for key, values in seen.items()}
        return tensors, self.to_torch(self._intended[rows])

    def _empty(self, steps: int) -> DictReplayBuffer:
        """A buffer for the demonstrations."""
        return DictReplayBuffer(steps, self.observation_space, self.action_space, self.device)

    def sample(  # type: ignore[override]
        self, batch_size: int, env: VecNormalize | None = None
    ) -> DictReplayBufferSamples:
        """A batch of which a part is from demonstrations."""
        shown = round(self.fraction * batch_size)
        own = super().sample(batch_size - shown, env)
        return _joined(own, self.demonstrations.sample(shown, env))


class DemonstrationHerBuffer(DemonstrationBuffer, HerReplayBuffer):
    """The same with hindsight experience replay."""

    def _empty(self, steps: int) -> DictReplayBuffer:
        assert self.env is not None
        return HerReplayBuffer(
            steps, self.observation_space, self.action_space, self.env, self.device,
            n_sampled_goal=self.n_sampled_goal,
            goal_selection_strategy=self.goal_selection_strategy,
        )  # fmt: skip


def _fill(buffer: DictReplayBuffer, episodes: Sequence[Recorded]) -> None:
    for episode in episodes:
        seen = episode.observations
        for t in range(len(episode.rewards)):
            before, after = (
                {key: values[None, k] for key, values in seen.items()} for k in (t, t + 1)
            )
            done = episode.terminated[t] | episode.truncated[t]
            cut = bool(episode.truncated[t] and not episode.terminated[t])
            buffer.add(
                before, after, episode.actions[None, t], episode.rewards[None, t], done[None],
                [{"TimeLimit.truncated": cut}],
            )  # fmt: skip


def _joined(
    own: DictReplayBufferSamples, shown: DictReplayBufferSamples
) -> DictReplayBufferSamples:
    def both(a: Any, b: Any) -> Any:
        if isinstance(a, dict):
            return {key: torch.cat([a[key], b[key]]) for key in a}
        return None if a is None else torch.cat([a, b])

    return DictReplayBufferSamples(*map(both, own, shown))
