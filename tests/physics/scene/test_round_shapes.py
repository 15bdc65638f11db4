"""Cylinders, tori and particles: mass properties, samples, distances, and what is refused."""

import math

import numpy as np
import pytest

from physics import (
    Body,
    Box,
    Capsule,
    Compound,
    Cylinder,
    Drive,
    Ground,
    Particles,
    Scene,
    Sphere,
    Static,
    Torus,
)
from physics.collision.distances import cylinder_distance, torus_distance
from physics.model.rocking import facing, fastest_modes
from physics.rotation import rotation_matrix
from physics.scene import mass
from physics.scene.shapes import Shape

COIN, ROD, RING = Cylinder(0.03, 0.004), Cylinder(0.02, 0.07), Torus(0.03, 0.01)
HEXAGON = [(0.02 * math.cos(a), 0.02 * math.sin(a), 0.0) for a in np.arange(6) * math.pi / 3]
SIX = Particles(HEXAGON, 0.01)
CORNERS = 0.007 * np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
FOUR = Particles(CORNERS, 0.01)
T = Compound([(Box((0.04, 0.01, 0.015)), (0, 0, 0)), (Sphere(0.01), (0, -0.03, 0))])


def gauss(f, low, high):
    """Integral of a polynomial of low degree, or of a smooth function."""
    x, w = np.polynomial.legendre.leggauss(40)
    return 0.5 * (high - low) * float(w @ f(low + 0.5 * (high - low) * (x + 1.0)))


def disc_moments(radius_at, height):
    """Volume, and moments about x and z, of discs of a radius stacked along z."""
    area = lambda z: np.pi * radius_at(z) ** 2  # noqa: E731
    volume = gauss(area, -height, height)
    axial = gauss(lambda z: 0.5 * area(z) * radius_at(z) ** 2, -height, height)
    across = gauss(lambda z: area(z) * (0.25 * radius_at(z) ** 2 + z * z), -height, height)
    return volume, across, axial


def ring_moments(R, a):
    """The same of a torus: in u = sin of the height, rings of outer and inner radius R +- w."""

    def over(f):
        # z = a sin(t), w = a cos(t): smooth in t
        return gauss(
            lambda t: f(a * np.sin(t), a * np.cos(t)) * a * np.cos(t), -np.pi / 2, np.pi / 2
        )

    def power(k):
        return lambda w: ((R + w) ** k - (R - w) ** k) / k

    volume = over(lambda z, w: 2 * np.pi * power(2)(w))
    axial = over(lambda z, w: 2 * np.pi * power(4)(w))
    across = 0.5 * axial + over(lambda z, w: 2 * np.pi * z * z * power(2)(w))
    return volume, across, axial


@pytest.mark.parametrize(
    ("shape", "integrals"),
    [
        (Sphere(0.3), disc_moments(lambda z: np.sqrt(0.09 - z * z), 0.3)),
        (Cylinder(0.2, 0.35), disc_moments(lambda z: 0.2 + 0.0 * z, 0.35)),
        (RING, ring_moments(0.03, 0.01)),
    ],
    ids=str,
)
def test_volume_and_moments_are_the_integrals_over_the_solid(shape, integrals):
    volume, across, axial = integrals
    assert shape.volume == pytest.approx(volume, rel=1e-12)
    moments = shape.inertia(3.0) * volume / 3.0
    np.testing.assert_allclose(moments, (across, across, axial), rtol=1e-12)


def test_the_moments_of_the_other_shapes_are_the_closed_forms():
    a, b, c, r, h, m = 0.1, 0.2, 0.3, 0.05, 0.12, 3.0
    box = m / 3 * np.array([b * b + c * c, a * a + c * c, a * a + b * b])
    np.testing.assert_allclose(Box((a, b, c)).inertia(m), box, rtol=1e-12)
    tube, caps = (
        disc_moments(lambda z: r + 0.0 * z, h),
        disc_moments(lambda z: np.sqrt(r * r - z * z), r),
    )
    # half spheres moved apart by h: their centres of mass are 3/8 r within
    across = tube[1] + caps[1] + caps[0] * (h * h + 2 * h * 3 / 8 * r)
    volume = tube[0] + caps[0]
    capsule = np.array([across, across, tube[2] + caps[2]]) * m / volume
    assert Capsule(r, h).volume == pytest.approx(volume, rel=1e-12)
    np.testing.assert_allclose(Capsule(r, h).inertia(m), capsule, rtol=1e-12)
    halves = Compound([(Box((a, b, c)), (-a, 0, 0)), (Box((a, b, c)), (a, 0, 0))])
    np.testing.assert_allclose(halves.inertia(m), Box((2 * a, b, c)).inertia(m), rtol=1e-12)
    d, ball = 0.2, 0.4 * m * r * r
    pair = np.array([ball, ball + m * d * d / 4, ball + m * d * d / 4])
    np.testing.assert_allclose(Particles([(0, 0, 0), (d, 0, 0)], r).inertia(m), pair, rtol=1e-12)
    one = Particles([(1.0, 2.0, 3.0)], r)
    np.testing.assert_allclose(one.inertia(m), Sphere(r).inertia(m), rtol=1e-12)
    assert one.volume == pytest.approx(Sphere(r).volume, rel=1e-12)


