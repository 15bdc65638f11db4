"""General and special kernels give the same bits; what is chosen is visible."""

import numpy as np
import pytest

from physics import (
    Attractor,
    Body,
    Box,
    Capsule,
    Compound,
    Cylinder,
    Drive,
    Fidelity,
    Gripper,
    Ground,
    Hinge,
    Material,
    Mesh,
    Scene,
    Sphere,
    Static,
    Torus,
    World,
)
from physics.model.build import build
from physics.model.features import general
from physics.reference import meshes
from physics.scene.fidelity import NEWTON, PRESETS
from physics.step import kernel_choice
from rigid_envs.episodes import runner
from rigid_envs.tasks import Push

ROUGH, SMOOTH = Material(0.5, 0.1), Material(0.0, 0.5)
CUBE, SLAB = Box((0.02, 0.02, 0.02)), Box((0.02, 0.03, 0.025))


def falling(shapes, material=ROUGH, spin=(0.0, 0.0, 0.0), **more):
    bodies = [
        Body(
            shape, mass=0.1, position=(0.05 * i, 0.0, 0.04 + 0.05 * i), material=material,
            linear_velocity=(-0.3 * i, 0.01, 0.0), angular_velocity=spin,
        )
        for i, shape in enumerate(shapes)
    ]  # fmt: skip
    return Scene(bodies, [Ground(material)], **more)


def hand():
    fingers = Gripper(
        Box((0.01, 0.01, 0.02)), 0.2, 14.0, 4.0, (0.0, 0.0, 0.05), 0.1, material=ROUGH
    )
    drive = Drive(Sphere(0.015), 0.2, 5.0, (-0.1, 0.0, 0.03), material=ROUGH)
    return Scene([Body(CUBE, mass=0.1, position=(0, 0, 0.02), material=ROUGH)], [Ground(ROUGH)],
                 drives=[fingers, drive])  # fmt: skip


def wall():
    scene = falling([CUBE, Capsule(0.01, 0.02), Cylinder(0.02, 0.01)], spin=(1.0, 2.0, 3.0))
    return Scene(scene.bodies, [*scene.statics, Static(SLAB, (-0.05, 0, 0.02), material=ROUGH)])


def cube_mesh():
    vertices, faces = meshes.cuboid(CUBE.half_extents)
    return Mesh(vertices=vertices, faces=faces)


# what tests of the general kernel need: each has features that another one lacks
SCENES = {
    "cubes": falling([CUBE, CUBE]),
    "slabs": falling([SLAB, SLAB], spin=(1.0, 2.0, 3.0)),
    "smooth balls": falling([Sphere(0.02), Sphere(0.03)], SMOOTH),
    "hand": hand(),
    "wall": wall(),
    "compound": falling([Compound([(CUBE, (0, 0, 0)), (CUBE, (0, 0.03, 0))]), SLAB]),
    "mesh": falling([cube_mesh()], spin=(1.0, 2.0, 3.0)),
    "attractor": Scene([Body(SLAB, mass=0.1, position=(1, 0, 0), angular_velocity=(1, 2, 3))],
                       gravity=(0, 0, 0), fields=[Attractor((0, 0, 0), strength=1.0)]),
    "pendulum": Scene([Body(SLAB, mass=0.1, position=(0.1, 0, 1))],
                      joints=[Hinge(0, None, anchor=(0, 0, 1), axis=(0, 1, 0))]),
    "resistance": falling([Sphere(0.02)], Material(0.5, 0.1, rolling_resistance=1e-3)),
    "tori": falling([Torus(0.03, 0.01), Torus(0.03, 0.01)]),
}  # fmt: skip
SPECIAL_ONLY = ("resistance", "tori")


def advanced(world):
    """All bits of the state after a while, with drives that move at random."""
    random = np.random.default_rng(0)
    for _ in range(10):
        if world.scene.drives:
            world.command_drives(random.uniform(-0.3, 0.3, world.drive_position.shape))
        world.advance(0.04)
    state = world._simulation.state
    names = ("position", "orientation", "momentum", "angular_momentum", "force", "torque")
    return {name: state.dynamic[name].view(np.uint64) for name in names}


FIDELITIES = {
    "balanced": PRESETS["balanced"],
    "solid": PRESETS["solid"],
    "dashpot": Fidelity(damping="dashpot"),
    "viscous": Fidelity(friction="viscous"),
    "euler": Fidelity(integrator="euler"),
    "rk4": Fidelity(integrator="rk4"),
    "adaptive": Fidelity(integrator="adaptive"),
    "halved": Fidelity(time_control="adaptive"),
    "swept": Fidelity(law="impulse", contact_resolution=1.8, time_control="swept"),
    "newton": NEWTON,
}
# of these tests that run by default; the others are those of make stress
QUICK = {("hand", "balanced"), ("slabs", "solid"), ("attractor", "adaptive")}


