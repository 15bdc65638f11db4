"""Seeds of episodes: ranges that are far from each other, and from training, which starts at 0."""

LIMIT = 2**32
"""Seeds of runs are below this number, as NumPy requires."""
EVALUATION = 1_000_000
"""First seed of recorded results and `evaluate`."""
DATASET = 2_000_000
"""First seed of datasets."""
SEARCH = 5_000_000
"""First seed of the evaluation of a search's trials."""
TRAINING_EVALUATION = 10_000_000
"""First seed of evaluations during training."""
ORIGINAL = 20_000_000
"""First seed of recorded results in the originals of twins. `evaluate --in` plays other episodes,
so settings that were chosen after it are recorded on episodes that the choice didn't see."""
