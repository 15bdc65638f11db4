"""Training settings: typed, read from YAML keyed by environment id, and checked before use.

The schema is rl-baselines3-zoo's, except that network settings are given as a mapping and never
evaluated as code. What the zoo would hand on to Stable-Baselines3, which would refuse it, may stand
beside the environments instead of among their settings, keyed by environment id too.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, ClassVar, Self

import yaml

from training.settings.errors import UsageError, nearest
from training.settings.settings import (
    Unfit,
    calls_of,
    choice,
    entropy_coefficient,
    flag,
    integer,
    mapping,
    named_calls,
    number,
    optional,
    schedule,
    setting,
    widths,
)

PACKAGED = Path(__file__).resolve().parents[2] / "configs"
"""The settings that come with us, beside this package in the source tree and in the wheel.

Not by importlib.resources: where the project is installed for editing it cannot read a folder
without code, and a `configs` folder of the user's own would come first.
"""
BESIDE = ("target_success_rate", "finish_timesteps", "finish_env_kwargs")
"""Settings of our own that may stand beside the environments, each keyed by their ids."""
BOUNDED = "training.policies.bounded.BoundedPolicy"
OFFSETS = "training.policies.offsets.OffsetPolicy"
"""By where they are found, as the zoo asks for what is not Stable-Baselines3's."""
WRAPPERS = (
    "rigid_envs.wrappers.ActionPenalty",
    "rigid_envs.wrappers.ClipReward",
    "rigid_envs.wrappers.ScaleReward",
    "rigid_envs.wrappers.SmoothnessPenalty",
    "rigid_envs.wrappers.SuccessBonus",
    "rigid_envs.wrappers.TimePenalty",
)
"""By where they are found: those of which YAML can hold the arguments."""
OF_ACTIONS = ("rigid_envs.wrappers.ActionPenalty", "rigid_envs.wrappers.SmoothnessPenalty")
"""Wrappers whose reward doesn't follow from goals: hindsight can't ask them."""
NETWORK = {
    "net_arch": widths,
    "activation": choice("tanh", "relu", "elu"),
    "log_std_init": number(),
    "least_std": number(at_least=0),
}
HINDSIGHT = {
    "n_sampled_goal": integer(1),
    "goal_selection_strategy": choice("future", "final", "episode"),
}


