"""The tasks: initial state, actions, observation, goal and reward terms in NumPy."""

from rigid_envs.tasks.grasping.pick_and_place import PickAndPlace
from rigid_envs.tasks.push import Push
from rigid_envs.tasks.push_t import PushT
from rigid_envs.tasks.reach import Reach
from rigid_envs.tasks.slide import Slide
from rigid_envs.tasks.stack import Stack
from rigid_envs.tasks.task import Task
from rigid_envs.tasks.throw import Throw

TASKS: dict[str, type[Task]] = {
    "pick_and_place": PickAndPlace,
    "push": Push,
    "push_t": PushT,
    "reach": Reach,
    "slide": Slide,
    "stack": Stack,
    "throw": Throw,
}

__all__ = ["TASKS", "PickAndPlace", "Push", "PushT", "Reach", "Slide", "Stack", "Task", "Throw"]
