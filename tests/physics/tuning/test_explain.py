"""explain says what is modelled and left out, and its numbers are those of the engine."""

import re

import pytest

from physics import (
    PRESETS,
    Attractor,
    Body,
    Box,
    Fidelity,
    Ground,
    Material,
    Mesh,
    Scene,
    Sphere,
    Torus,
    World,
    explain,
)
from physics.reference import meshes
from physics.reference.scenes import block_on_ground, tower
from physics.scene.fidelity import NEWTON
from physics.tuning.motion import Course, simulate

CUBE = block_on_ground(mass=0.1)


def section(text, title):
    """The lines under a title."""
    return re.search(rf"^{title}[^\n]*\n((?:  [^\n]*\n?)*)", text, re.MULTILINE)[1]


def test_the_sink_at_rest_is_the_one_that_a_world_has():
    for name in PRESETS:
        text = explain(CUBE, PRESETS[name], costs=False)
        sink = float(re.search(r"Ground.* ([\d.e-]+) mm", section(text, "Contacts"))[1])
        world = World(CUBE, name)
        world.advance(1.0)
        assert sink == pytest.approx(1e3 * (0.02 - world.position[0, 0, 2]), rel=0.02)


def test_it_says_which_kernels_there_are():
    lines = explain(CUBE, Fidelity(), costs=False).splitlines()
    assert lines[1] == "engine: worlds"
    assert lines[2].startswith(
        "kernel: compiled for this scene, or a general one, which also has: slope, lever"
    )
    ball = Body(Sphere(0.02), mass=0.1, material=Material(rolling_resistance=1e-3))
    assert "kernel: compiled for this scene; no" in explain(
        Scene([ball], [Ground()]), Fidelity(), costs=False
    )


def test_it_names_what_is_modelled_and_what_is_left_out():
    text = explain(CUBE, Fidelity(friction="viscous", damping="dashpot"), costs=False)
    assert "linear dashpots" in section(text, "Models")
    assert "bodies at rest on slopes creep" in section(text, "Leaves out")
    assert "moment of first contact" in section(text, "Leaves out")
    smooth = block_on_ground(friction=0.0)
    assert "friction: every pair has the coefficient 0" in explain(smooth, Fidelity(), costs=False)
    orbit = Scene([Body(Sphere(0.05), mass=1.0)], fields=[Attractor((1, 0, 0), 1.0)])
    text = explain(orbit, Fidelity(integrator="rk4"), costs=False)
    assert "nothing can touch" in section(text, "Leaves out")
    assert "Attractor" in section(text, "Models")
    assert "Contacts" not in text


def test_it_says_when_a_world_would_refuse():
    text = explain(CUBE, Fidelity(integrator="rk4"), costs=False)
    assert "a World refuses it: Fidelity.integrator 'rk4'" in text
    stiff = Material(0.5, 0.0, stiffness=1e8)
    scene = Scene([Body(Box((0.02, 0.02, 0.02)), mass=0.1, material=stiff)], [Ground(stiff)])
    assert "a World refuses it: Material.stiffness" in explain(scene, Fidelity(), costs=False)


def test_the_refusal_is_that_of_a_world_whatever_refuses_it():
    stiff = Material(0.5, 0.0, stiffness=3e4)
    balls = Scene([Body(Sphere(0.02), mass=0.1, material=stiff, position=(0, 0, 0.02 + 0.05 * i))
                   for i in range(20)], [Ground(stiff)])  # fmt: skip
    for scene, fidelity in (
        (CUBE, Fidelity(integrator="adaptive")), (tower(40), NEWTON), (balls, Fidelity()),
    ):  # fmt: skip
        with pytest.raises(ValueError) as error:  # noqa: PT011
            World(scene, fidelity)
        text = explain(scene, fidelity)
        assert f"a World refuses it: {error.value}" in text
        assert "Cost" not in text


def test_the_largest_step_does_not_depend_on_the_number_of_bodies():
    stiff = Material(0.5, 0.0, stiffness=3e4)
    found = set()
    for n in (12, 13, 20):
        bodies = [Body(Sphere(0.02), mass=0.1, material=stiff, position=(0, 0, 0.02 + 0.05 * i))
                  for i in range(n)]  # fmt: skip
        text = explain(Scene(bodies, [Ground(stiff)]), Fidelity(substep=0.2e-3), costs=False)
        found.add(re.search(r"stable whatever touches: ([\d.]+) ms", text)[1])
    assert len(found) == 1


