"""Training settings: typed and validated before use.

The schema is that of rl-baselines3-zoo, with one exception: network settings are a mapping and are
never evaluated as code. `config_file` reads settings from YAML.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import yaml

from training.settings.errors import UsageError, nearest
from training.settings.network_settings import (
    BOUNDED_RULES,
    MIRROR_RULES,
    PIXEL_RULES,
    POLICY_RULES,
    SYMLOG_RULES,
)
from training.settings.seed_ranges import LIMIT
from training.settings.settings import (
    InvalidValue,
    boolean,
    choice,
    integer,
    mapping,
    number,
    optional,
    schedule,
    setting,
    true_false_or,
    wrapper_list,
)

WRAPPERS = (
    "rigid_envs.wrappers.ActionPenalty",
    "rigid_envs.wrappers.BoundReward",
    "rigid_envs.wrappers.ScaleReward",
    "rigid_envs.wrappers.SmoothnessPenalty",
    "rigid_envs.wrappers.SuccessBonus",
    "rigid_envs.wrappers.TimePenalty",
)
"""Import paths of the reward wrappers whose arguments YAML can express."""
ACTION_WRAPPERS = (
    "rigid_envs.wrappers.ActionPenalty",
    "rigid_envs.wrappers.SmoothnessPenalty",
)
"""Wrappers whose reward depends on the action, so that HER cannot recompute it from goals."""
NORMALIZE_RULES = {"norm_obs": boolean, "norm_reward": boolean, "epsilon": number(above=0)}
"""Arguments of VecNormalize: what is scaled, by default both, and what is added to variances."""


@dataclass(frozen=True, kw_only=True)
class TrainConfig:
    """Everything that determines a training run, except the machine."""

    algo: ClassVar[str]
    """Name of the algorithm, as in configs/<algo>.yaml."""
    symlog_policies: ClassVar[tuple[str, ...]] = ()
    """Import paths of the algorithm's policies with features on a logarithmic scale."""
    mirrored_policies: ClassVar[tuple[str, ...]] = ()
    """Import paths of those whose networks can be equivariant under reflections."""
    bounded_policies: ClassVar[tuple[str, ...]] = ()
    """Import paths of those whose mean action stays within ±1."""
    pixel_policies: ClassVar[tuple[str, ...]] = ()
    """Import paths of those of the algorithm's policies that act from pixels."""

    env_id: str
    """Environment id, as in RigidEnvs/Push-v0."""
    n_envs: int = setting(integer(1), 1)
    """Number of worlds simulated in parallel."""
    n_timesteps: int = setting(integer(1))
    """Environment steps to train for, summed over the worlds."""
    env_kwargs: dict[str, Any] = setting(mapping(), {})
    """Arguments of the environment: reward_type, fidelity, ..."""
    env_wrapper: Any = setting(optional(wrapper_list(*WRAPPERS)), None)
    """Reward wrappers for training: NAME, {NAME: {argument: value}} or a list of these, innermost
    first; their vector versions are used. Success is measured without them."""
    finetune_timesteps: int = setting(integer(0), 0)
    """Length of the fine-tuning stage: at least this many of the last steps are trained with
    `finetune_env_kwargs`. 0: no such stage."""
    finetune_env_kwargs: dict[str, Any] = setting(mapping(), {})
    """Arguments that replace those of `env_kwargs` in the fine-tuning stage, such as a higher
    fidelity. The policy is evaluated with them."""
    normalize: bool | dict[str, Any] = setting(true_false_or(NORMALIZE_RULES), False)
    """Scale observations and rewards by their running mean and deviation (VecNormalize);
    {norm_obs: false} scales only rewards, {norm_reward: false} only observations, and
    {epsilon: 1.0e-4} adds 1e-4 to all variances, so that a component that hardly changes stays
    small."""
    eval_env_kwargs: dict[str, Any] = setting(mapping(), {})
    """Arguments that replace those of training when the policy is evaluated, such as the length of
    episodes."""
    eval_freq: int | None = setting(optional(integer(0)), None)
    """Environment steps between two evaluations of the policy's mean action. null: 100 for each of
    its episodes; 0: none."""
    n_eval_episodes: int = setting(integer(1), 1000)
    """Episodes of each of these evaluations."""
    target_success_rate: float | None = setting(optional(number(above=0, at_most=1)), None)
    """Stop early when this fraction of the episodes of an evaluation succeeds. With a fine-tuning
    stage: start that stage early, and stop when the rate is reached in it too."""
    seed: int | None = setting(optional(integer(0, LIMIT - 1)), 0)
    """Seed of worlds, network and sampling; null draws one and records it."""
    policy: str = setting(choice("MultiInputPolicy"), "MultiInputPolicy")
    """Policy class of Stable-Baselines3 for dict observations."""
    policy_kwargs: dict[str, Any] = setting(mapping(POLICY_RULES), {})
    """Network: net_arch (hidden layer widths), log_std_init, activation (default: tanh for PPO,
    relu for SAC, as in Stable-Baselines3); min_std and state_dependent_std (bounded policies only);
    differences, components, units and next_object (symlog policies and PixelPolicy only); mirrors
    (symlog policies of PPO only); filters and keypoints (PixelPolicy only)."""
    learning_rate: float | str = setting(schedule(), 3e-4)
    """Step size of the optimiser; "lin_3e-4" falls linearly to zero over the run."""
    batch_size: int = setting(integer(2), 64)
    """Transitions in one gradient step."""
    gamma: float = setting(number(above=0, at_most=1), 0.99)
    """Discount factor of the reward, per step."""

    @classmethod
    def from_mapping(cls, env_id: str, values: Mapping[str, Any], source: str) -> Self:
        """Validates `values` and builds the settings.

        Args:
            env_id: Environment that the settings are for.
            values: Settings by name, as YAML parsed them.
            source: File or other origin, named in error messages.

        Raises:
            UsageError: A key is unknown or missing, or a value has a wrong type or range.
        """
        fields = {field.name: field for field in dataclasses.fields(cls) if field.name != "env_id"}
        settings: dict[str, Any] = {}
        for key, value in values.items():
            if key not in fields:
                raise UsageError(
                    f"{source}: {env_id}: unknown key {key!r}; "
                    f"did you mean {nearest(str(key), fields)!r}?"
                )
            try:
                settings[key] = fields[key].metadata["rule"](value)
            except InvalidValue as error:
                raise UsageError(
                    f"{source}: {env_id}: {key} is {value!r}, should be {error}"
                ) from None
        if "n_timesteps" not in settings:
            raise UsageError(f"{source}: {env_id}: n_timesteps is missing, should be an integer")
        config = cls(env_id=env_id, **settings)
        config._check_combinations(f"{source}: {env_id}")
        return config

    def replace(self, source: str = "command line", **values: Any) -> Self:
        """A copy with other `values`, validated like those of a file."""
        return self.from_mapping(self.env_id, {**self.as_mapping(), **values}, source)

    def with_steps(self, n_timesteps: Any, **values: Any) -> Self:
        """A run of another length, whose fine-tuning stage is longer or shorter in proportion.

        A run in which the stage would be shorter than a rollout has none.

        Args:
            n_timesteps: Environment steps of the run.
            **values: Other settings, as for `replace`.

        Raises:
            UsageError: A value is invalid.
        """
        no_stage = {"finetune_timesteps": 0, "finetune_env_kwargs": {}}
        whole = self.replace(**{**values, **no_stage, "n_timesteps": n_timesteps})
        stage = self.finetune_timesteps * whole.n_timesteps // self.n_timesteps
        unchanged = whole.n_timesteps == self.n_timesteps and whole.rollout == self.rollout
        if stage < whole.rollout and not unchanged:
            return whole
        kwargs = values.get("finetune_env_kwargs", self.finetune_env_kwargs)
        return whole.replace(finetune_timesteps=stage, finetune_env_kwargs=kwargs)

    @property
    def rollout(self) -> int:
        """Environment steps between two updates, summed over the worlds."""
        raise NotImplementedError

    @property
    def norm_obs(self) -> bool:
        """Whether observations are scaled."""
        return self._scales("norm_obs")

    @property
    def norm_reward(self) -> bool:
        """Whether rewards are scaled."""
        return self._scales("norm_reward")

    @property
    def norm_epsilon(self) -> float:
        """What is added to the variances; by default as in VecNormalize."""
        chosen = self.normalize
        return 1e-8 if isinstance(chosen, bool) else float(chosen.get("epsilon", 1e-8))

    def _scales(self, name: str) -> bool:
        chosen = self.normalize
        return chosen if isinstance(chosen, bool) else bool(chosen.get(name, True))

    @property
    def last_stage_kwargs(self) -> dict[str, Any]:
        """Arguments of the environment at the end of training."""
        return {**self.env_kwargs, **self.finetune_env_kwargs}

    @property
    def final_env_kwargs(self) -> dict[str, Any]:
        """Arguments of the environment that the policy is for, and is evaluated with."""
        return {**self.last_stage_kwargs, **self.eval_env_kwargs}

    @property
    def evaluation_interval(self) -> int:
        """Environment steps between two evaluations during training; 0: none."""
        return 100 * self.n_eval_episodes if self.eval_freq is None else self.eval_freq

    def as_mapping(self) -> dict[str, Any]:
        """The settings by name, as in a file."""
        values = dataclasses.asdict(self)
        del values["env_id"]
        return values

    def as_yaml(self) -> str:
        """The text of a file that `load_config` reads back to equal settings."""
        return yaml.safe_dump({self.env_id: self.as_mapping()}, sort_keys=False)

    def _check_combinations(self, where: str) -> None:
        """Raises UsageError for settings that are valid alone but contradict each other.

        Args:
            where: Start of the error message.
        """
        if self.target_success_rate is not None and self.eval_freq == 0:
            raise UsageError(
                f"{where}: target_success_rate is {self.target_success_rate}, but eval_freq is 0: "
                "only an evaluation can reach it"
            )
        if self.final_env_kwargs.get("max_episode_steps") == -1:
            raise UsageError(
                f"{where}: max_episode_steps is -1, should be at least 1, or given in "
                "eval_env_kwargs: policies are evaluated on whole episodes"
            )
        symlog = self.policy in self.symlog_policies
        for rules, policies in (
            (SYMLOG_RULES, self.symlog_policies),
            (MIRROR_RULES, self.mirrored_policies),
            (BOUNDED_RULES, self.bounded_policies),
            (PIXEL_RULES, self.pixel_policies),
        ):
            for name in rules:
                if name in self.policy_kwargs and self.policy not in policies:
                    required = f"policy: {' or '.join(policies)}" if policies else "algorithm ppo"
                    raise UsageError(f"{where}: policy_kwargs: {name} requires {required}")
        for kwargs in (self.env_kwargs, self.final_env_kwargs):
            observed = str(kwargs.get("obs_type", "state"))
            if observed == "flat":
                raise UsageError(
                    f"{where}: obs_type is flat, should be state: the policies of this command "
                    "read observations by name; flat ones are for other learners"
                )
            if observed.startswith("pixels") != (self.policy in self.pixel_policies):
                raise UsageError(
                    f"{where}: policy is {self.policy} with obs_type {observed}: "
                    "training.policies.pixels.PixelPolicy of ppo acts from pixels, as in "
                    "configs/pixels.yaml, the other policies from the state"
                )
        first = self.policy_kwargs.get("log_std_init")
        if isinstance(first, list) and self.policy not in self.bounded_policies:
            raise UsageError(
                f"{where}: policy_kwargs: log_std_init is {first}, should be one number with "
                f"{self.policy}"
            )
        if self.norm_obs and symlog:
            only_rewards = " or {norm_obs: false}" if self.algo == "ppo" else ""
            raise UsageError(
                f"{where}: normalize is {self.normalize}, should be false{only_rewards} with "
                f"{self.policy}, which has units of its own"
            )
        if bool(self.finetune_timesteps) != bool(self.finetune_env_kwargs):
            raise UsageError(
                f"{where}: finetune_timesteps is {self.finetune_timesteps} and "
                f"finetune_env_kwargs is {self.finetune_env_kwargs}; give both or neither"
            )
        if self.finetune_timesteps >= self.n_timesteps:
            raise UsageError(
                f"{where}: finetune_timesteps is {self.finetune_timesteps}, should be less than "
                f"n_timesteps = {self.n_timesteps}"
            )