@pytest.mark.parametrize("fidelity", FIDELITIES)
@pytest.mark.parametrize("name", SCENES)
def test_general_kernels_give_the_bits_of_special_ones(name, fidelity, stress):
    if not stress and (name, fidelity) not in QUICK:
        pytest.skip("see make stress")
    worlds = []
    for kind in ("general", "special"):
        try:
            worlds.append(World(SCENES[name], FIDELITIES[fidelity], 3, kernel=kind))
        except ValueError as error:
            pytest.skip(str(error))
    one, other = (advanced(world) for world in worlds)
    for quantity, bits in one.items():
        np.testing.assert_array_equal(bits, other[quantity], quantity)
    if worlds[0].kernel == "general" and FIDELITIES[fidelity].integrator == "midpoint":
        np.testing.assert_array_equal(worlds[0].contacts().force, worlds[1].contacts().force)


@pytest.mark.parametrize("name", SCENES)
def test_one_general_kernel_serves_nearly_all_scenes_of_a_law(name):
    for preset, fidelity in PRESETS.items():
        more = general(build(SCENES[name], fidelity)[1])
        if name in SPECIAL_ONLY:
            assert more is None
            continue
        assert more is not None
        free = name in ("attractor", "pendulum")
        like = "pendulum" if free else "cubes"
        assert more == general(build(SCENES[like], fidelity)[1]), (name, preset)


def test_worlds_tell_which_kernel_they_have():
    cubes = SCENES["cubes"]
    assert World(cubes, kernel="special").kernel == "special"
    assert World(cubes, kernel="general").kernel == "general"
    assert "kernel='general'" in repr(World(cubes, kernel="general"))
    assert World(SCENES["tori"], kernel="general").kernel == "special"
    assert World(cubes, kernel="general").features == World(cubes, kernel="special").features
    pushed = World(cubes, kernel="special")
    pushed.apply_wrench(np.zeros((1, 2, 3)))
    assert pushed.kernel == "special"


@pytest.mark.parametrize(
    ("compiled", "count", "chosen"),
    [
        ((), 1, "general"),
        (("special",), 1, "special"),
        (("general",), 1, "general"),
        (("general", "special"), 1, "special"),
        (("general",), kernel_choice.MANY_WORLDS, "special"),
        ((), kernel_choice.MANY_WORLDS, "special"),
    ],
)
def test_by_itself_it_takes_what_is_compiled(compiled, count, chosen, monkeypatch):
    base, needed = build(SCENES["cubes"], Fidelity())
    kinds = {"special": needed, "general": general(needed)}
    there = [kinds[name] for name in compiled]
    monkeypatch.setattr(kernel_choice, "is_compiled", lambda features, *_: features in there)
    assert kernel_choice.choose("auto", needed, base, Fidelity(), count) == kinds[chosen]


@pytest.mark.parametrize(("general_there", "chosen"), [(True, "general"), (False, "special")])
def test_a_registered_task_compiles_the_special_kernel_if_there_is_none(
    general_there, chosen, monkeypatch
):
    """Its compilation is the shorter one; a custom task's general kernel serves other scenes."""
    monkeypatch.setenv("RIGID_ENVS_KERNEL", "auto")
    monkeypatch.setattr(kernel_choice, "is_compiled", lambda *_: False)
    monkeypatch.setattr(runner, "general_is_compiled", lambda *_: general_there)
    assert runner.Runner("push", 1).world.kernel == chosen
    assert runner.Runner(type("Own", (Push,), {}), 1).world.kernel == "general"


def test_snapshots_move_between_kernels():
    """The memory of contacts has other rows; what follows has the same bits."""
    scene, ends = hand(), []
    saved = World(scene, kernel="special")
    advanced(saved)
    for kind in ("special", "general"):
        world = World(scene, kernel=kind)
        world.restore(saved.snapshot())
        ends.append(advanced(world))
    again = World(scene, kernel="special")
    again.restore(world.snapshot())
    np.testing.assert_array_equal(again.position, world.position)
    for quantity, bits in ends[0].items():
        np.testing.assert_array_equal(bits, ends[1][quantity], quantity)


def test_the_default_can_be_set_by_an_environment_variable(monkeypatch):
    for kind in ("special", "general"):
        monkeypatch.setenv("RIGID_ENVS_KERNEL", kind)
        assert World(SCENES["cubes"]).kernel == kind
    monkeypatch.setenv("RIGID_ENVS_KERNEL", "fast")
    with pytest.raises(ValueError, match="RIGID_ENVS_KERNEL must be one of"):
        World(SCENES["cubes"])
    with pytest.raises(ValueError, match=r"kernel must be one of .*'special'.*, got 'small'"):
        World(SCENES["cubes"], kernel="small")