INSIDE = {
    "ball": (Sphere(0.3), lambda p: np.sum(p**2, axis=-1) < 0.09),
    "box": (Box((0.3, 0.24, 0.18)), lambda p: np.all(np.abs(p) < (0.3, 0.24, 0.18), axis=-1)),
    "cylinder": (
        Cylinder(0.3, 0.2),
        lambda p: (np.hypot(p[..., 0], p[..., 1]) < 0.3) & (np.abs(p[..., 2]) < 0.2),
    ),
    "torus": (
        Torus(0.2, 0.1),
        lambda p: (np.hypot(p[..., 0], p[..., 1]) - 0.2) ** 2 + p[..., 2] ** 2 < 0.01,
    ),
}


@pytest.mark.parametrize("name", INSIDE)
def test_particles_that_fill_a_solid_converge_to_it_at_first_order_or_faster(name):
    """Cells whose centre is inside. Whole errors scatter with the spacing, so many are fitted."""
    shape, inside = INSIDE[name]
    spacings, errors = [], []
    for n in (8, 11, 13, 17, 21, 27, 34, 43, 54, 68):
        axis = 0.3 * ((2.0 * np.arange(n) + 1.0) / n - 1.0)
        points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
        points = points[inside(points)]
        # balls of a cell's volume overlap: mass and inertia count each as given
        filled = mass.of_particles(points, np.full(len(points), 1.0 / len(points)), 0.0).inertia
        cell = 0.6 / n
        # of its own cube: 1/6 m a^2, which the engine's balls have as 2/5 m r^2
        moments = np.diag(filled) + cell**2 / 6.0
        volume = len(points) * cell**3
        spacings.append(cell)
        errors.append(
            max(abs(volume / shape.volume - 1.0), np.abs(moments / shape.inertia(1.0) - 1.0).max())
        )
    order = np.polyfit(np.log(spacings), np.log(np.array(errors) + 1e-16), 1)[0]
    assert errors[-1] < 0.03
    assert order > 1.0


def test_the_class_has_the_moments_of_the_particles_it_is_given():
    rng = np.random.default_rng(0)
    half = rng.normal(size=(20, 3))
    points = np.concatenate(
        [half * s for s in np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])]
    )
    shape = Particles(points + np.array([1.0, 2.0, 3.0]), 0.1)
    expected = mass.of_particles(points, np.full(80, 5.0 / 80), 0.1)
    np.testing.assert_allclose(shape.inertia(5.0), np.diag(expected.inertia), rtol=1e-12)
    np.testing.assert_allclose(np.mean(shape.positions, axis=0), 0.0, atol=1e-14)
    np.testing.assert_allclose(shape.scaled(2.0).inertia(5.0), 4.0 * shape.inertia(5.0))


@pytest.mark.parametrize("shape", [COIN, ROD, RING, SIX, FOUR], ids=str)
def test_every_shape_keeps_the_protocol(shape):
    assert isinstance(shape, Shape)
    assert 0.0 < shape.width <= 2.0 * shape.reach
    assert 0.0 < shape.volume <= 4.2 * shape.reach**3
    grown = shape.scaled(2.0)
    assert grown.reach == pytest.approx(2.0 * shape.reach)
    assert grown.volume == pytest.approx(8.0 * shape.volume)
    along, across = fastest_modes(shape, 0.5 * shape.width)
    assert 1.0 <= along < 5.0
    assert 1.0 < across < 12.0


def on_side(samples, normal, floor):
    """Weight of the samples that touch a plane at distance `floor` below the centre."""
    heights = facing(samples, normal) @ normal - samples.radius
    assert heights.min() == pytest.approx(-floor)
    return samples.weights[heights < heights.min() + 1e-9].sum()


