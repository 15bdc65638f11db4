"""Kernels that scenes share in tests."""

import pytest

from physics.model import build
from physics.model.features import GENERAL

_PARTS = ("friction", "lever", "resistance", "plane", "sphere", "box", "capsule", "drives")


@pytest.fixture(scope="module")
def shared_kernels():
    """Kernels with the common parts of contacts: one for each law, time control and integrator.

    By default a kernel has the parts that its scene needs, and takes up to half a minute to
    compile. The tests of a module that uses this fixture are about laws of motion, which don't
    depend on what else a kernel can do: tests/physics/test_world.py compares kernels that differ
    in parts that a scene doesn't need.
    """
    needed = build._features

    def with_common_parts(scene, fidelity, model, per_world_parameters):
        features = needed(scene, fidelity, model, per_world_parameters)
        if not len(model.half_pair):
            return features
        coulomb = fidelity.friction == "coulomb"
        slope = not features.impulse and coulomb and fidelity.damping == "hunt_crossley"
        common = dict.fromkeys(_PARTS, True)
        return features._replace(**common, rotation=GENERAL, viscous=not coulomb, slope=slope)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(build, "_features", with_common_parts)
        yield
