"""Every task by name: those of this suite, and twins of other suites' environments."""

from rigid_envs.tasks import TASKS
from rigid_envs.tasks.task import Task
from rigid_envs.twins import TWINS

NAMED_TASKS: dict[str, type[Task]] = {**TASKS, **TWINS}
