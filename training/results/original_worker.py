"""Runs environments of another suite for `originals`, in an interpreter that has that suite.

It needs Gymnasium, NumPy and the suite, and nothing of this project. Requests and replies are
lines of JSON, on standard input and on what standard output was at the start: the suites print to
standard output. JSON gives every float64 back exactly.

A request is one of
    {"make": id, "worlds": n, "render_mode": null or "rgb_array"}
    {"reset": [seed of each world]}
    {"step": [action of each world]}
    {"render": world}
and a reply has the observations by key, or {"error": text}.
"""

import base64
import json
import os
import sys
import warnings
from typing import Any

import numpy as np

# the suite that registers the ids that begin with a word
MODULES = {"Fetch": "gymnasium_robotics", "Panda": "panda_gym"}


def make(request: dict[str, Any]) -> list[Any]:
    """The environments of a request."""
    if request["render_mode"] and sys.platform == "linux" and "DISPLAY" not in os.environ:
        os.environ.setdefault("MUJOCO_GL", "egl")  # MuJoCo draws without a display
    import gymnasium as gym

    env_id = request["make"]
    module = next(module for word, module in MODULES.items() if env_id.startswith(word))
    gym.register_envs(__import__(module))
    return [
        gym.make(env_id, **{"render_mode": mode} if (mode := request["render_mode"]) else {})
        for _ in range(request["worlds"])
    ]


def describe(env: Any) -> dict[str, Any]:
    """Spaces of an environment and versions of what it runs on."""
    from importlib.metadata import PackageNotFoundError, version

    versions = {}
    for name in ("gymnasium", "gymnasium-robotics", "mujoco", "panda-gym", "pybullet", "numpy"):
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            continue
    spaces = {**env.observation_space.spaces, "action": env.action_space}
    return {
        "spaces": {
            name: {"shape": space.shape, "dtype": str(space.dtype), "low": float(space.low.min()),
                   "high": float(space.high.max())}
            for name, space in spaces.items()
        },
        "max_episode_steps": env.spec.max_episode_steps,
        "versions": versions,
    }  # fmt: skip


def batch(observations: list[dict[str, Any]]) -> dict[str, Any]:
    """Observations of all worlds, by key."""
    return {key: [one[key].tolist() for one in observations] for key in observations[0]}


def answer(envs: list[Any], request: dict[str, Any]) -> dict[str, Any]:
    """The reply to a request, but `make`."""
    if "reset" in request:
        return batch([env.reset(seed=s)[0] for env, s in zip(envs, request["reset"], strict=True)])
    if "step" in request:
        steps = []
        for env, action in zip(envs, request["step"], strict=True):
            steps.append(env.step(np.array(action, dtype=env.action_space.dtype)))
        return {
            **batch([step[0] for step in steps]),
            "reward": [float(step[1]) for step in steps],
            "terminated": [bool(step[2]) for step in steps],
            "truncated": [bool(step[3]) for step in steps],
            "is_success": [bool(step[4]["is_success"]) for step in steps],
        }
    frame = np.ascontiguousarray(envs[request["render"]].render(), dtype=np.uint8)
    return {"shape": frame.shape, "pixels": base64.b64encode(frame.tobytes()).decode()}


def main() -> None:
    """Answers requests until the input ends."""
    replies = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what is printed goes to standard error
    warnings.filterwarnings("ignore")
    envs = []
    for line in sys.stdin:
        request = json.loads(line)
        try:
            if "make" in request:
                envs = make(request)
                reply = describe(envs[0])
            else:
                reply = answer(envs, request)
        except Exception as error:
            reply = {"error": f"{type(error).__name__}: {error}"}
        replies.write(json.dumps(reply) + "\n")
        replies.flush()


if __name__ == "__main__":
    main()
