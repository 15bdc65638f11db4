"""Random scenes and arguments: each is refused with a reason, or runs and stays finite.

`families` lists sets of solids that share a kernel, `scenes` draws the values of a scene of a
family, `outcomes` builds and runs it and says what came of it, `arguments` calls constructors with
garbage.
"""