@pytest.mark.parametrize("spacing", [0.005, 0.02])
@pytest.mark.parametrize("shape", [COIN, ROD], ids=str)
def test_face_and_side_of_a_cylinder_weigh_one_at_every_spacing_and_angle(shape, spacing):
    samples = shape.samples(spacing, 1e-3)
    assert on_side(samples, np.array([0.0, 0.0, 1.0]), shape.half_length) == pytest.approx(1.0)
    for angle in (0.0, 0.1, 2.0):
        normal = np.array([math.cos(angle), math.sin(angle), 0.0])
        assert on_side(samples, normal, shape.radius) == pytest.approx(1.0)
    tilted = np.array([0.6, 0.0, 0.8])
    lowest = 0.6 * (shape.radius - 1e-3) + 0.8 * (shape.half_length - 1e-3) + 1e-3
    assert on_side(samples, tilted, lowest) == pytest.approx(1 / 8)
    rims, *balls = shape.fixed_samples(spacing, 1e-3)
    assert rims.weights[rims.positions[:, 2] > 0].sum() == pytest.approx(1.0)
    assert len(balls) == (shape is ROD)
    for row in balls:
        assert row.weights.sum() + 2 / 16 == pytest.approx(1.0)
        assert np.abs(row.positions[:, 2]).max() + row.radius < shape.half_length - 1e-3


def test_a_torus_weighs_one_flat_and_an_eighth_upright():
    samples = RING.samples(0.01, 1e-3)
    assert on_side(samples, np.array([0.0, 0.0, -1.0]), 0.01) == pytest.approx(1.0)
    assert on_side(samples, np.array([0.0, 1.0, 0.0]), 0.04) == pytest.approx(1 / 8)
    (fixed,) = RING.fixed_samples(0.01, 1e-3)
    gaps = np.linalg.norm(np.diff(fixed.positions, axis=0), axis=1)
    assert gaps.max() < RING.minor_radius
    assert fixed.weights.sum() == pytest.approx(1.0)


def test_the_flattest_side_of_particles_weighs_one():
    assert np.all(SIX.samples(0.0, 0.0).weights == 1 / 6)
    assert np.all(FOUR.samples(0.0, 0.0).weights == 1 / 3)
    assert np.all(Particles([(0, 0, 0)], 0.1).samples(0.0, 0.0).weights == 1.0)
    row = Particles([(0, 0, z) for z in range(5)], 0.5)
    assert np.all(row.samples(0.0, 0.0).weights == 1 / 5)
    lattice = np.stack(np.meshgrid(range(4), range(3), range(2)), axis=-1).reshape(-1, 3)
    assert np.all(Particles(lattice, 0.5).samples(0.0, 0.0).weights == 1 / 12)


@pytest.mark.parametrize("shape", [COIN, ROD, RING], ids=str)
def test_particles_cover_the_shape_and_stay_inside(shape):
    points, weights, radius, _ = shape.particles(0.5 * shape.width)
    top = np.abs(points[:, 2]).max() + radius
    far = np.hypot(points[:, 0], points[:, 1]).max() + radius
    assert top == pytest.approx(shape.surface(0.0).parameters[2] or shape.minor_radius)
    assert far == pytest.approx(getattr(shape, "radius", shape.reach))
    assert np.all(weights == weights[0])


def cylinder_points(radius, half, n=200):
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
    rows = [
        np.stack([r * np.cos(angle), r * np.sin(angle), 0 * angle + z], axis=-1)
        for r, z in [(radius, z) for z in np.linspace(-half, half, 121)]
        + [(r, z) for r in np.linspace(0, radius, 80) for z in (-half, half)]
    ]
    return np.concatenate(rows)


CORES = {
    "cylinder": (
        lambda *p: cylinder_distance(*p, 0.3, 0.3, 0.2, 0.0, 1e-3, False)[:4],
        cylinder_points(0.3, 0.2),
        lambda p: np.hypot(p[0], p[1]) < 0.3 and abs(p[2]) < 0.2,
    ),
    "torus": (
        lambda *p: torus_distance(*p, 0.3, 0.3, 0.0),
        cylinder_points(0.3, 0.0, 5000)[:5000],
        lambda p: False,
    ),
}


@pytest.mark.parametrize("name", CORES)
def test_distance_and_normal_agree_with_brute_force(name):
    distance, surface, within = CORES[name]
    for point in np.random.default_rng(0).uniform(-0.6, 0.6, (100, 3)):
        expected = np.sqrt(np.sum((point - surface) ** 2, axis=-1)).min()
        d, *normal = distance(*point)
        assert d == pytest.approx(-expected if within(point) else expected, abs=1e-3)
        assert np.linalg.norm(normal) == pytest.approx(1.0)
        step = 1e-6 * np.eye(3)
        slope = [(distance(*(point + s))[0] - distance(*(point - s))[0]) / 2e-6 for s in step]
        np.testing.assert_allclose(normal, slope, atol=1e-4)
    d, *normal = distance(0.0, 0.0, 0.0)
    assert np.isfinite(d)
    assert np.linalg.norm(normal) == pytest.approx(1.0)


