"""Further truths of shaken supports, of friction at its extremes, and of grains.

Each function simulates a scene at a fidelity, and returns what its docstring says; the right value
and its derivation stand beside it.
"""

import math

import numpy as np

from physics.reference.classics import energies
from physics.reference.truths import GRAVITY, MASS, RADIUS, Array, Level, step_near
from physics.scene.drives import Drive
from physics.scene.joints import Hinge
from physics.scene.material import Material
from physics.scene.scene import Scene
from physics.scene.shapes import Box, Capsule, Shape, Sphere
from physics.scene.solids import Body, Ground, Static
from physics.world import World

GRAIN = 0.05  # m, radius of the balls in heaps


def lift_off(level: Level, count: int = 64) -> tuple[float, Array]:
    """Least acceleration over g at which a ball leaves a shaken plate, and times of flight.

    The plate moves by A sin w t, w = 30/s; e = 0. Right: 1, because the plate pulls away where
    A w^2 sin w t > g; and, over those of theory at A w^2 = 1.2 and 1.4 g, 1: the ball flies from
    there until its parabola meets the plate.
    """
    w, smooth = 30.0, Material(0.0, 0.0)
    ball = Body(Sphere(RADIUS), mass=MASS, position=(0.0, 0.0, RADIUS), material=smooth)
    plate = Drive(Box((0.1, 0.1, 0.02)), mass=100.0, force_limit=1e7, position=(0.0, 0.0, -0.02),
                  frequency=200.0, material=smooth)  # fmt: skip
    world, h = World(Scene([ball], drives=[plate]), level, count), step_near(level, 2e-3)
    commanded = np.linspace(0.8, 1.6, count) * GRAVITY / w**2
    period, times, heights, touches = 2.0 * math.pi / w, [], [], []
    for n in range(1, int(8.0 * period / h)):
        target = np.zeros((count, 1, 3))
        target[:, 0, 2] = -0.02 + commanded * math.sin(w * n * h) * min(1.0, n * h / (3.0 * period))
        world.move_drives(target, h)
        world.advance(h)
        if n * h > 4.0 * period:
            times.append(n * h)
            heights.append(world.drive_position[:, 0, 2].copy())
            touches.append(world.normal_force(0, 1) > 0.0)
    t, flies = np.array(times), ~np.array(touches)
    waves = np.stack([np.sin(w * t), np.cos(w * t), np.ones(len(t))], axis=-1)
    found = np.linalg.lstsq(waves, np.array(heights), rcond=None)[0]
    reached = np.hypot(found[0], found[1]) * w**2 / GRAVITY
    least, ratios = float(reached[flies.any(axis=0)].min()), []
    for k in (int(np.argmin(np.abs(reached - x))) for x in (1.2, 1.4)):
        leaves, phase = math.asin(1.0 / reached[k]), np.linspace(1e-3, 2.0 * math.pi, 10000)
        ball_path = math.sin(leaves) + math.cos(leaves) * phase - phase**2 / (2.0 * reached[k])
        lands = phase[np.argmax(ball_path < np.sin(leaves + phase))]
        ratios.append(flies[:, k].mean() * 2.0 * math.pi / lands)
    return least, np.array(ratios)


def upside_down(level: Level, count: int = 48) -> float:
    """Least (a w)^2 / (2 g l) of a shaken pivot on which a pendulum stands upside down for 10 s.

    l = 1 m, w = 88/s. Right: 1 (Kapitza): the fast sway -(a/l) cos(w t) sin(t) of the angle t meets
    the pivot's acceleration with a mean of (a w)^2/(2 l^2) sin t cos t, against g/l sin t. The
    amplitude a is that which the drive reaches.
    """
    w, tilt = 88.0, 0.02
    pivot = Drive(Sphere(0.01), mass=1e3, force_limit=1e9, frequency=200.0, mask=0)
    place, turn = (math.sin(tilt), 0.0, math.cos(tilt)), math.sin(0.5 * tilt)
    bob = Body(Sphere(0.02), mass=MASS, position=place, mask=0,
               orientation=(0.0, turn, 0.0, math.cos(0.5 * tilt)))  # fmt: skip
    hinge = Hinge(0, "drive 0", anchor=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0))
    world, h = (
        World(Scene([bob], drives=[pivot], joints=[hinge]), level, count),
        step_near(level, 2e-3),
    )
    reach = np.sqrt(np.linspace(0.6, 1.2, count) * 2.0 * GRAVITY) / w
    stands, low, high = np.ones(count, bool), np.full(count, 9.0), np.full(count, -9.0)
    for n in range(1, int(10.0 / h)):
        target = np.zeros((count, 1, 3))
        target[:, 0, 2] = reach * (1.0 - math.cos(w * n * h))
        world.move_drives(target, h)
        world.advance(h)
        height = world.drive_position[:, 0, 2]
        if n * h > 1.0:
            low, high = np.minimum(low, height), np.maximum(high, height)
        stands &= world.position[:, 0, 2] - height > 0.7
    return float(((0.5 * (high - low) * w) ** 2 / (2.0 * GRAVITY))[stands].min(initial=math.inf))


