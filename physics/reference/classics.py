"""Classic problems of mechanics: rolling and spinning bodies, piles at their limit, chains.

Each function simulates a scene at a fidelity, and returns what its docstring says; the right value
and its derivation stand beside it. Bodies have 0.1 kg unless a scene says otherwise.
"""

import math

import numpy as np

from physics.reference.meshes import tube
from physics.reference.truths import GRAVITY, MASS, PATH, RADIUS, Array, Level, ring, step_near
from physics.scene.compound import Compound
from physics.scene.cylinder import Cylinder
from physics.scene.fidelity import resolve
from physics.scene.fields import Drag
from physics.scene.joints import BallJoint
from physics.scene.material import Material
from physics.scene.mesh import Mesh
from physics.scene.scene import Scene
from physics.scene.shapes import Box, Shape, Sphere
from physics.scene.solids import Body, Ground, Static
from physics.scene.torus import Torus
from physics.world import World

BRICK = (0.1, 0.05, 0.03)  # m, half extents of a brick
STONES = 9  # of the arch
# least thickness over the mean radius of an arch of nine equal stones with flat faces: the thrust
# line touches the extrados at the joints beside the crown and at the springings, and the intrados
# between (0.1075 with many stones, Milankovitch 1907)
LEAST_THICKNESS = 0.1056
EGG = (0.7, 0.3)  # radius, and depth below the centre, of the dense core of a tippe-top over radius


def energies(world: World) -> Array:
    """Energy of each world in J, with that of its contact springs."""
    total = np.asarray(world.kinetic_energy() + world.potential_energy())
    return total + world.elastic_energy() if world.fidelity.law == "spring" else total


def axis(world: World) -> Array:
    """[count, 3] the z axis of the first body."""
    x, y, z, w = world.orientation[:, 0].T
    return np.stack([2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)], axis=-1)


def overhang(level: Level, bricks: int, count: int = 48) -> float:
    """Largest overhang over that of the harmonic series at which a tower of bricks stands for 3 s.

    The k-th brick from the top may overhang by 1/(2 k) of its length: then the centre of the k
    upper ones lies over the edge below. Right: 1, by rigid bricks; a brick on soft contacts tips
    over earlier, and edges are rounded.
    """
    rough, (half, _, high) = Material(0.6, 0.0), BRICK
    tower = [
        Body(Box(BRICK), mass=MASS, position=(0.0, 0.0, high * (2 * k + 1)), material=rough)
        for k in range(bricks)
    ]
    table = Static(Box(BRICK), position=(0.0, 0.0, -high), material=rough)
    world = World(Scene(tower, [table]), level, count)
    fraction = np.linspace(0.4, 1.1, count)
    position = np.array(world.position)
    for k in range(bricks):
        below = sum(1.0 / (bricks - n) for n in range(k + 1))
        position[:, k, 0] = fraction * half * below
    world.set_state(position=position)
    world.advance(3.0)
    fell = np.abs(world.position[:, :, 2] - position[:, :, 2]).max(axis=1) > 0.5 * high
    return float(fraction[~fell].max(initial=0.0))


def arch_drop(level: Level, thickness: float, seconds: float = 3.0) -> float:
    """Largest change of height in m of the stones of a semicircular arch of 1 m mean radius.

    Right: nothing for a thickness above LEAST_THICKNESS, and the arch falls below it. The stones
    are meshes, whose edges are rounded by 1.5 cells of their grid.
    """
    rough, angle = Material(1.0, 0.0), math.pi / STONES
    corners = [(1.0 + 0.5 * a * thickness, 0.5 * b * angle) for a, b in
               ((1, -1), (1, 1), (-1, 1), (-1, -1))]  # fmt: skip
    face = [(r * math.sin(a), r * math.cos(a)) for r, a in corners]
    vertices, faces = tube(np.array([[(x, y, z) for x, z in face] for y in (-0.15, 0.15)]))
    stone = Mesh(vertices=vertices, faces=faces, cells=96)
    stones = []
    for k in range(STONES):
        half = 0.5 * angle * (k - 0.5 * (STONES - 1))
        place, turn = stone.placed((0.0, 0.0, 0.0), (0.0, math.sin(half), 0.0, math.cos(half)))
        stones.append(Body(stone, position=place, orientation=turn, material=rough))
    world = World(Scene(stones, [Ground(material=rough)]), level)
    before = world.position[0, :, 2].copy()
    world.advance(seconds)
    return float(np.abs(world.position[0, :, 2] - before).max())


