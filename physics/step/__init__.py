"""The time layers: frame, collision step, substep; threads; the readout."""