def jammed_rod(level: Level, count: int = 256) -> float:
    """Largest energy gained, over that at the start, of rods that slide on a rough floor at rest.

    Painleve's rod: mu = 2 is above 4/3, so at some angles a rigid rod that slides ahead of its
    centre has no or two solutions without an impact. 20 to 80 degrees, 0.5 to 8 m/s both ways.
    Right: never above 0; no force does work on it but friction.
    """
    radius, half, rough = 0.005, 0.15, Material(2.0, 0.0)
    rod = Body(Capsule(radius, half), mass=MASS, material=rough)
    world = World(Scene([rod], [Ground(material=rough)]), level, count)
    angle = np.radians(np.linspace(20.0, 80.0, count))
    position, velocity = np.zeros((count, 1, 3)), np.zeros((count, 1, 3))
    orientation = np.zeros((count, 1, 4))
    position[:, 0, 2] = radius + half * np.sin(angle)
    tilt = 0.5 * (0.5 * math.pi - angle)
    orientation[:, 0, 1], orientation[:, 0, 3] = np.sin(tilt), np.cos(tilt)
    velocity[:, 0, 0] = np.resize([0.5, -0.5, 1.0, -1.0, 3.0, -3.0, 8.0, -8.0], count)
    world.set_state(position=position, orientation=orientation, linear_velocity=velocity)
    start, h = energies(world), world.fidelity.substep
    most = np.full(count, -math.inf)
    for _ in range(int(0.4 / h)):
        world.advance(2.0 * h)
        most = np.maximum(most, energies(world) / start - 1.0)
    return float(most.max())


def spun(level: Level, shape: Shape, direction: tuple[float, float, float]) -> tuple[World, float]:
    """The world 3 s after a body on the ground began to spin at 10,000 rad/s, and energy gained.

    Right: the energy never grows. A ball keeps its spin about the vertical, because its contact has
    no arm; it rolls off with 2/7 R w of that about y once sliding ends, and speeds up by mu g t.
    """
    rough = Material(0.5, 0.0)
    spin = 1e4 * np.array(direction) / np.linalg.norm(direction)
    body = Body(shape, mass=MASS, position=(0.0, 0.0, RADIUS), material=rough,
                angular_velocity=tuple(spin))  # fmt: skip
    world = World(Scene([body], [Ground(material=rough)]), level)
    start, most = energies(world)[0], -math.inf
    for _ in range(300):
        world.advance(0.01)
        most = max(most, energies(world)[0] / start - 1.0)
    return world, float(most)


def twist_arm(level: Level, spin: float) -> float:
    """Arm of friction over half the width, of a cube that spins about the vertical on the ground.

    Right: 2 mu g arm = 2/3 a^2 times the deceleration with half the width a; the arm is at most
    sqrt(2), all load on the corners, and 0.765 under an even pressure.
    """
    rough = Material(0.5, 0.0)
    cube = Body(Box((RADIUS,) * 3), mass=MASS, position=(0.0, 0.0, RADIUS), material=rough,
                angular_velocity=(0.0, 0.0, spin))  # fmt: skip
    world = World(Scene([cube], [Ground(material=rough)]), level)
    rate = 0.5 * GRAVITY * RADIUS / (2.0 / 3.0 * RADIUS**2)
    seconds = 0.5 * spin / rate
    world.advance(seconds)
    return float((spin - world.angular_velocity[0, 0, 2]) / (rate * seconds))


