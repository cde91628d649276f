"""Counters of events by reason, so that nothing is dropped silently."""

from collections import Counter


class Counters:
    """Counters by name, in the order of their declaration.

    Args:
        names: Every reason that can occur; an undeclared one is an error, so that a reader of
            ``/diagnostics`` always sees all of them, zeros included.
    """

    def __init__(self, *names: str) -> None:
        self._counts: Counter[str] = Counter(dict.fromkeys(names, 0))

    def add(self, name: str, count: int = 1) -> None:
        """Add to a declared count.

        Raises:
            KeyError: If the name was not declared.
        """
        if name not in self._counts:
            raise KeyError(f"counter '{name}' was not declared; there are {list(self._counts)}")
        self._counts[name] += count

    def __getitem__(self, name: str) -> int:
        """The count of a declared name."""
        return self._counts[name]

    def as_dict(self, prefix: str = "") -> dict[str, int]:
        """All counts by name, each behind the prefix, in declaration order."""
        return {prefix + name: count for name, count in self._counts.items()}