@dataclass(frozen=True, kw_only=True)
class TrainConfig:
    """Everything that decides a training run, but for the machine it runs on."""

    algo: ClassVar[str]
    """Name of the algorithm, as in configs/<algo>.yaml."""

    env_id: str
    """Environment id, as in RigidEnvs/Push-v0."""
    n_envs: int = setting(integer(1), 1)
    """Worlds simulated side by side."""
    n_timesteps: int = setting(integer(1))
    """Environment steps to train for, summed over worlds."""
    env_kwargs: dict[str, Any] = setting(mapping(), {})
    """Arguments of the environment: reward_type, fidelity, ..."""
    env_wrapper: Any = setting(optional(named_calls(*WRAPPERS)), None)
    """Reward wrappers of training: NAME, {NAME: {argument: value}} or a list, the innermost first;
    their vector versions are taken. Success is what it is without."""
    finish_timesteps: int = setting(integer(0), 0)
    """Of these steps so many, the last, are trained with `finish_env_kwargs` too, at least."""
    finish_env_kwargs: dict[str, Any] = setting(mapping(), {})
    """Arguments over `env_kwargs` to finish with, as a finer fidelity; they are the policy's."""
    normalize: bool = setting(flag, False)
    """Scale observations and rewards by their running mean and deviation (VecNormalize)."""
    target_success_rate: float | None = setting(optional(number(above=0, at_most=1)), None)
    """Stop early when this share of the last 1,000 (or n_envs, if more) episodes succeed; where the
    run finishes on other arguments, begin with those early, and stop when it holds there too."""
    seed: int | None = setting(optional(integer(0)), 0)
    """Seed of worlds, network and sampling; null draws one and records it."""
    policy: str = setting(choice("MultiInputPolicy"), "MultiInputPolicy")
    """Policy class of Stable-Baselines3, for observations with goals."""
    policy_kwargs: dict[str, Any] = setting(mapping(NETWORK), {})
    """Network: net_arch (hidden layer widths), log_std_init, activation, which is by default
    Stable-Baselines3's: tanh for PPO, relu for SAC; least_std of BoundedPolicy."""
    learning_rate: float | str = setting(schedule(), 3e-4)
    """Step size of the optimiser; "lin_3e-4" falls linearly to zero over the run."""
    batch_size: int = setting(integer(2), 64)
    """Transitions in one gradient step."""
    gamma: float = setting(number(above=0, at_most=1), 0.99)
    """Discount of the reward a step."""

    @classmethod
    def from_mapping(cls, env_id: str, values: Mapping[str, Any], source: str) -> Self:
        """Checks `values` and builds the settings.

        Args:
            env_id: Environment that the settings are for.
            values: Settings by name, as YAML gave them.
            source: File or place to name in errors.

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
            except Unfit as error:
                raise UsageError(
                    f"{source}: {env_id}: {key} is {value!r}, should be {error}"
                ) from None
        if "n_timesteps" not in settings:
            raise UsageError(f"{source}: {env_id}: n_timesteps is missing, should be an integer")
        config = cls(env_id=env_id, **settings)
        config._check_together(source)
        return config

    def replace(self, source: str = "command line", **values: Any) -> Self:
        """The same settings but for `values`, checked like those of a file."""
        return self.from_mapping(self.env_id, {**self.as_mapping(), **values}, source)

    @property
    def last_env_kwargs(self) -> dict[str, Any]:
        """Arguments of the environment that the run finishes on."""
        return {**self.env_kwargs, **self.finish_env_kwargs}

    def as_mapping(self) -> dict[str, Any]:
        """The settings by name, as they would stand in a file."""
        values = dataclasses.asdict(self)
        del values["env_id"]
        return values

    def as_yaml(self) -> str:
        """A file that `load_config` reads back to equal settings."""
        return yaml.safe_dump({self.env_id: self.as_mapping()}, sort_keys=False)

    def _check_together(self, source: str) -> None:
        """Raises UsageError where settings that are right alone contradict each other."""
        if bool(self.finish_timesteps) != bool(self.finish_env_kwargs):
            raise UsageError(
                f"{source}: {self.env_id}: finish_timesteps is {self.finish_timesteps} and "
                f"finish_env_kwargs is {self.finish_env_kwargs}, should be given both or neither"
            )
        if self.finish_timesteps >= self.n_timesteps:
            raise UsageError(
                f"{source}: {self.env_id}: finish_timesteps is {self.finish_timesteps}, should be "
                f"below n_timesteps = {self.n_timesteps}"
            )


@dataclass(frozen=True, kw_only=True)
class PPOConfig(TrainConfig):
    """Settings of proximal policy optimisation."""

    algo: ClassVar[str] = "ppo"

    policy: str = setting(choice("MultiInputPolicy", BOUNDED), "MultiInputPolicy")
    """Policy class; training.policies.bounded.BoundedPolicy is one for goal environments whose
    mean action stays within bounds."""
    n_steps: int = setting(integer(1), 2048)
    """Steps that each world takes between two updates."""
    n_epochs: int = setting(integer(1), 10)
    """Passes over the collected steps in an update."""
    gae_lambda: float = setting(number(at_least=0, at_most=1), 0.95)
    """Bias against variance of the advantage estimate."""
    ent_coef: float = setting(number(at_least=0), 0.0)
    """Weight of the entropy bonus."""
    vf_coef: float = setting(number(at_least=0), 0.5)
    """Weight of the value loss."""
    max_grad_norm: float = setting(number(above=0), 0.5)
    """Largest norm of a gradient; longer ones are shortened to it."""
    clip_range: float | str = setting(schedule(), 0.2)
    """Largest change of the action probability ratio that is rewarded."""
    target_kl: float | None = setting(optional(number(above=0)), None)
    """End an update when the policy has moved this far; null for no limit."""

    def _check_together(self, source: str) -> None:
        super()._check_together(source)
        if "least_std" in self.policy_kwargs and self.policy != BOUNDED:
            raise UsageError(
                f"{source}: {self.env_id}: policy_kwargs has least_std, "
                f"should go with policy: {BOUNDED}"
            )
        rollout = self.n_envs * self.n_steps
        first = -(-(self.n_timesteps - self.finish_timesteps) // rollout) * rollout
        if self.finish_timesteps and first >= self.n_timesteps:
            raise UsageError(
                f"{source}: {self.env_id}: finish_timesteps is {self.finish_timesteps}, within the "
                f"last rollout: it should be at least n_envs × n_steps = {rollout}"
            )
        if self.batch_size > rollout:
            raise UsageError(
                f"{source}: {self.env_id}: batch_size is {self.batch_size}, should be at most "
                f"n_envs × n_steps = {rollout}"
            )


@dataclass(frozen=True, kw_only=True)
class SACConfig(TrainConfig):
    """Settings of soft actor-critic, with hindsight experience replay if so configured."""

    algo: ClassVar[str] = "sac"

    policy: str = setting(choice("MultiInputPolicy", OFFSETS), "MultiInputPolicy")
    """Policy class; training.policies.offsets.OffsetPolicy is one for goal environments that sees
    how far the goal is."""
    buffer_size: int = setting(integer(1), 1_000_000)
    """Transitions that the replay buffer holds, summed over worlds."""
    learning_starts: int = setting(integer(0), 1000)
    """Steps of random actions before the first update; with hindsight, more than an episode."""
    train_freq: int = setting(integer(1), 1)
    """Steps of all worlds between two updates."""
    gradient_steps: int = setting(integer(-1), 1)
    """Gradient steps in an update; -1 for as many as transitions were collected."""
    tau: float = setting(number(above=0, at_most=1), 0.005)
    """Share of the new weights that the target network takes over at each update."""
    ent_coef: float | str = setting(entropy_coefficient, "auto")
    """Weight of the entropy bonus; "auto" learns it, "auto_0.1" from that start."""
    replay_buffer_class: str | None = setting(optional(choice("HerReplayBuffer")), None)
    """HerReplayBuffer to learn from goals reached by chance as if they had been wanted."""
    replay_buffer_kwargs: dict[str, Any] = setting(mapping(HINDSIGHT), {})
    """Of HerReplayBuffer: n_sampled_goal, goal_selection_strategy."""

    def _check_together(self, source: str) -> None:
        super()._check_together(source)
        if self.replay_buffer_kwargs and self.replay_buffer_class is None:
            raise UsageError(
                f"{source}: {self.env_id}: replay_buffer_kwargs is {self.replay_buffer_kwargs}, "
                "should go with replay_buffer_class: HerReplayBuffer"
            )
        if self.replay_buffer_class is not None and self.env_kwargs.get("guided"):
            raise UsageError(
                f"{source}: {self.env_id}: env_kwargs has guided: true, should be without: "
                "what guides is told of the goal that was, and HerReplayBuffer puts others in place"
            )
        for name, _ in calls_of(self.env_wrapper):
            if self.replay_buffer_class is not None and name in OF_ACTIONS:
                raise UsageError(
                    f"{source}: {self.env_id}: env_wrapper has {name}, should be without: "
                    "HerReplayBuffer asks for rewards of goals alone"
                )


ALGORITHMS: dict[str, type[TrainConfig]] = {kind.algo: kind for kind in (PPOConfig, SACConfig)}


def load_config(algo: str, env_id: str, path: Path | None = None) -> TrainConfig:
    """Reads the settings of an algorithm on an environment.

    Args:
        algo: "ppo" or "sac".
        env_id: Environment id, a key of the file.
        path: A YAML file; the packaged configs/<algo>.yaml if not given.

    Raises:
        UsageError: The algorithm, the environment, a key or a value is wrong.
    """
    if algo not in ALGORITHMS:
        raise UsageError(
            f"unknown algorithm {algo!r}; did you mean {nearest(algo, ALGORITHMS)!r}? "
            f"Known: {', '.join(ALGORITHMS)}"
        )
    source = str(path) if path is not None else f"configs/{algo}.yaml"
    entries = _read_yaml(path if path is not None else PACKAGED / f"{algo}.yaml", source)
    beside = {key: entries.pop(key, {}) for key in BESIDE}
    names = [str(key) for key in entries]
    for name, value in entries.items():
        alike = get_close_matches(str(name), BESIDE, 1)
        if alike or not (isinstance(value, dict) or name == env_id):
            raise UsageError(
                f"{source}: {name!r} is neither an environment id nor one of {', '.join(BESIDE)}"
                + (f"; did you mean {alike[0]!r}?" if alike else "")
            )
    if not names:
        raise UsageError(f"{source}: should be a mapping from environment ids to settings")
    for key, values in beside.items():
        if not isinstance(values, dict):
            raise UsageError(f"{source}: {key} is {values!r}, should be keyed by environment id")
        for other in values:
            if other not in entries:
                raise UsageError(
                    f"{source}: {key}: no settings for environment {other!r}; "
                    f"did you mean {nearest(str(other), names)!r}?"
                )
    if env_id not in entries:
        raise UsageError(
            f"{source}: no settings for environment {env_id!r}; "
            f"did you mean {nearest(env_id, names)!r}? It has {', '.join(names)}; "
            "settings of your own: --config FILE"
        )
    settings = entries[env_id]
    if not isinstance(settings, dict):
        raise UsageError(f"{source}: {env_id} is {settings!r}, should be a mapping of settings")
    for key, values in beside.items():
        if env_id in values:
            if key in settings:
                raise UsageError(f"{source}: {env_id}: {key} is given twice, should be given once")
            settings = {**settings, key: values[env_id]}
    return ALGORITHMS[algo].from_mapping(env_id, settings, source)


def packaged_environments(algo: str) -> list[str]:
    """Ids of the environments that an algorithm's packaged file has settings for."""
    source = f"configs/{algo}.yaml"
    return [name for name in _read_yaml(PACKAGED / f"{algo}.yaml", source) if name not in BESIDE]


def parse_settings(words: Sequence[str], source: str) -> dict[str, Any]:
    """Reads settings given as KEY:VALUE, each value as YAML has it.

    Raises:
        UsageError: A word has no key or no colon, or its value is not YAML.
    """
    settings = {}
    for word in words:
        key, colon, value = word.partition(":")
        if not key or not colon:
            raise UsageError(f"{source}: {word!r} should be KEY:VALUE")
        try:
            settings[key] = yaml.safe_load(value)
        except yaml.YAMLError:
            raise UsageError(f"{source}: {key} is {value!r}, should be a YAML value") from None
    return settings


def _read_yaml(file: Path, source: str) -> dict[Any, Any]:
    try:
        entries = yaml.safe_load(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(f"{source}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise UsageError(f"{source}: not a text file in UTF-8") from None
    except yaml.YAMLError as error:
        raise UsageError(f"{source}: not valid YAML: {' '.join(str(error).split())}") from None
    if not isinstance(entries, dict) or not entries:
        raise UsageError(f"{source}: should be a mapping from environment ids to settings")
    return entries
