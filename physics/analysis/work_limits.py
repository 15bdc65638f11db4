"""Where the work of servos can be measured: worlds side by side, in equal steps."""

from physics.scene.fidelity import Fidelity
from physics.scene.scene import Scene

INTEGRATORS = ("midpoint", "euler")


def check_work(scene: Scene, fidelity: Fidelity, engine: str) -> None:
    """Raises ValueError if the work of servos is not measured in worlds of a scene.

    `engine`: see `physics.engines`.
    """
    if not scene.drives:
        raise ValueError("measure_work needs a Drive or Gripper in Scene.drives, got none")
    if engine != "worlds":
        raise ValueError(
            f"measure_work needs engine='worlds', got {engine!r} for {len(scene.bodies)} bodies"
        )
    if fidelity.time_control != "fixed":
        raise ValueError(
            "measure_work needs Fidelity.time_control='fixed', got "
            f"{fidelity.time_control!r}, which divides steps"
        )
    if fidelity.integrator not in INTEGRATORS:
        raise ValueError(
            f"measure_work needs Fidelity.integrator in {list(INTEGRATORS)}, got "
            f"{fidelity.integrator!r}"
        )
