"""A scene at a fidelity as arrays: constants, state and working memory of the kernels."""