def steep(level: Level, shape: Shape, friction: float, degrees: float) -> World:
    """The world a second after a body was set down on a slope, x downhill.

    Right for mu = 10 at 80 degrees: a slab stays, as tan 80 = 5.7; a ball rolls with 5/7 g sin. For
    mu = 0: g sin t, and no spin.
    """
    surface, slope = Material(friction, 0.0), math.radians(degrees)
    height = shape.half_extents[2] if isinstance(shape, Box) else RADIUS
    body = Body(shape, mass=MASS, position=(0.0, 0.0, height), material=surface)
    gravity = (GRAVITY * math.sin(slope), 0.0, -GRAVITY * math.cos(slope))
    world = World(Scene([body], [Ground(material=surface)], gravity=gravity), level)
    world.advance(1.0)
    return world


def walls(x: float, y: float, height: float, along: Material, aside: Material) -> list[Static]:
    """Four walls about the rectangle |x|, |y| in m; those across x of the first material."""
    found, thick = [], 0.5 * min(x, y)
    for side, sign in ((0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0)):
        half = [x + 2.0 * thick, y + 2.0 * thick, 0.5 * height]
        place = [0.0, 0.0, 0.5 * height]
        half[side], place[side] = thick, sign * ((x, y)[side] + thick)
        box = Box((half[0], half[1], half[2]))
        found.append(Static(box, position=tuple(place), material=(along, aside)[side]))
    return found


def grains(counts: tuple[int, int, int], radius: float, material: Material) -> list[Body]:
    """Balls of 1 kg on a lattice above the ground, jittered."""
    draw, pitch = np.random.default_rng(0), 2.25 * radius
    index = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    centre = np.array([0.5 * (counts[0] - 1), 0.5 * (counts[1] - 1), -0.5])
    places = pitch * (index - centre) + draw.uniform(-0.01, 0.01, index.shape) * radius
    return [Body(Sphere(radius), mass=1.0, position=tuple(p), material=material) for p in places]


def silo(level: Level, layers: int, friction: float = 0.5) -> tuple[float, float]:
    """Layers of nine balls whose weight the floor of a silo carries; weight that all solids do.

    The floor moves down slowly, so friction on the walls is all mobilised. Janssen (1895): in a
    square silo of the width D, the pressure p obeys dp/dz = rho g - 4 mu K p/D. It saturates at
    rho g D/(4 mu K), however high the filling is. Right: nearly the same for 10 and for 20 layers,
    D/(4 mu K) with K from 0.25 to 1: 2 to 8.5 layers; all of them without friction. The second
    is 1.
    """
    rough = Material(friction, 0.0)
    balls, width = grains((3, 3, layers), GRAIN, rough), 3.45 * GRAIN
    floor = Drive(Box((2.0 * width, 2.0 * width, GRAIN)), mass=1e4, force_limit=1e8,
                  position=(0.0, 0.0, -GRAIN), group=2, mask=1)  # fmt: skip
    tube = walls(width, width, 2.6 * GRAIN * layers, rough, rough)
    world = World(Scene(balls, tube, [floor]), level)
    world.advance(2.0)
    carried = []
    for n in range(1, 41):
        world.move_drives((0.0, 0.0, -GRAIN - 0.02 * GRAIN * n), 0.03)
        world.advance(0.03)
        if n > 15:
            found = world.contacts()
            up = found.force[:, 2] * np.where(found.pair[:, 0] < len(balls), 1.0, -1.0)
            others = found.pair.max(axis=1)
            carried.append((up[others == len(balls)].sum(), up[others >= len(balls)].sum()))
    on_floor, all_ = np.mean(carried, axis=0) / (GRAVITY * len(balls))
    return float(on_floor * layers), float(all_)


def heap(level: Level, friction: float, layers: int = 10) -> World:
    """160 plastic balls between four walls, 8 s after they were let fall.

    Right: at rest. Friction and e = 0 take energy, and nothing adds any.
    """
    rough = Material(friction, 0.0)
    balls, width = grains((4, 4, layers), GRAIN, rough), 4.5 * GRAIN
    statics: list[Ground | Static] = [Ground(material=rough)]
    statics += walls(width, width, 2.6 * GRAIN * layers, rough, rough)
    world = World(Scene(balls, statics), level)
    world.advance(8.0)
    return world


