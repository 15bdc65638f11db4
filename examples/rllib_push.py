"""PPO of RLlib on Push: Ray's new API stack, on a vector environment with all worlds in one call.

    pip install -c constraints-ray.txt -e ".[ray]"
    python examples/rllib_push.py

With `gym_env_vectorize_mode="vector_entry_point"` RLlib makes a `RigidVectorEnv`, in autoreset mode
NEXT_STEP. What it does with observations and actions is a Python loop over the worlds, which takes
most of the time: docs/cluster.md has the measurement.
"""

# ruff: noqa: E402  (imports after the check)

from training.cluster.rllib import check_gymnasium

check_gymnasium()

import argparse
import time
from typing import Any

import numpy as np
import ray
import torch
from ray.rllib.algorithms.algorithm_config import AlgorithmConfig
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.connectors.connector_v2 import ConnectorV2
from ray.rllib.connectors.env_to_module import FlattenObservations, MeanStdFilter
from ray.rllib.core import COMPONENT_ENV_TO_MODULE_CONNECTOR
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig

SUCCESS = "success"


class ScaledRewards(ConnectorV2):
    """Multiplies rewards by a constant, so that the values that the learner fits are near one."""

    scale = 0.1

    def __call__(self, *, batch: Any, episodes: Any, **_: Any) -> Any:
        """Changes the episodes in place."""
        for episode in self.single_agent_episode_iterator(episodes):
            episode.rewards.data = self.scale * np.asarray(episode.rewards.data)
        return batch


def log_success(*, episode: Any, metrics_logger: Any, **_: Any) -> None:
    """Records whether the goal was met at the end of an episode."""
    metrics_logger.log_value(SUCCESS, float(episode.get_infos(-1)["is_success"]), window=1000)


def copy_statistics(*, algorithm: Any, **_: Any) -> None:
    """Gives the evaluation the statistics of observations: RLlib does so with processes only."""
    state = algorithm.env_runner.get_state(components=COMPONENT_ENV_TO_MODULE_CONNECTOR)
    algorithm.eval_env_runner.set_state(state)


def configured(options: argparse.Namespace) -> AlgorithmConfig:
    """The algorithm and its environment."""
    return (
        PPOConfig()
        .environment(
            "rigid_envs:RigidEnvs/Push-v0",
            env_config={"reward_type": "dense", "threads": options.threads},
            # the environment clips actions itself, for all worlds at once
            normalize_actions=False,
            clip_actions=False,
        )
        .env_runners(
            num_env_runners=options.num_env_runners,
            num_envs_per_env_runner=options.num_envs,
            gym_env_vectorize_mode="vector_entry_point",
            rollout_fragment_length=options.num_steps,
            env_to_module_connector=lambda *_, **__: [FlattenObservations(), MeanStdFilter()],
        )
        .rl_module(
            model_config=DefaultModelConfig(
                fcnet_hiddens=[64, 64],
                fcnet_activation="tanh",
                vf_share_layers=False,
                free_log_std=True,  # one standard deviation for all states
            )
        )
        .training(
            train_batch_size_per_learner=(
                options.num_envs * options.num_steps * max(options.num_env_runners, 1)
            ),
            minibatch_size=1600,
            num_epochs=4,
            lr=[[0, options.learning_rate], [options.total_steps, 1e-5]],
            gamma=0.9,
            lambda_=0.9,
            clip_param=0.2,
            use_kl_loss=False,
            vf_loss_coeff=0.5,
            vf_clip_param=float("inf"),
            grad_clip=0.5,
            learner_connector=lambda *_: ScaledRewards(),
        )
        .callbacks(on_episode_end=log_success, on_evaluate_start=copy_statistics)
        .evaluation(
            evaluation_interval=options.evaluate_every,
            evaluation_duration=options.episodes,
            evaluation_duration_unit="episodes",
            evaluation_config={"explore": False},
        )
        .debugging(seed=options.seed, log_level="ERROR")
    )


def train(options: argparse.Namespace) -> float:
    """Trains and prints the progress; returns the success rate of the last evaluation."""
    torch.set_num_threads(1)  # two are slower, and several times so if another program runs
    algorithm = configured(options).build_algo()
    start, success, steps = time.perf_counter(), 0.0, 0
    while steps < options.total_steps and success < options.stop_at:
        result = algorithm.train()
        steps = int(result["env_runners"]["num_env_steps_sampled_lifetime"])
        if result["training_iteration"] % options.evaluate_every == 0:
            success = float(result["evaluation"]["env_runners"][SUCCESS])
            seconds = time.perf_counter() - start
            print(f"{steps:>10,} steps  {seconds:6.1f} s  solved {success:6.1%}", flush=True)
    algorithm.stop()
    return success


def parse(words: list[str] | None = None) -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    for name, default, meaning in (
        ("num-envs", 256, "worlds of an env runner"),
        ("num-steps", 25, "steps of each world before an update"),
        ("num-env-runners", 0, "processes that collect; 0: the one that also learns"),
        ("threads", 2, "threads of the worlds of an env runner"),
        ("total-steps", 1_000_000, "steps of all worlds, at most"),
        ("learning-rate", 4e-3, "falls linearly to zero"),
        ("evaluate-every", 20, "updates between two evaluations"),
        ("episodes", 1000, "of an evaluation"),
        ("stop-at", 0.97, "success rate that ends training"),
        ("seed", 0, "of worlds, network and sampling"),
        ("address", "local", "of the Ray cluster; local: a new one on this machine"),
    ):
        parser.add_argument(
            f"--{name}",
            type=type(default),
            default=default,
            help=f"{meaning} (default: %(default)s)",
        )
    return parser.parse_args(words)


if __name__ == "__main__":
    options = parse()
    ray.init(options.address, log_to_driver=False)
    train(options)
