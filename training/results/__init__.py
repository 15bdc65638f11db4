"""Evaluation, video, learning curves and recorded results."""
