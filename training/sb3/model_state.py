"""The state of a model in training, as files that are read without unpickling.

    state.json    steps, updates, episodes; wall time, total and in the environments; outcomes of
                  the last episodes; states of the random number generators
    tensors.pt    networks, optimisers, statistics of VecNormalize, torch's random state; read with
                  `weights_only`, which creates only tensors and containers of tensors
    replay.npz    SAC's replay buffer

With the settings, these files restore a model that resumes training. The worlds are not saved: they
start new episodes with other seeds.
"""

import io
import json
import random
import warnings
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env import VecNormalize
from stable_baselines3.her import HerReplayBuffer

from training.sb3.demonstration_buffers import DemonstrationBuffer
from training.settings.errors import UsageError

STATE, TENSORS, REPLAY = "state.json", "tensors.pt", "replay.npz"
ROWS = ("actions", "rewards", "dones", "timeouts")
HINDSIGHT_ROWS = ("ep_start", "ep_length")
RETURN = "return"
"""Name of the reward statistics; those of observations are named observation/<key>."""


def state_files(model: BaseAlgorithm, notes: dict[str, Any]) -> dict[str, bytes]:
    """Content of state.json and tensors.pt.

    Args:
        model: The model in training.
        notes: Additional entries of state.json.
    """
    legacy: Any = np.random.get_state()  # noqa: NPY002  (Stable-Baselines3 uses it)
    state = {
        **notes,
        "steps": model.num_timesteps,
        "updates": model._n_updates,
        "episodes": model._episode_num,
        "last_episodes": [
            {key: float(value) for key, value in info.items() if key in ("r", "l", "t")}
            for info in model.ep_info_buffer or ()
        ],
        "last_successes": [bool(success) for success in model.ep_success_buffer or ()],
        # values of the last update, which belong to the next row of the learning curve
        "unlogged": [
            [name, float(value), model.logger.name_to_excluded[name]]
            for name, value in model.logger.name_to_value.items()
            if np.isscalar(value) and not isinstance(value, str)
        ],
        "demonstrations": _fingerprint(model),
        "random": {
            "python": random.getstate(),
            "numpy": [legacy[0], legacy[1].tolist(), *legacy[2:]],
            "actions": model.action_space.np_random.bit_generator.state,
        },
    }
    variables = model._get_torch_save_params()[1]
    tensors = {
        "parameters": model.get_parameters(),
        "variables": {name: getattr(model, name).detach() for name in variables},
        "statistics": {
            name: {
                key: torch.as_tensor(np.asarray(getattr(one, key)))  # count too in double precision
                for key in ("mean", "var", "count")
            }
            for name, one in _statistics(model.get_vec_normalize_env()).items()
        },
        "random": torch.get_rng_state(),
    }
    # into memory first: torch reports a full disk as an internal error
    file = io.BytesIO()
    torch.save(tensors, file)
    return {STATE: json.dumps(state).encode("utf-8"), TENSORS: file.getvalue()}


def write_replay(model: BaseAlgorithm, file: Any) -> bool:
    """Writes replay.npz to an open file; returns False if the model has no replay buffer."""
    buffer = model.replay_buffer if isinstance(model, OffPolicyAlgorithm) else None
    if buffer is None:
        return False
    arrays: dict[str, Any] = {"pos": np.array(buffer.pos), "full": np.array(buffer.full)}
    if isinstance(buffer, HerReplayBuffer):
        arrays["_current_ep_start"] = buffer._current_ep_start
    for name, rows in _rows(buffer).items():
        arrays[name] = rows if buffer.full else rows[: buffer.pos]
    np.savez(file, **arrays)
    return True


def read_state(checkpoint: Path) -> dict[str, Any]:
    """Content of state.json.

    Raises:
        OSError, ValueError: It cannot be read.
    """
    state: dict[str, Any] = json.loads((checkpoint / STATE).read_text(encoding="utf-8"))
    return state


