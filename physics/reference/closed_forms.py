"""Closed forms of rigid motion and rigid contact, in SI units. The derivations are our own."""

import math

import numpy as np

Array = np.ndarray


def ballistic(position: Array, velocity: Array, gravity: Array, time: float) -> Array:
    """Position [3] in m after `time` s of free flight."""
    return np.asarray(position) + time * np.asarray(velocity) + 0.5 * time**2 * np.asarray(gravity)


def slide_distance(speed: float, friction: float, gravity: float) -> float:
    """Distance in m that a block slides until it stops: v^2 / (2 mu g)."""
    return speed**2 / (2.0 * friction * gravity)


def incline_acceleration(angle: float, friction: float, gravity: float) -> float:
    """Acceleration in m/s^2 of a block on an incline; zero below the friction angle."""
    return max(0.0, gravity * (math.sin(angle) - friction * math.cos(angle)))


def incline_rolling_acceleration(angle: float, friction: float, gravity: float) -> float:
    """Acceleration in m/s^2 of a solid ball on an incline of angle theta in rad.

    5/7 g sin(theta) if it rolls, which needs tan(theta) <= 3.5 mu; otherwise that of a sliding
    block.
    """
    if math.tan(angle) <= 3.5 * friction:
        return 5.0 / 7.0 * gravity * math.sin(angle)
    return incline_acceleration(angle, friction, gravity)


def rolling_speed(speed: float) -> float:
    """Final rolling speed in m/s of a solid ball that starts at `speed` m/s without spin: 5/7 v."""
    return 5.0 / 7.0 * speed


def rolling_time(speed: float, friction: float, gravity: float) -> float:
    """Time in s until a solid ball that starts without spin rolls: 2 v / (7 mu g)."""
    return 2.0 * speed / (7.0 * friction * gravity)


def rolling_distance(speed: float, length: float, radius: float, gravity: float) -> float:
    """Distance in m that a solid ball rolls until it stops.

    Rolling resistance of `length` m decelerates it by 5/7 g length / radius.
    """
    return speed**2 / (2.0 * 5.0 / 7.0 * gravity * length / radius)


def spinning_time(spin: float, length: float, radius: float, gravity: float) -> float:
    """Time in s until a solid ball that spins about the vertical at `spin` rad/s stops.

    Spinning resistance of `length` m decelerates it: 2/5 radius^2 spin / (length g).
    """
    return 0.4 * radius**2 * spin / (length * gravity)


def contact_period(mass: float, stiffness: float) -> float:
    """Duration in s of an undamped contact: half a period of the spring, pi sqrt(m / k)."""
    return math.pi * math.sqrt(mass / stiffness)


def oblique_impact(
    along: float, down: float, friction: float, restitution: float, radius: float
) -> tuple[float, float, float]:
    """Velocities after the impact of a solid ball without spin on the ground.

    The ball slides during the whole impact if along >= 3.5 mu (1 + e) down; otherwise it rolls at
    the end.

    Args:
        along: m/s, speed along the ground.
        down: m/s, speed towards the ground.
        friction: Coulomb's coefficient mu.
        restitution: e, ratio of the normal speeds after and before the impact.
        radius: m.

    Returns:
        Speed along the ground in m/s, speed away from the ground in m/s, forward spin in rad/s.
    """
    kick = min(friction * (1.0 + restitution) * down, along / 3.5)
    return along - kick, restitution * down, 2.5 * kick / radius


def resting_penetration(force: float, stiffness: float) -> float:
    """Penetration in m of a face under a load of `force` N."""
    return force / stiffness