def test_the_speed_that_passes_through_is_half_a_width_per_substep():
    text = explain(tower(2), Fidelity(substep=1e-3), costs=False)
    assert "faster than 20 m/s can pass through the thinnest solid, 40 mm" in text
    # the ground has no other side
    assert "pass through" not in explain(CUBE, Fidelity(substep=1e-3), costs=False)
    swept = Fidelity(law="impulse", contact_resolution=1.8, time_control="swept")
    assert "pass through" not in explain(tower(2), swept, costs=False)


def test_costs_add_up_to_the_whole():
    # as many worlds as explain takes: the memory of fewer stays in the cache
    course, wholes, substeps = Course(CUBE, 5, 0.02, 16 * 32), [], []
    for _ in range(3):
        text = section(explain(CUBE, Fidelity()), "Cost")
        costs = {line.split("  ")[1].strip():
                 float(re.search(r"([\d,]+) ns", line)[1].replace(",", ""))
                 for line in text.splitlines()}  # fmt: skip
        assert list(costs) == ["motion of bodies", "contacts", "friction", "all"]
        assert costs["all"] == pytest.approx(sum(list(costs.values())[:-1]), abs=3)
        assert costs["contacts"] > 0.0
        wholes.append(costs["all"])
        substeps.append(1e9 * simulate(course, Fidelity()).cost * Fidelity().substep)
    # other processes only make a reading longer
    assert min(wholes) == pytest.approx(min(substeps), rel=0.5)


def test_many_bodies_are_listed_by_kind():
    text = explain(tower(100), Fidelity(), costs=False)
    assert len(section(text, "Contacts").splitlines()) == 5  # two pairs


def test_a_refused_step_is_not_called_stable():
    stiff = Material(0.5, 0.0, stiffness=1e6)
    scene = Scene([Body(Box((0.02, 0.02, 0.02)), mass=0.1, material=stiff)], [Ground(stiff)])
    text = section(explain(scene, Fidelity(substep=0.05), costs=False), "Steps")
    assert "a World refuses it" in text
    assert "stable whatever" not in text
    assert "stable unless" not in text


def test_what_prevents_passing_through_is_legal():
    for law in ("spring", "impulse"):
        text = explain(tower(2), Fidelity(law=law, substep=1e-3), costs=False)
        assert ("law='impulse' with time_control='swept'" in text) == (law == "spring")
        assert "time_control='swept' prevents it" in text
    Fidelity(law="impulse", substep=1e-3, time_control="swept")


def test_impulses_name_the_contact_resolution_that_suits_them():
    soft, stiff = Fidelity(law="impulse"), Fidelity(law="impulse", contact_resolution=1.8)
    assert "contact_resolution=1.8 suits" in explain(CUBE, soft, costs=False)
    assert "suits" not in explain(CUBE, stiff, costs=False)
    newton = Fidelity(law="impulse", solver="newton")
    assert "contact_resolution=50 suits" in explain(CUBE, newton, costs=False)


def test_a_mesh_is_said_to_have_round_edges_and_a_ring_tips_where_a_rigid_one_does():
    vertices, faces = meshes.cuboid((0.015, 0.015, 0.06))
    slim = Scene([Body(Mesh(vertices=vertices, faces=faces), mass=0.1, position=(0, 0, 0.06))],
                 [Ground()])  # fmt: skip
    text = explain(slim, Fidelity(), costs=False)
    assert "sharp edges of meshes: rounded by 1.5 Mesh.cells or more" in text
    assert "Standing" not in text
    ring = Scene([Body(Torus(0.05, 0.02), mass=0.1, position=(0, 0, 0.02))], [Ground()])
    assert "tips at 68.2° if it were rigid" in explain(ring, NEWTON, costs=False)


def test_a_heavy_body_on_a_light_one_is_explained_as_a_world_warns_of_it():
    light = Body(Box((0.02,) * 3), mass=0.05, position=(0, 0, 0.02))
    heavy = Body(Box((0.02,) * 3), mass=5.0, position=(0, 0, 0.06))
    text = explain(Scene([light, heavy], [Ground()]), Fidelity(), costs=False)
    assert "a World warns: body 1 presses on body 0 with 5 kg" in text


def test_what_is_no_scene_or_no_law_says_what_would_be():
    with pytest.raises(TypeError, match="scene must be Scene, got"):
        explain([CUBE.bodies[0]], Fidelity())
    with pytest.raises(ValueError, match=r"'balanced' is a preset: physics.PRESETS\['balanced'\]"):
        Fidelity("balanced")