@pytest.mark.parametrize("sharp", [False, True])
def test_a_point_inside_a_cylinder_leaves_by_the_face_it_came_through(sharp):
    for over, face, normal in (
        ((0.1, 0.0, 0.21), 3.0, (0, 0, 1)),
        ((0.1, 0.0, -0.21), -3.0, (0, 0, -1)),
        ((0.0, 0.31, 0.05), 1.0, (0, 1, 0)),
    ):
        *_, found = cylinder_distance(*over, 0.3, 0.3, 0.2, 0.0, 1e-3, sharp)
        assert found == face
        d, *out, kept = cylinder_distance(0.0, 0.25, 0.1, 0.3, 0.3, 0.2, face, 1e-3, sharp)
        assert kept == face
        np.testing.assert_allclose(out, normal, atol=1e-15)
        assert d == pytest.approx({1.0: -0.05, 3.0: -0.1, -3.0: -0.3}[face])


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (
            lambda: Cylinder(-1, 1),
            ValueError,
            r"Cylinder\.radius must be finite and above 0, got -1",
        ),
        (lambda: Cylinder(1, "a"), TypeError, r"Cylinder\.half_length must be a number, got 'a'"),
        (
            lambda: Torus(0.1, 0.1),
            ValueError,
            r"Torus\.minor_radius must be below major_radius 0\.1",
        ),
        (lambda: Torus(math.inf, 0.1), ValueError, r"Torus\.major_radius must be finite"),
        (lambda: Particles([], 0.1), ValueError, r"Particles\.positions must be at least one"),
        (lambda: Particles([(0, 0)], 0.1), ValueError, r"shape \(n, 3\), got shape \(1, 2\)"),
        (lambda: Particles("ab", 0.1), TypeError, r"Particles\.positions must be numbers \[n, 3\]"),
        (
            lambda: Particles([(0, 0, math.nan)], 1),
            ValueError,
            r"positions must be finite, got .* at 0",
        ),
        (
            lambda: Particles([(0, 0, 0)], 0.0),
            ValueError,
            r"Particles\.radius must be finite and abov",
        ),
        (lambda: Particles([(0, 0, 0), (1, 0, 0), (0, 0, 0)], 1), ValueError, r"at 0 and 2"),
        (
            lambda: Compound([(COIN, (0, 0, 0))]),
            TypeError,
            r"Part\.shape must be Sphere or Box or C",
        ),
        (
            lambda: Compound([(RING, (0, 0, 0))]),
            TypeError,
            r"Part\.shape must be Sphere or Box or C",
        ),
    ],
)
def test_bad_input_names_the_field_its_value_and_what_is_right(make, error, message):
    with pytest.raises(error, match=message):
        make()


def test_particles_askew_are_refused_with_the_rotation_that_aligns_them():
    askew = np.array([(1.0, 1.0, 0.0), (-1.0, -1.0, 0.0), (0.3, -0.3, 0.0), (-0.3, 0.3, 0.0)])
    with pytest.raises(
        ValueError, match=r"Particles\.positions must have .* by the quat"
    ) as caught:
        Particles(askew, 0.1)
    quaternion = np.array(eval(str(caught.value).split("quaternion ")[1]))
    turned = Particles(askew @ rotation_matrix(quaternion).T, 0.1)
    assert np.abs(np.diff(np.sort(turned.inertia(1.0)))).min() > 0.01


def test_scenes_of_these_shapes_come_back_from_json_and_equal_scenes_are_equal():
    shapes = (COIN, RING, SIX)
    scene = Scene(
        [Body(shape, position=(i, 0, 0)) for i, shape in enumerate(shapes)],
        [Ground(), *(Static(shape, (0, i, 0)) for i, shape in enumerate(shapes))],
        [Drive(shape, 1.0, 5.0, (0, 0, i)) for i, shape in enumerate(shapes)],
    )
    again = Scene.from_json(scene.to_json())
    assert again == scene
    assert hash(again.bodies[2].shape) == hash(SIX)
    bad = scene.to_json().replace('"minor_radius": 0.01', '"minor_radius": 0.05')
    with pytest.raises(ValueError, match=r"scene\.bodies\[1\]\.shape: Torus\.minor_radius must be"):
        Scene.from_json(bad)
