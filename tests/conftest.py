import os

import hypothesis

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

# Random examples must not make a test's outcome depend on the speed of the machine.
hypothesis.settings.register_profile("default", deadline=None)
hypothesis.settings.register_profile("stress", deadline=None, max_examples=2000)
hypothesis.settings.load_profile("default")
