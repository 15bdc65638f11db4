"""Groups: which of many things are connected, found by uniting pair after pair (union-find)."""


class Groups:
    """Disjoint groups of integers. Each is alone in its group until it is united with another."""

    def __init__(self) -> None:
        """No two are connected yet."""
        self._parent: dict[int, int] = {}

    def of(self, member: int) -> int:
        """The group of a member: that of its members which stands for all of them."""
        root = member
        while (above := self._parent.get(root, root)) != root:
            root = above
        while (above := self._parent.get(member, member)) != root:
            self._parent[member], member = root, above
        return root

    def unite(self, one: int, other: int) -> bool:
        """Makes one group of those of two members; returns whether they were different."""
        one, other = self.of(one), self.of(other)
        self._parent[max(one, other)] = min(one, other)
        return one != other
