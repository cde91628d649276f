"""Coverage-guided mutation fuzzing of readers of external data.

Each target is a function of bytes that may raise only errors for users
(:class:`~pose_core.errors.PoseError`), with a few seed inputs. An input that reaches new code is
added to the corpus and mutated later. Coverage is measured by ``sys.settrace`` in a part of the
cases.
"""

import random
import resource
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from types import FrameType
from typing import Any

from pose_core.errors import PoseError

MAX_BYTES = 65_536  # [bytes] of an input
TRACED = 8  # one in so many cases is traced, as tracing costs ten times the case
SLOW_S = 5.0  # [s] CPU time after which a case counts as hanging
MAX_GROWN_MB = 300.0  # [MB] largest growth of memory per target
KEPT = 2_000  # largest corpus of a target
INTERESTING = (
    b"1e308", b"-1e308", b"1e9999999", b"nan", b"inf", b"-0", b"0x10", b"1_0", b"\xff\xff\xff\xff",
    b"\x00\x00\x00\x80", b"\x7f", b"\n", b"\r\n", b",", b",,,,", b"\t", b"&a", b"*a", b"{",
    b"[" * 40,
    b"<<: ", b"!!python/object:os.system", b"$(", b")", b"'", b'"', b": ", b"- ", b"\xef\xbb\xbf",
    b"9" * 400, b"\xa5\x5a", b"\x55\x51",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Target:
    """A fuzz target.

    Attributes:
        name: Name in the output.
        read: Function of the bytes.
        seeds: Seed inputs.
    """

    name: str
    read: Callable[[bytes], object]
    seeds: Sequence[bytes]


@dataclass(kw_only=True)
class TargetResult:
    """Result of a target."""

    name: str
    cases: int = 0
    refused: int = 0  # with an error for users
    kept: int = 0  # inputs that reached new code
    crashes: dict[str, bytes] = field(default_factory=dict)  # by kind and place
    slowest_s: float = 0.0
    grown_mb: float = 0.0  # [MB] growth of the peak resident size


def fuzz(target: Target, cases: int, seed: int) -> TargetResult:
    """Run a target on mutated inputs.

    Args:
        target: The target.
        cases: Number of inputs.
        seed: The same seed gives the same inputs, on the same code.
    """
    rng = random.Random(f"{target.name} {seed}")
    corpus = list(target.seeds)
    outcome = TargetResult(name=target.name)
    seen: set[tuple[Any, int]] = set()
    for data in corpus:
        _run(target, data, TargetResult(name="compiling"), None)
    before_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for case in range(cases):
        data = corpus[case] if case < len(corpus) else mutated(rng.choice(corpus), rng, corpus)
        reached = seen if case % TRACED == 0 or case < len(corpus) else None
        known = len(seen)
        _run(target, data, outcome, reached)
        if len(seen) > known and len(corpus) < KEPT:
            corpus.append(data)
            outcome.kept += 1
    grown_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kb
    outcome.grown_mb = grown_kb / 1024.0
    return outcome


def _run(
    target: Target, data: bytes, outcome: TargetResult, reached: set[tuple[Any, int]] | None
) -> None:
    """Run one case."""
    outcome.cases += 1
    begin_s = time.process_time()
    if reached is not None:
        sys.settrace(_tracer(reached))
    try:
        target.read(data)
    except PoseError:
        outcome.refused += 1
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        what = f"{type(error).__name__} in {last.name}:{last.lineno}: {error}"
        outcome.crashes.setdefault(what[:160], data)
    finally:
        sys.settrace(None)
    taken_s = time.process_time() - begin_s
    outcome.slowest_s = max(outcome.slowest_s, taken_s)
    if taken_s > SLOW_S:
        outcome.crashes.setdefault(f"took {taken_s:.0f} s", data)


def _tracer(reached: set[tuple[Any, int]]) -> Callable[..., Any]:
    """Trace function that records executed lines of this project's packages."""

    def line(frame: FrameType, event: str, _argument: Any) -> Any:
        if event == "line":
            reached.add((frame.f_code, frame.f_lineno))
        return line

    def call(frame: FrameType, _event: str, _argument: Any) -> Any:
        is_ours = any(part in frame.f_code.co_filename for part in ("pose_", "_bridge"))
        return line if is_ours else None

    return call


def mutated(data: bytes, rng: random.Random, corpus: Sequence[bytes]) -> bytes:
    """Apply a few random mutations to an input."""
    changed = bytearray(data)
    for _ in range(1 << rng.randrange(4)):
        rng.choice(CHANGES)(changed, rng, corpus)
    return bytes(changed[:MAX_BYTES])


def _place(data: bytes | bytearray, rng: random.Random) -> int:
    return rng.randrange(len(data) + 1)


def _flip(data: bytearray, rng: random.Random, _corpus: Sequence[bytes]) -> None:
    if data:
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)


def _set(data: bytearray, rng: random.Random, _corpus: Sequence[bytes]) -> None:
    if data:
        data[rng.randrange(len(data))] = rng.choice((0, 1, 127, 128, 255, rng.randrange(256)))


def _cut(data: bytearray, rng: random.Random, _corpus: Sequence[bytes]) -> None:
    at = _place(data, rng)
    del data[at : at + 1 + rng.randrange(1 << rng.randrange(8))]


def _repeat(data: bytearray, rng: random.Random, _corpus: Sequence[bytes]) -> None:
    at = _place(data, rng)
    piece = data[at : at + 1 + rng.randrange(64)]
    data[at:at] = piece * min(rng.choice((1, 2, 30, 500)), MAX_BYTES // max(len(piece), 1))


def _insert(data: bytearray, rng: random.Random, _corpus: Sequence[bytes]) -> None:
    at = _place(data, rng)
    data[at:at] = rng.choice((rng.choice(INTERESTING), rng.randbytes(1 + rng.randrange(8))))


def _overwrite(data: bytearray, rng: random.Random, _corpus: Sequence[bytes]) -> None:
    at, piece = _place(data, rng), rng.choice(INTERESTING)
    data[at : at + len(piece)] = piece


def _number(data: bytearray, rng: random.Random, _corpus: Sequence[bytes]) -> None:
    """Replace four bytes by a small or large number."""
    if len(data) < 4:
        return
    at = rng.randrange(len(data) - 3)
    value = int.from_bytes(data[at : at + 4], "little")
    value = rng.choice((value + 1, value - 1, 2 * value, len(data), 1 << 31, (1 << 32) - 1, 0))
    data[at : at + 4] = (value % (1 << 32)).to_bytes(4, "little")


def _spliced(data: bytearray, rng: random.Random, corpus: Sequence[bytes]) -> None:
    other = rng.choice(corpus)
    begin = _place(other, rng)
    data[_place(data, rng) :] = other[begin:]


CHANGES = (_flip, _set, _cut, _repeat, _insert, _overwrite, _number, _spliced)