def restore(model: BaseAlgorithm, checkpoint: Path) -> None:
    """Restores the saved state into a newly built model.

    Args:
        model: A model with the same settings.
        checkpoint: Folder with the files.

    Raises:
        UsageError: The run has had other demonstrations.
        Exception: Of any type, if the files are damaged or belong to a model with other settings.
    """
    state = read_state(checkpoint)
    own = _fingerprint(model)
    if state.get("demonstrations", own) != own:
        raise UsageError(
            f"the demonstrations of {checkpoint} have been replaced by other ones: restore the "
            "dataset, or start a new run"
        )
    tensors = torch.load(checkpoint / TENSORS, map_location=model.device, weights_only=True)
    model.set_parameters(tensors["parameters"], exact_match=True, device=model.device)
    for name in model._get_torch_save_params()[1]:
        getattr(model, name).data.copy_(tensors["variables"][name])
    statistics = _statistics(model.get_vec_normalize_env())
    if tensors["statistics"].keys() != statistics.keys():
        raise ValueError(
            f"it has statistics of {sorted(tensors['statistics'])}, not of {sorted(statistics)}"
        )
    for name, one in statistics.items():
        saved = tensors["statistics"][name]
        one.mean, one.var = saved["mean"].cpu().numpy(), saved["var"].cpu().numpy()
        one.count = float(saved["count"])
    if isinstance(model, OffPolicyAlgorithm) and model.replay_buffer is not None:
        _read_replay(model.replay_buffer, checkpoint / REPLAY)

    model.num_timesteps, model._n_updates = state["steps"], state["updates"]
    model._episode_num = state["episodes"]
    window = model._stats_window_size
    model.ep_info_buffer = deque(state["last_episodes"], maxlen=window)
    model.ep_success_buffer = deque(state["last_successes"], maxlen=window)
    assert model.env is not None
    model.env.seed(resumption_seed(model))
    generators = state["random"]
    version, numbers, gauss = generators["python"]
    random.setstate((version, tuple(numbers), gauss))
    name, keys, *rest = generators["numpy"]
    np.random.set_state((name, np.array(keys, dtype=np.uint32), *rest))  # noqa: NPY002
    model.action_space.np_random.bit_generator.state = generators["actions"]
    torch.set_rng_state(tensors["random"].cpu())


def _fingerprint(model: BaseAlgorithm) -> str | None:
    """Of the demonstrations; None without any."""
    buffer = getattr(model, "replay_buffer", None)
    return buffer.fingerprint if isinstance(buffer, DemonstrationBuffer) else None


def resumption_seed(model: BaseAlgorithm) -> int:
    """The seed of the worlds where a run resumes.

    The episodes are others than at the start of the run, but the same ones at each resumption.
    """
    numbers = np.random.SeedSequence([model.seed or 0, model.num_timesteps]).generate_state(1)
    return int(numbers[0]) // 2


def _statistics(env: VecNormalize | None) -> dict[str, Any]:
    if env is None:
        return {}
    if not env.norm_obs:
        return {RETURN: env.ret_rms}
    assert isinstance(env.obs_rms, dict)
    observations = {f"observation/{key}": one for key, one in env.obs_rms.items()}
    return {RETURN: env.ret_rms, **observations}


def _rows(buffer: ReplayBuffer) -> dict[str, np.ndarray]:
    """The buffer's arrays by name; their first axis is the transition."""
    names = ROWS + (HINDSIGHT_ROWS if isinstance(buffer, HerReplayBuffer) else ())
    rows = {name: getattr(buffer, name) for name in names}
    both: dict[str, Any] = {
        "observations": buffer.observations,
        "next_observations": buffer.next_observations,
    }
    for name, by_key in both.items():
        rows |= {f"{name}/{key}": array for key, array in by_key.items()}
    return rows


def _read_replay(buffer: ReplayBuffer, file: Path) -> None:
    with np.load(file, allow_pickle=False) as arrays:
        buffer.pos, buffer.full = int(arrays["pos"]), bool(arrays["full"])
        for name, rows in _rows(buffer).items():
            rows[: len(rows) if buffer.full else buffer.pos] = arrays[name]
        if isinstance(buffer, HerReplayBuffer):
            buffer._current_ep_start = arrays["_current_ep_start"]
            with warnings.catch_warnings():  # it warns that episodes are cut off, as intended
                warnings.simplefilter("ignore")
                buffer.truncate_last_trajectory()
