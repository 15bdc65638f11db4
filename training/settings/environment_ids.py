"""Environment ids: each task has an id with the sparse and one with the dense reward.

`RigidEnvs/PushDense-v0` is `RigidEnvs/Push-v0` with `reward_type="dense"` by default.
"""

import re


def plain_id(env_id: str) -> str:
    """The id of the same task without "Dense": RigidEnvs/Push-v0 for RigidEnvs/PushDense-v0.

    Other ids are returned as they are.
    """
    return re.sub(r"Dense(-v\d+)$", r"\1", env_id)


def dense_id(env_id: str) -> str:
    """The id of the same task with the dense reward: RigidEnvs/PushDense-v0.

    Returned as it is: a dense id, and an id without a version.
    """
    return re.sub(r"(?<!Dense)(-v\d+)$", r"Dense\1", env_id)


def folder_name(env_id: str) -> str:
    """An environment id as part of a folder name, as in RigidEnvs-Push-v0."""
    return env_id.replace("/", "-").replace(":", "-")
