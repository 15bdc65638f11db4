"""Datasets of episodes, in Minari's format: `record` plays them, `minari_store` writes them."""
