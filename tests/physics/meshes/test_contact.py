"""Meshes in motion: like boxes where they are boxes; knights and bowls rest and hold things."""

import numpy as np
import pytest

from physics import Body, Box, Fidelity, Ground, Material, Mesh, Scene, Sphere, Static, World
from physics.reference import meshes

ROUGH = Material(friction=0.5, restitution=0.0)
BOX = Box((0.02, 0.02, 0.02))


def mesh_of(triangles, **settings):
    return Mesh(vertices=triangles[0], faces=triangles[1], **settings)


CUBE = mesh_of(meshes.cuboid(BOX.half_extents), cells=24)


def at(mesh, position, orientation=(0.0, 0.0, 0.0, 1.0)):
    place, turn = mesh.placed(position, orientation)
    return {"position": place, "orientation": turn, "material": ROUGH}


def alone(shape, fidelity="balanced", material=ROUGH, **state):
    """A world of one body on the ground. A cube and a box have the same kernel."""
    return World(
        Scene([Body(shape, mass=0.1, material=material, **state)], [Ground(material)]), fidelity
    )


# --- against Box ----------------------------------------------------------------------------------


def test_a_meshed_cube_slides_as_far_as_a_box():
    distance = []
    for shape in (BOX, CUBE):
        world = alone(shape, position=(0, 0, 0.01985), linear_velocity=(0.5, 0.1, 0.0))
        world.advance(1.0)
        distance.append(world.position[0, 0])
    np.testing.assert_allclose(distance[1], distance[0], atol=2e-4)
    assert distance[0][0] > 0.02


@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_a_meshed_cube_bounces_as_high_as_a_box(restitution):
    elastic = Material(friction=0.0, restitution=restitution)
    speed = []
    for shape in (BOX, CUBE):
        world = alone(shape, material=elastic, position=(0, 0, 0.1))
        world.advance(0.16)
        speed.append(world.linear_velocity[0, 0])
    np.testing.assert_allclose(speed[1], speed[0], atol=1e-9)
    assert speed[0][2] > 0.0


def spin_after_landing_on_an_edge(shape):
    world = alone(
        shape, position=(0, 0, 0.06), orientation=(0.0, 0.1736, 0.0, 0.9848),
        fidelity=Fidelity(substep=5e-4, contact_resolution=0.2),
    )  # fmt: skip
    world.advance(0.12)
    return world.angular_velocity[0, 0, 1]


def test_a_landing_on_an_edge_converges_to_that_of_a_box_with_the_cells():
    """The grid rounds edges by 1.5 cells, which shortens the lever arm of the landing."""
    exact = spin_after_landing_on_an_edge(BOX)
    errors = [
        abs(
            spin_after_landing_on_an_edge(mesh_of(meshes.cuboid(BOX.half_extents), cells=n)) - exact
        )
        for n in (12, 24, 48, 96)
    ]
    assert np.all(np.diff(errors) < 0.0)
    assert errors[-1] < 0.02 * abs(exact)


def test_particles_of_a_meshed_cube_carry_it_at_the_height_of_a_box():
    fidelity = Fidelity(geometry="particle", spacing=0.25)
    heights = []
    for shape in (BOX, CUBE):
        world = alone(shape, fidelity, position=(0, 0, 0.02))
        world.advance(0.5)
        heights.append(world.position[0, 0, 2])
    assert heights[1] == pytest.approx(heights[0], abs=1e-9)


# --- resting, rolling and holding, all in one scene, which has one kernel --------------------------

NAMES = ["bowl", "ball", *(f"cube {i}" for i in range(3)), "standing", "tipped", "large ball"]


def scene():
    bowl = mesh_of(meshes.bowl(0.05, 0.036, 32), cells=32)
    knight = mesh_of(meshes.knight(around=20, along=40), cells=32)
    slab = mesh_of(meshes.cuboid((0.1, 0.1, 0.02)), cells=24)
    bodies = [
        Body(bowl, mass=0.3, name="bowl", **at(bowl, (0, 0, 0.04))),
        Body(Sphere(0.01), mass=0.02, position=(0.02, 0, 0.04), material=ROUGH, name="ball"),
        *(
            Body(CUBE, mass=0.1, position=(0.3, 0, 0.02 + 0.04 * i), material=ROUGH, name=f"cube {i}")
            for i in range(3)
        ),
        Body(knight, mass=0.05, name="standing", **at(knight, (-0.3, 0, 0))),
        Body(
            knight, mass=0.05, name="tipped",
            **at(knight, (-0.5, 0, 0.05), (0.6, 0.1, 0.0, 0.79)),
        ),
        # far larger than the margin of the slab's grid
        Body(Sphere(0.08), mass=0.1, position=(0, 0.5, 0.12), material=ROUGH, name="large ball"),
    ]  # fmt: skip
    return Scene(bodies, [Ground(ROUGH), Static(slab, position=(0, 0.5, 0.02), material=ROUGH)])