def rest_speed(world: World) -> float:
    """Root mean square speed in m/s that all kinetic energy would give the bodies of a world."""
    mass = sum(float(body.mass or 0.0) for body in world.scene.bodies)
    return float(np.sqrt(2.0 * world.kinetic_energy()[0] / mass))


def hourglass(level: Level, width: float, seconds: float) -> float:
    """Balls per second through a slot of `width` diameters, before 40 % of those that fall have.

    The slot is in the floor of a bin, two layers deep between smooth walls. Balls arch over it and
    fall freely from there, so with n balls per volume and the depth L the rate is

        n L sqrt(g) C (w - k d)^(3/2),

    with C near 1 and k from 1 to 2 (Beverloo 1961; for a hole with the power 5/2).
    """
    rough, smooth, d = Material(0.5, 0.0), Material(0.0, 0.0), 2.0 * GRAIN
    balls, reach = grains((20, 2, 14), GRAIN, rough), 11.0 * d
    half, gap, frame = 0.5 * reach, 0.5 * width * d, 0.05
    floors = [Static(Box((half, 2.0 * d, d)), position=(s * (gap + half), 0.0, -d), material=rough)
              for s in (-1.0, 1.0)]  # fmt: skip
    world = World(Scene(balls, [*floors, *walls(reach, 1.13 * d, 20.0 * d, rough, smooth)]), level)
    out = []
    for _ in range(int(seconds / frame)):
        world.advance(frame)
        out.append(int((world.position[0, :, 2] < -d).sum()))
    gone, times = np.array(out), frame * np.arange(len(out))
    steady = (gone > 0.1 * gone[-1]) & (gone <= 0.5 * gone[-1])
    return float(np.polyfit(times[steady], gone[steady], 1)[0])


def repose(level: Level, friction: float, cubes: bool = False) -> float:
    """Slope in rad of what a column of 240 balls or tilted cubes leaves when it collapses.

    It leans on a smooth wall, two layers deep between smooth walls; balls lie on balls that are
    fixed. Right: a slope below the angle of repose, which grows with friction; about 0.3 for balls
    and for cubes with the friction 0.8, with less inertia up to 0.4 and 0.7.
    """
    rough, smooth, d = Material(friction, 0.0), Material(0.0, 0.0), 2.0 * GRAIN
    random, length = np.random.default_rng(0), 26
    index = np.stack(np.meshgrid(range(10), range(2), range(12), indexing="ij"), axis=-1)
    places = 1.08 * d * (index.reshape(-1, 3) + np.array([0.0, -0.5, 1.05]))
    places += 0.01 * d * random.uniform(-1.0, 1.0, places.shape)
    shape: Shape = Box((0.6 * GRAIN,) * 3) if cubes else Sphere(GRAIN)
    bodies = [Body(shape, mass=1.0, position=tuple(p), material=rough,
                   orientation=tuple(random.normal(size=4))) for p in places]  # fmt: skip
    far = 0.5 * length * d
    statics = [Static(Box((far, 3.0 * d, d)), position=(far - GRAIN, 0.0, -d), material=rough)]
    if not cubes:
        statics = [Static(Sphere(GRAIN), position=(i * d, j * 1.08 * d, 0.0), material=rough)
                   for i in range(length) for j in (-0.5, 0.5)]  # fmt: skip
    statics.append(Static(Box((d, 4.0 * d, 60.0 * d)), position=(-d - GRAIN, 0.0, 0.0),
                          material=smooth))  # fmt: skip
    for y in (-2.1 * d, 2.1 * d):
        side = Box(((length + 3) * d, d, 60.0 * d))
        statics.append(Static(side, position=(0.0, y, 0.0), material=smooth))
    world = World(Scene(bodies, statics), level)
    world.advance(5.0)
    x, _, z = world.position[0].T
    tops = np.array([z[np.round(x / d) == k].max(initial=0.0) for k in range(length)])
    heap = np.flatnonzero(tops > 1.2 * d)
    return math.atan(-np.polyfit(heap * d, tops[heap], 1)[0]) if len(heap) > 2 else 0.0
