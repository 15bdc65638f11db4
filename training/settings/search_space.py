"""The settings that `rigid-envs tune` searches: a table for each algorithm, and its sampling."""

from dataclasses import dataclass
from typing import Any

import optuna

from training.settings.algorithms import SACConfig
from training.settings.config import TrainConfig


@dataclass(frozen=True)
class LogUniform:
    """A number from low to high, drawn uniformly on a logarithmic scale."""

    low: float
    high: float

    def draw(self, trial: optuna.Trial, name: str) -> float:
        """Samples a value."""
        return trial.suggest_float(name, self.low, self.high, log=True)


@dataclass(frozen=True)
class OneOf:
    """One of the values."""

    values: tuple[float | str, ...]

    def draw(self, trial: optuna.Trial, name: str) -> Any:
        """Samples a value."""
        return trial.suggest_categorical(name, self.values)


SPACES: dict[str, dict[str, LogUniform | OneOf]] = {
    "ppo": {
        "learning_rate": LogUniform(1e-4, 1e-2),
        "gamma": OneOf((0.9, 0.93, 0.95, 0.97, 0.98, 0.99)),
        "n_steps": OneOf((10, 25, 50, 100)),
        "minibatches": OneOf((4, 8, 16, 32)),  # per update: n_envs × n_steps / batch_size
        "n_epochs": OneOf((2, 4, 8, 16)),
        "ent_coef": LogUniform(1e-6, 1e-2),
        "clip_range": OneOf((0.1, 0.2, 0.3, 0.4)),
        "net_arch": OneOf(("64 64", "128 128", "256 256", "64 64 64")),
    },
    "sac": {
        "learning_rate": LogUniform(1e-4, 3e-3),
        "gamma": OneOf((0.9, 0.93, 0.95, 0.97, 0.98, 0.99)),
        "batch_size": OneOf((128, 256, 512, 1024)),
        "tau": OneOf((0.005, 0.01, 0.02, 0.05, 0.08)),
        "train_freq": OneOf((1, 2, 4, 8)),
        "gradient_steps": OneOf((1, 2, 4, 8)),
        "ent_coef": OneOf(("auto", "auto_0.1", "auto_0.01")),
        "net_arch": OneOf(("64 64", "128 128", "256 256", "64 64 64")),
    },
}


def draw(config: TrainConfig, trial: optuna.Trial) -> dict[str, Any]:
    """Samples a value for each row of an algorithm's table that has an effect."""
    rows = dict(SPACES[config.algo])
    if isinstance(config, SACConfig) and config.cloning_steps:
        del rows["ent_coef"]  # there is no entropy bonus
    return {name: row.draw(trial, name) for name, row in rows.items()}


def with_drawn(config: TrainConfig, drawn: dict[str, Any]) -> TrainConfig:
    """Replaces settings by sampled values.

    Args:
        config: The settings to start from.
        drawn: Values by the names of the table, see `draw`.

    Raises:
        UsageError: A value is not valid for its setting.
    """
    changes = dict(drawn)
    widths = [int(width) for width in changes.pop("net_arch").split()]
    changes["policy_kwargs"] = {**config.policy_kwargs, "net_arch": widths}
    if "minibatches" in changes:
        rollout = config.n_envs * changes["n_steps"]
        changes["batch_size"] = max(2, rollout // changes.pop("minibatches"))
    return config.replace("search", **changes)
