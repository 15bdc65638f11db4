"""The settings of each algorithm."""

from dataclasses import dataclass
from typing import Any, ClassVar

from training.settings.config import ACTION_WRAPPERS, TrainConfig
from training.settings.errors import UsageError
from training.settings.settings import (
    choice,
    count_or_all,
    entropy_coefficient,
    integer,
    mapping,
    number,
    optional,
    parse_wrappers,
    schedule,
    setting,
    text,
)

# import paths: rl-baselines3-zoo expects one for a policy outside Stable-Baselines3
BOUNDED_POLICY = "training.policies.bounded.BoundedPolicy"
OFFSET_POLICY = "training.policies.offsets.OffsetPolicy"
SYMLOG_POLICY = "training.policies.symlog.SymlogPolicy"
SYMLOG_PPO_POLICY = "training.policies.symlog.SymlogActorCriticPolicy"
BOUNDED_SYMLOG_POLICY = "training.policies.symlog.BoundedSymlogPolicy"
PIXEL_POLICY = "training.policies.pixels.PixelPolicy"
BOUNDED_POLICIES = (BOUNDED_POLICY, BOUNDED_SYMLOG_POLICY)
SYMLOG_PPO_POLICIES = (SYMLOG_PPO_POLICY, BOUNDED_SYMLOG_POLICY)
PPO_POLICIES = ("MultiInputPolicy", BOUNDED_POLICY, *SYMLOG_PPO_POLICIES, PIXEL_POLICY)
SAC_POLICIES = ("MultiInputPolicy", OFFSET_POLICY, SYMLOG_POLICY)
HER_RULES = {
    "n_sampled_goal": integer(1),
    "goal_selection_strategy": choice("future", "final", "episode"),
}


