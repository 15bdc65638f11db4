"""Keypoints of pictures in NumPy: where in a picture each of a network's maps is high.

Convolutions without padding, with ReLU between them, make maps of a picture. The softmax over the
cells of a map is a distribution; its mean is the map's keypoint (x, y), from -1 to 1 over the map,
x to the right and y upwards. This is the spatial soft-argmax of Levine et al., End-to-end training
of deep visuomotor policies (2016). `pixels` has the same in torch, for training.
"""

from collections.abc import Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

Array = np.ndarray
Filter = tuple[Array, Array]
"""Weights (outputs, inputs, k, k) and biases (outputs,)."""

CHUNK_BYTES = 2**21
"""Size of the windows of the pictures that are computed together: they fit into the cache."""


def map_size(size: int, filters: Sequence[Sequence[int]]) -> int:
    """Width of the maps of pictures `size` pixels wide; below 1 if a picture is too small.

    Args:
        size: Pixels.
        filters: Outputs, kernel width and stride of each convolution.
    """
    for _, kernel, stride in filters:
        size = (size - kernel) // stride + 1
    return size


def cell_centers(count: int) -> Array:
    """Coordinates [count] of a map's cells along an axis."""
    return np.linspace(-1.0, 1.0, count) if count > 1 else np.zeros(1)


def keypoints(pictures: Array, filters: Sequence[Filter], strides: Sequence[int]) -> Array:
    """The keypoints [n, 2 maps] of pictures [n, height, width, channels]: all x, then all y.

    Sums are in float64, so that the result hardly depends on the number of pictures.

    Args:
        pictures: Values of 0 to 255.
        filters: The convolutions in order; the outputs of the last are the maps.
        strides: Of each convolution.
    """
    largest, (height, width) = 1, pictures.shape[1:3]
    for (weights, _), stride in zip(filters, strides, strict=True):
        kernel = weights.shape[-1]
        height, width = ((size - kernel) // stride + 1 for size in (height, width))
        largest = max(largest, 8 * height * width * weights[0].size)
    chunk = max(1, CHUNK_BYTES // largest)
    parts = [
        _keypoints(pictures[first : first + chunk], filters, strides)
        for first in range(0, len(pictures), chunk)
    ]
    return np.concatenate(parts) if parts else np.zeros((0, 2 * len(filters[-1][0])))


def _keypoints(pictures: Array, filters: Sequence[Filter], strides: Sequence[int]) -> Array:
    maps = pictures.astype(np.float64) / 255.0
    for number, ((weights, biases), stride) in enumerate(zip(filters, strides, strict=True)):
        if number:
            maps = np.maximum(maps, 0.0)
        width = weights.shape[-1]
        # [n, rows, columns, inputs, k, k]
        windows = sliding_window_view(maps, (width, width), axis=(1, 2))[:, ::stride, ::stride]
        n, rows, columns = windows.shape[:3]
        flat = windows.reshape(n * rows * columns, -1)
        maps = (flat @ weights.reshape(len(weights), -1).T.astype(np.float64) + biases).reshape(
            n, rows, columns, -1
        )
    rows, columns = maps.shape[1:3]
    chance = np.exp(maps - maps.max(axis=(1, 2), keepdims=True))
    chance /= chance.sum(axis=(1, 2), keepdims=True)
    x = np.einsum("nyxk,x->nk", chance, cell_centers(columns))
    y = np.einsum("nyxk,y->nk", chance, -cell_centers(rows))
    return np.concatenate([x, y], axis=1)
