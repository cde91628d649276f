"""How well people keep their identities."""

from collections import defaultdict
from collections.abc import Hashable, Iterable
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class IdentityScore:
    """What became of people's identities over a recording."""

    skeletons: int  # [-] that were of a known person
    assigned: int  # [-] of them, that were given an identity
    switches: int  # [-] changes of the identity that a person is given
    wrong: int  # [-] skeletons given the identity that is mostly somebody else's
    people: int  # [-] true ones
    identities: int  # [-] that were given

    def __add__(self, other: "IdentityScore") -> "IdentityScore":
        return IdentityScore(**{k: v + getattr(other, k) for k, v in vars(self).items()})


def score_identities(pairs: Iterable[tuple[Hashable, Hashable | None]]) -> IdentityScore:
    """Compare who was seen with who they were taken for.

    A switch is counted as in the CLEAR MOT metrics: whenever a person is given another identity
    than the last time.

    Args:
        pairs: Of each skeleton, in the order of time: who it is, and the identity that it was
            given; None: none.

    References:
        Bernardin, Stiefelhagen (2008), EURASIP Journal on Image and Video Processing.
    """
    last: dict[Hashable, Hashable] = {}
    together: dict[Hashable, dict[Hashable, int]] = defaultdict(lambda: defaultdict(int))
    skeletons = assigned = switches = 0
    for person, identity in pairs:
        skeletons += 1
        if identity is None:
            last.setdefault(person, identity)
            continue
        assigned += 1
        together[identity][person] += 1
        switches += last.get(person) not in (None, identity)
        last[person] = identity
    wrong = sum(sum(each.values()) - max(each.values()) for each in together.values())
    return IdentityScore(
        skeletons=skeletons,
        assigned=assigned,
        switches=switches,
        wrong=wrong,
        people=len(last),
        identities=len(together),
    )