@dataclass(frozen=True, kw_only=True)
class PPOConfig(TrainConfig):
    """Settings of proximal policy optimisation (PPO)."""

    algo: ClassVar[str] = "ppo"
    symlog_policies: ClassVar[tuple[str, ...]] = (*SYMLOG_PPO_POLICIES, PIXEL_POLICY)
    mirrored_policies: ClassVar[tuple[str, ...]] = SYMLOG_PPO_POLICIES
    bounded_policies: ClassVar[tuple[str, ...]] = BOUNDED_POLICIES
    pixel_policies: ClassVar[tuple[str, ...]] = (PIXEL_POLICY,)

    policy: str = setting(choice(*PPO_POLICIES), "MultiInputPolicy")
    """Policy class; training.policies.bounded.BoundedPolicy keeps the mean action within ±1,
    training.policies.symlog.SymlogActorCriticPolicy observes on a logarithmic scale,
    training.policies.symlog.BoundedSymlogPolicy does both, and training.policies.pixels.PixelPolicy
    acts from a picture while its critic observes the state on a logarithmic scale."""
    n_steps: int = setting(integer(1), 2048)
    """Steps of each world between two updates."""
    n_epochs: int = setting(integer(1), 10)
    """Passes over the collected steps in an update."""
    gae_lambda: float = setting(number(at_least=0, at_most=1), 0.95)
    """Bias-variance trade-off of the advantage estimate."""
    ent_coef: float = setting(number(at_least=0), 0.0)
    """Weight of the entropy bonus."""
    vf_coef: float = setting(number(at_least=0), 0.5)
    """Weight of the value loss."""
    max_grad_norm: float = setting(number(above=0), 0.5)
    """Largest norm of a gradient; larger gradients are scaled down to it."""
    clip_range: float | str = setting(schedule(), 0.2)
    """Clip range of the ratio of action probabilities."""
    target_kl: float | None = setting(optional(number(above=0)), None)
    """End an update at this KL divergence from the policy before it; null for no limit."""

    @property
    def rollout(self) -> int:
        """Environment steps between two updates, summed over the worlds."""
        return self.n_envs * self.n_steps

    def _check_combinations(self, where: str) -> None:
        super()._check_combinations(where)
        rollout = self.rollout
        first_stage = -(-(self.n_timesteps - self.finetune_timesteps) // rollout) * rollout
        if self.finetune_timesteps and first_stage >= self.n_timesteps:
            raise UsageError(
                f"{where}: finetune_timesteps is {self.finetune_timesteps}, less than the last "
                f"rollout; it should be at least n_envs × n_steps = {rollout}"
            )
        if self.batch_size > rollout:
            raise UsageError(
                f"{where}: batch_size is {self.batch_size}, should be at most "
                f"n_envs × n_steps = {rollout}"
            )


@dataclass(frozen=True, kw_only=True)
class SACConfig(TrainConfig):
    """Settings of soft actor-critic (SAC), optionally with hindsight experience replay (HER)."""

    algo: ClassVar[str] = "sac"
    symlog_policies: ClassVar[tuple[str, ...]] = (SYMLOG_POLICY,)

    policy: str = setting(choice(*SAC_POLICIES), "MultiInputPolicy")
    """Policy class; training.policies.offsets.OffsetPolicy observes the goal relative to the
    achieved one, training.policies.symlog.SymlogPolicy also on a logarithmic scale."""
    buffer_size: int = setting(integer(1), 1_000_000)
    """Capacity of the replay buffer in transitions, summed over the worlds."""
    learning_starts: int = setting(integer(0), 1000)
    """Steps of random actions before the first update; with HER more than one episode."""
    train_freq: int = setting(integer(1), 1)
    """Steps of all worlds between two updates."""
    gradient_steps: int = setting(count_or_all, 1)
    """Gradient steps in an update; -1 for as many as transitions were collected."""
    tau: float = setting(number(above=0, at_most=1), 0.005)
    """Interpolation factor of the target network's update (Polyak averaging)."""
    ent_coef: float | str = setting(entropy_coefficient, "auto")
    """Weight of the entropy bonus; "auto" learns it, "auto_0.1" starts at 0.1."""
    replay_buffer_class: str | None = setting(optional(choice("HerReplayBuffer")), None)
    """HerReplayBuffer for hindsight experience replay; null for an ordinary replay buffer."""
    replay_buffer_kwargs: dict[str, Any] = setting(mapping(HER_RULES), {})
    """Arguments of HerReplayBuffer: n_sampled_goal, goal_selection_strategy."""
    demonstrations: str | None = setting(optional(text), None)
    """Name of a Minari dataset of the environment; null for no demonstrations."""
    demonstration_fraction: float = setting(number(above=0, at_most=0.9), 0.5)
    """Part of each batch that is sampled from the demonstrations."""
    cloning_steps: int = setting(integer(0), 0)
    """Gradient steps in which the actor only imitates the demonstrations, before the first update.
    Afterwards it imitates and climbs the critic, without entropy (TD3+BC). 0: SAC."""
    cloning_weight: float = setting(number(at_least=0), 50.0)
    """Weight of the squared distance to demonstrated actions, relative to the critic's value."""

    @property
    def rollout(self) -> int:
        """Environment steps between two updates, summed over the worlds."""
        return self.n_envs * self.train_freq

    @property
    def demonstration_batch(self) -> int:
        """Transitions of a batch that are sampled from the demonstrations."""
        return round(self.demonstration_fraction * self.batch_size)

    def _check_combinations(self, where: str) -> None:
        super()._check_combinations(where)
        if isinstance(self.normalize, dict):
            raise UsageError(
                f"{where}: normalize is {self.normalize}, should be "
                f"{'false' if self.policy in self.symlog_policies else 'true or false'}: SAC's "
                "rewards are never scaled"
            )
        if "log_std_init" in self.policy_kwargs:
            raise UsageError(
                f"{where}: policy_kwargs: log_std_init requires algorithm ppo: SAC's networks "
                "compute the standard deviation"
            )
        if self.cloning_steps:
            self._check_cloning(where)
        shown = self.demonstration_batch
        if self.demonstrations is not None and not 0 < shown < self.batch_size:
            raise UsageError(
                f"{where}: demonstration_fraction is {self.demonstration_fraction}, which is "
                f"{shown} of {self.batch_size} transitions: a batch should have some of each kind"
            )
        if self.demonstrations is not None and self.env_wrapper is not None:
            raise UsageError(
                f"{where}: env_wrapper cannot be used with demonstrations, whose rewards are those "
                "of the environment alone"
            )
        if self.replay_buffer_class is None:
            if self.replay_buffer_kwargs:
                raise UsageError(
                    f"{where}: replay_buffer_kwargs requires replay_buffer_class: HerReplayBuffer"
                )
            return
        if self.env_kwargs.get("observe_task_guide"):
            raise UsageError(
                f"{where}: env_kwargs: observe_task_guide cannot be used with HerReplayBuffer: the "
                "guide depends on the desired goal, which HerReplayBuffer replaces"
            )
        for name, _ in parse_wrappers(self.env_wrapper):
            if name in ACTION_WRAPPERS:
                raise UsageError(
                    f"{where}: env_wrapper: {name} cannot be used with HerReplayBuffer, which "
                    "computes rewards from goals alone"
                )

    def _check_cloning(self, where: str) -> None:
        """Raises UsageError for settings that cloning contradicts."""
        if self.normalize:
            raise UsageError(
                f"{where}: normalize is True, should be false with cloning_steps: the scales would "
                "change after the actor is fitted"
            )
        if self.ent_coef != "auto":
            raise UsageError(
                f"{where}: ent_coef is {self.ent_coef}, but has no effect with cloning_steps"
            )


ALGORITHMS: dict[str, type[TrainConfig]] = {kind.algo: kind for kind in (PPOConfig, SACConfig)}
