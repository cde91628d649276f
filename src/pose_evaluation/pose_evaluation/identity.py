"""Evaluation of the tracking of identities."""

from collections import defaultdict
from collections.abc import Hashable, Iterable
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class IdentityScore:
    """Counts of identity assignments over a recording."""

    skeletons: int  # [-] skeletons of known persons
    assigned: int  # [-] of them, skeletons with an identity
    switches: int  # [-] changes of a person's identity
    wrong: int  # [-] skeletons with an identity that mostly belongs to another person

    def __add__(self, other: "IdentityScore") -> "IdentityScore":
        return IdentityScore(**{k: v + getattr(other, k) for k, v in vars(self).items()})


def score_identities(pairs: Iterable[tuple[Hashable, Hashable | None]]) -> IdentityScore:
    """Compare true persons with assigned identities.

    A switch is counted as in the CLEAR MOT metrics: whenever a person's identity differs from the
    previous one.

    Args:
        pairs: True person and assigned identity (None if none) of each skeleton, in the order of
            time.

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
    return IdentityScore(skeletons=skeletons, assigned=assigned, switches=switches, wrong=wrong)