def euler_disk(
    level: Level, friction: float = 1.0, angle: float = 0.4, seconds: float = 2.0
) -> tuple[float, float]:
    """Rate of precession over theory in the first 0.5 s, and energy gained over that at the start.

    A disk of 10 cm radius, inclined by `angle`, rolls on its rim about its centre, which stays.
    With d down the disk, n its normal, and the contact at r = A d - B n, rolling about the line
    through contact and centre means w = -W sin a (d - B/A n). Its angular momentum turns at W, so

        W^2 sin a (I1 cos a - I3 B/A sin a) = m g (A cos a - B sin a),

    W^2 = 4 g/(A sin a) for B = 0. Friction is zero, so it makes no difference. Right: 1, and never
    above 0.
    """
    rough, disk = Material(friction, 0.0), Cylinder(0.1, 0.005)
    rounding, (sine, cosine) = resolve(level).rounding * 0.005, (math.sin(angle), math.cos(angle))
    a = 0.1 - rounding + rounding * sine
    b = 0.005 - rounding + rounding * cosine
    across, _, along = disk.inertia(MASS)
    rate = math.sqrt(MASS * GRAVITY * (a * cosine - b * sine)
                     / (sine * (across * cosine - along * b / a * sine)))  # fmt: skip
    down, normal = np.array([cosine, 0.0, -sine]), np.array([sine, 0.0, cosine])
    body = Body(
        disk, mass=MASS, position=(0.0, 0.0, a * sine + b * cosine), material=rough,
        orientation=(0.0, math.sin(0.5 * angle), 0.0, math.cos(0.5 * angle)),
        angular_velocity=tuple(-rate * sine * (down - b / a * normal)),
    )  # fmt: skip
    world, h = World(Scene([body], [Ground(material=rough)]), level), step_near(level, 4e-3)
    start, most, angles = energies(world)[0], -math.inf, [0.0]
    for _ in range(round(seconds / h)):
        world.advance(h)
        x, y, _ = axis(world)[0]
        angles.append(math.atan2(y, x))
        most = max(most, energies(world)[0] / start - 1.0)
    steps = round(0.5 / h)
    return float(np.unwrap(angles)[steps] / (rate * h * steps)), float(most)


def hoop(level: Level) -> tuple[float, float]:
    """Period of a hoop's wobble at twice the least square of its spin, and growth at half of it.

    Both over theory. A hoop (radii R and c, p = R + c) rolls upright with the spin s. With the lean
    t and the rate of heading W, the angular momenta about the centre and rolling give

        I1 W' = -I3 s t',    (I1 + m p^2) t'' = m g R t + (I3 + m p^2) s W,

    so it is stable for s^2 > m g R I1 / (I3 (I3 + m p^2)); for a thin disk that is v^2 > g R/3.
    Right: 1 and 1.
    """
    R, c, lean, rough = 0.1, 0.01, 0.01, Material(1.0, 0.0)
    shape, p = Torus(R, c), R + c
    across, _, along = shape.inertia(MASS)
    total, top = along + MASS * p * p, MASS * GRAVITY * R
    spin = np.sqrt(np.array([2.0, 0.5]) * top * across / (along * total))
    axle = np.array([0.0, math.cos(lean), math.sin(lean)])
    half = 0.5 * (0.5 * math.pi - lean)
    arm = np.array([0.0, -R * math.sin(lean), R * math.cos(lean) + c])
    body = Body(shape, mass=MASS, position=(0.0, 0.0, arm[2]), material=rough,
                orientation=(-math.sin(half), 0.0, 0.0, math.cos(half)))  # fmt: skip
    world, h = World(Scene([body], [Ground(material=rough)]), level, 2), step_near(level, 2e-3)
    turning = spin[:, None, None] * axle
    world.set_state(angular_velocity=turning, linear_velocity=np.cross(turning, arm))
    pull = total * along / across * spin**2
    square, middle = (pull - top) / (across + MASS * p * p), pull / (pull - top) * lean
    period, growth, leans = 2.0 * math.pi / math.sqrt(square[0]), math.sqrt(-square[1]), []
    for _ in range(int(3.0 * period / h)):
        world.advance(h)
        leans.append(np.arcsin(axis(world)[:, 2]) - middle)
    sways, falls = np.array(leans).T
    k = np.flatnonzero((sways[:-1] < 0.0) & (sways[1:] >= 0.0))
    times = k + sways[k] / (sways[k] - sways[k + 1])
    n = int(np.argmax(np.abs(falls + middle[1]) > 0.15))
    grown = math.acosh(falls[n] / (lean - middle[1])) / ((n + 1) * h)
    return float(np.diff(times).mean() * h / period), grown / growth


def tippe_top(level: Level, friction: float, seconds: float = 6.0) -> tuple[float, float, float]:
    """Largest change of Jellett's invariant over its value, least cosine of lean, energy gained.

    A ball whose centre of mass lies below its own spins at 200 rad/s, tilted by 0.1. With the arm r
    of its contact from the centre of mass, J = -L . r: L' = r x F gives L' . r = 0, and r' = e n',
    with L . n' = 0 for a body of revolution. Right: 0 at any friction; it turns over; at most 0.
    """
    rough, tilt = Material(friction, 0.0), 0.1
    core, deep = EGG[0] * RADIUS, -EGG[1] * RADIUS
    egg = Compound([(Sphere(RADIUS), (0.0, 0.0, 0.0)), (Sphere(core), (0.0, 0.0, deep))])
    offset = egg.parts[0].position[2]  # type: ignore[union-attr]
    body = Body(
        egg, mass=MASS, position=(0.0, 0.0, RADIUS - offset * math.cos(tilt)), material=rough,
        orientation=(math.sin(0.5 * tilt), 0.0, 0.0, math.cos(0.5 * tilt)),
        angular_velocity=(0.0, 0.0, 200.0),
    )  # fmt: skip
    world = World(Scene([body], [Ground(material=rough)]), level)
    seen = []
    for _ in range(int(seconds / 0.01) + 1):
        n = axis(world)[0]
        arm = offset * n - np.array([0.0, 0.0, RADIUS])
        spin = world.inertia()[0, 0] @ world.angular_velocity[0, 0]
        seen.append((-spin @ arm, n[2], energies(world)[0]))
        world.advance(0.01)
    jellett, cosine, energy = np.array(seen).T
    change = np.abs(jellett / jellett[0] - 1.0).max()
    return float(change), float(cosine.min()), float(energy.max() / energy[0] - 1.0)


