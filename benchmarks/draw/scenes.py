"""A picture of scenes of many bodies, side by side, after they have fallen or stood for a while."""

from pathlib import Path

import numpy as np
from PIL import Image

from physics import World
from physics.reference.many_bodies import SCENES
from rigid_envs.rendering.crowd import Crowd
from training.results.gif import palette_of

# name, bodies, simulated s
SHOWN = (("chess", 3000, 0.9), ("tori", 2000, 0.9), ("pyramid", 5000, 0.5), ("dominoes", 400, 3.0))
SIZE, GAP, COLORS = 400, 8, 256  # pixels, pixels, and colours of the PNG


def draw(path: Path) -> None:
    """Writes a PNG of two rows of two scenes."""
    picture = Image.new("RGB", (2 * SIZE + GAP, 2 * SIZE + GAP), "white")
    for n, (name, bodies, seconds) in enumerate(SHOWN):
        scene, fidelity = SCENES[name](bodies, 0)
        world = World(scene, fidelity)
        world.advance(seconds)
        frame = Crowd(world, SIZE).frame()
        place = (n % 2 * (SIZE + GAP), n // 2 * (SIZE + GAP))
        picture.paste(Image.fromarray(np.asarray(frame)), place)
    path.parent.mkdir(parents=True, exist_ok=True)
    flat = picture.quantize(palette=palette_of(picture, COLORS), dither=Image.Dither.NONE)
    flat.save(path, optimize=True)
