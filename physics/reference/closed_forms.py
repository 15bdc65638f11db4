"""Closed forms of rigid motion and rigid contact, in SI units; own derivations."""

import math

import numpy as np

Array = np.ndarray


def ballistic(position: Array, velocity: Array, gravity: Array, time: float) -> Array:
    """Position [3] in m after `time` s of free flight."""
    return np.asarray(position) + time * np.asarray(velocity) + 0.5 * time**2 * np.asarray(gravity)


def slide_distance(speed: float, friction: float, gravity: float) -> float:
    """Way in m of a block that slides to rest: v^2 / (2 mu g)."""
    return speed**2 / (2.0 * friction * gravity)


def incline_acceleration(angle: float, friction: float, gravity: float) -> float:
    """Acceleration in m/s^2 of a block on an incline; zero below the angle of friction."""
    return max(0.0, gravity * (math.sin(angle) - friction * math.cos(angle)))


def incline_rolling_acceleration(angle: float, friction: float, gravity: float) -> float:
    """Acceleration in m/s^2 of a solid ball: 5/7 g sin(theta) if it rolls, else it slides."""
    if math.tan(angle) <= 3.5 * friction:
        return 5.0 / 7.0 * gravity * math.sin(angle)
    return incline_acceleration(angle, friction, gravity)


def rolling_speed(speed: float) -> float:
    """Speed in m/s at which a solid ball that starts without spin ends up rolling."""
    return 5.0 / 7.0 * speed


def rolling_time(speed: float, friction: float, gravity: float) -> float:
    """Time in s until that ball rolls: 2 v / (7 mu g)."""
    return 2.0 * speed / (7.0 * friction * gravity)


def rolling_distance(speed: float, length: float, radius: float, gravity: float) -> float:
    """Way in m in which a solid ball rolls to rest: resistance slows it by 5/7 g length/radius."""
    return speed**2 / (2.0 * 5.0 / 7.0 * gravity * length / radius)


def spinning_time(spin: float, length: float, radius: float, gravity: float) -> float:
    """Time in s in which a solid ball that spins about the vertical comes to rest."""
    return 0.4 * radius**2 * spin / (length * gravity)


def contact_period(mass: float, stiffness: float) -> float:
    """Time in s that an undamped contact lasts: half a period of the spring."""
    return math.pi * math.sqrt(mass / stiffness)


def oblique_impact(
    along: float, down: float, friction: float, restitution: float, radius: float
) -> tuple[float, float, float]:
    """A solid ball without spin that hits the ground.

    Args:
        along: m/s, speed along the ground.
        down: m/s, speed towards it.
        friction: Coulomb's coefficient.
        restitution: ratio of the normal speeds.
        radius: m.

    Returns:
        Speed along and away from the ground in m/s, forward spin in rad/s. The ball slides through
        the impact if along >= 3.5 mu (1 + e) down, else it leaves rolling.
    """
    kick = min(friction * (1.0 + restitution) * down, along / 3.5)
    return along - kick, restitution * down, 2.5 * kick / radius


def resting_penetration(force: float, stiffness: float) -> float:
    """Overlap in m of a face that carries `force` N."""
    return force / stiffness
