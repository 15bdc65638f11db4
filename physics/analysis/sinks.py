"""How deep a body at rest sinks into what carries it.

A sample i that is d_i deep carries k w_i d_i, with the stiffness k of the pair and its weight w_i.
The weights of a flat side sum to 1, so it sinks by the load over k. On a round side samples stand
at different heights h_i above the lowest one, and fewer carry:

    sum w_i max(0, d - h_i) = load / k,

which grows with each sample that the depth d reaches. The weights of a mesh are lowered where a
landing would be too stiff for the step, see `model.mesh_samples`.
"""

import math

import numpy as np

from physics.meshes.support import surrounds
from physics.model.tables import Model
from physics.rotation import rotation_matrix
from physics.scene.mesh import Mesh
from physics.scene.scene import Scene
from physics.scene.shapes import PLANE

Array = np.ndarray


def depth_on_plane(heights: Array, weights: Array, compliance: float) -> float:
    """Depth in m of the lowest sample.

    Args:
        heights: [n] m, of samples above the lowest one.
        weights: [n] of their stiffness.
        compliance: m, the load over the stiffness.
    """
    order = np.argsort(heights)
    stands, shares = heights[order], np.cumsum(weights[order])
    depths = (compliance + np.cumsum(weights[order] * stands)) / shares
    # the first depth that doesn't reach the next sample
    last = int(np.argmax(depths <= np.append(stands[1:], math.inf)))
    return float(depths[last])


def rest_depth(scene: Scene, model: Model, half_pair: int, load: float) -> float:
    """Depth in m to which the owner of a half-pair sinks under a load in kg, as it first stands.

    Of a mesh on a solid that isn't a body, if what carries it surrounds its centre of mass. All
    else counts as lying on a flat side.
    """
    row, gravity = model.half_pair[half_pair], math.hypot(*scene.gravity)
    compliance = gravity * load / float(row["stiffness"])
    owner, surface = int(row["owner"]), int(row["surface"])
    if owner >= len(scene.bodies) or surface < len(model.dynamic) or gravity == 0.0:
        return compliance
    body, first = scene.bodies[owner], int(row["first_sample"])
    if not isinstance(body.shape, Mesh):
        return compliance
    samples = model.sample[:, first : first + int(row["sample_count"])]
    up = -np.array(scene.gravity) / gravity
    if int(row["kind"]) == PLANE:
        up = np.array([0.0, 0.0, 1.0])
    up = up @ rotation_matrix(np.array(body.orientation))
    heights = up @ samples[:3]
    depth = depth_on_plane(heights - heights.min(), samples[3], compliance)
    carries = heights < heights.min() + depth
    return depth if surrounds(samples[:3, carries].T, up) else compliance