@pytest.fixture(scope="module", params=["balanced", "solid"])
def settled(request):
    """The scene after 4 s, and the heights of all bodies in between."""
    world, heights = World(scene(), request.param), []
    for _ in range(80):
        world.advance(0.05)
        heights.append(world.position[0, :, 2].copy())
    return world, np.array(heights)


def test_a_tower_of_three_meshed_cubes_stands_where_that_of_boxes_does(settled):
    world, _ = settled
    boxes = [
        Body(BOX, mass=0.1, position=(0, 0, 0.02 + 0.04 * i), material=ROUGH) for i in range(3)
    ]
    tower = World(Scene(boxes, [Ground(ROUGH)]), world.fidelity)
    tower.advance(2.0)
    found = world.position[0, 2:5] - np.array((0.3, 0.0, 0.0))
    np.testing.assert_allclose(found, tower.position[0], atol=1e-4)
    assert np.abs(world.linear_velocity[0, 2:5]).max() < 1e-3


def test_a_ball_stays_in_a_bowl(settled):
    world, heights = settled
    bowl, ball = world.position[0, 0], world.position[0, 1]
    assert np.linalg.norm(ball[:2] - bowl[:2]) < 0.026
    assert np.all(heights[:, 1] < 0.045)
    assert np.all(heights[:, 1] > 0.012)  # it does not sink through
    # it comes to rest at the bottom
    assert np.ptp(heights[-20:, 1]) < np.ptp(heights[:20, 1])


def test_a_knight_stands(settled):
    world, heights = settled
    i = NAMES.index("standing")
    assert np.ptp(heights[10:, i]) < 5e-4
    assert np.abs(world.angular_velocity[0, i]).max() < 0.01
    assert np.linalg.norm(world.position[0, i, :2] - np.array((-0.3, 0.0))) < 2e-3


def test_a_tipped_knight_rolls_onto_its_side_and_rests(settled):
    world, heights = settled
    i = NAMES.index("tipped")
    assert heights[-1, i] < 0.015
    assert np.linalg.norm(world.linear_velocity[0, i]) < 1e-3
    assert np.linalg.norm(world.position[0, i, :2] - np.array((-0.5, 0.0))) > 0.01


def test_a_ball_larger_than_the_grid_rests_on_a_meshed_static(settled):
    world, heights = settled
    assert heights[-1, -1] == pytest.approx(0.12, abs=3e-4)
    np.testing.assert_allclose(world.position[0, -1, :2], (0.0, 0.5), atol=1e-3)


def test_momentum_is_conserved_between_two_meshes():
    """Without gravity and ground, in the kernel of the scene above but for friction on a static."""
    knight = mesh_of(meshes.knight(around=20, along=40), cells=32)
    bodies = [
        Body(knight, mass=0.05, position=(0, 0, 0), linear_velocity=(0.2, 0.01, 0), material=ROUGH),
        Body(CUBE, mass=0.1, position=(0.06, 0, 0), material=ROUGH, angular_velocity=(3, 2, 1)),
    ]
    world = World(Scene(bodies, gravity=(0, 0, 0)))
    before = momenta(world)
    world.advance(0.6)
    assert len(world.contacts().pair) == 0
    assert np.linalg.norm(world.linear_velocity[0, 1]) > 0.01
    for old, new in zip(before, momenta(world), strict=True):
        np.testing.assert_allclose(new, old, atol=1e-15)


def momenta(world):
    """Momentum in kg m/s and angular momentum about the origin in kg m^2/s."""
    from physics.rotation import rotate, rotate_back

    mass = np.array([body.mass for body in world.scene.bodies])[:, None]
    inertia = np.array([body.shape.inertia(body.mass) for body in world.scene.bodies])
    p, q = mass * world.linear_velocity[0], world.orientation[0]
    own = rotate(q, inertia * rotate_back(q, world.angular_velocity[0]))
    return p.sum(axis=0), (np.cross(world.position[0], p) + own).sum(axis=0)
