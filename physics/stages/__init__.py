"""The stages of a step: one algorithm a file, named in order by physics/pipeline.py."""