def loop(level: Level, count: int = 9) -> tuple[Array, bool]:
    """Heights over theory at which a smooth ball leaves a loop, and whether it stays if fast.

    It starts at the bottom with v^2 = f 5 g R, f from 0.5 to 0.9, and leaves where
    m v^2/R = m g sin a, at the height R (5 f - 2)/3 over the middle. With f = 1.01, from 5/2 R at
    rest, it stays. Right: 1 and True.
    """
    f = np.append(np.linspace(0.5, 0.9, count), 1.01)
    world, h = World(ring(0.0, GRAVITY), level, count + 1), step_near(level, 1e-3)
    position, velocity = np.zeros((count + 1, 1, 3)), np.zeros((count + 1, 1, 3))
    position[:, 0, 2] = -PATH
    velocity[:, 0, 0] = np.sqrt(5.0 * f * GRAVITY * PATH)
    world.set_state(position=position, linear_velocity=velocity)
    on, height = np.ones(count + 1, bool), np.full(count + 1, -PATH)
    round_ = np.zeros(count + 1, bool)
    for n in range(int(0.5 / h)):
        world.advance(h)
        on &= (world.normal_force(0, 1) > 0.0) | (n * h < 0.02)
        height = np.where(on & ~round_, world.position[:, 0, 2], height)
        round_ |= on & (world.position[:, 0, 0] < 0.0)
    return height[:-1] / (PATH * (5.0 * f[:-1] - 2.0) / 3.0), bool(round_[-1])


def hanging_chain(level: Level, links: int = 9, span: float = 0.6) -> float:
    """Largest distance in m of the links of a chain from the discrete catenary.

    Rods of 10 cm hang between two points of the same height. The horizontal force H is the same in
    all joints and the vertical one grows by m g a link, so the slope of link k from the middle has
    the tangent k m g/H, with H such that the lengths along the span add up. Right: 0.
    """
    k, length = np.arange(links) - 0.5 * (links - 1), 0.1

    def corners(slopes: Array) -> Array:
        steps = length * np.stack([np.cos(slopes), np.sin(slopes)], axis=-1)
        return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])

    low, high = 1e-3, 1e3
    for _ in range(100):
        middle = math.sqrt(low * high)
        short = corners(np.arctan(middle * k))[-1, 0] < span
        low, high = (low, middle) if short else (middle, high)
    right = corners(np.arctan(low * k))
    start = np.sign(k) * math.acos((span / length - 1.0) / (links - 1))
    ends, bodies = corners(start), []
    for n in range(links):
        x, z = 0.5 * (ends[n] + ends[n + 1])
        turn = (0.0, -math.sin(0.5 * start[n]), 0.0, math.cos(0.5 * start[n]))
        bodies.append(Body(Box((0.05, 0.005, 0.005)), mass=MASS, position=(x, 0.0, z),
                           orientation=turn, mask=0))  # fmt: skip
    joints = [BallJoint(n, n - 1 if n else None, (ends[n, 0], 0.0, ends[n, 1]))
              for n in range(links)]  # fmt: skip
    joints.append(BallJoint(links - 1, None, (span, 0.0, ends[-1, 1])))
    world = World(Scene(bodies, joints=joints, fields=[Drag(linear=0.3)]), level)
    world.advance(20.0)
    return float(np.abs(world.position[0][:, ::2] - 0.5 * (right[:-1] + right[1:])).max())


def wobbling_gain(level: Level, shape: Shape, friction: float, count: int = 256) -> float:
    """Most energy gained in 3 s, over m g times the reach, of plastic bodies that wobble.

    They are let fall just above the ground, turned and spinning at random. Right: below 0.
    """
    surface, random = Material(friction, 0.0), np.random.default_rng(3)
    body = Body(shape, mass=MASS, position=(0.0, 0.0, 1.02 * shape.reach), material=surface)
    world = World(Scene([body], [Ground(material=surface)]), level, count)
    turned = random.normal(size=(count, 1, 4))
    turned /= np.linalg.norm(turned, axis=2, keepdims=True)
    spins = random.normal(size=(count, 1, 3)) * (15.0, 15.0, 30.0)
    world.set_state(orientation=turned, angular_velocity=spins)
    start = energies(world)
    world.advance(3.0)
    return float((energies(world) - start).max() / (MASS * GRAVITY * shape.reach))
