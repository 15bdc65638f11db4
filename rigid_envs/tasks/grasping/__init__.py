"""A parallel gripper, grasps, and the tasks in which it carries one object."""
