"""Compiled code on disk: what names it, where it is kept, and which process compiles it."""
