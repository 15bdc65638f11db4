"""Heaps of particle bodies in one world: neighbour lists, packed contacts, threads."""
