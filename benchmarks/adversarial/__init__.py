"""Hostile actions, resets and parameters in every task and preset: what goes wrong in 10^9 steps.

`actions` commands the drives, `measured_runner` draws parameters and measures the work of servos,
`balance` and `checks` say what is wrong, `chunk` runs a part of a combination, `failures` saves
what went wrong, `replay` shows it step by step, and `report` keeps and prints the results.
"""
