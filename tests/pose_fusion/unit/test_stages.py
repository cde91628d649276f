"""How late a frame is at each stage."""

from pose_fusion.watching.stages import LatencyStages

MS = 1_000_000


def test_each_stage_has_its_own_latency():
    stages = LatencyStages()
    for stamp_ns in (10**18, 10**18 + 33 * MS):
        stages.note_taken(stamp_ns, stamp_ns + 20 * MS, stamp_ns + 22 * MS)
        stages.note_output(stamp_ns + 25 * MS)
    assert stages.as_dict() == {
        "latency_ms/capture_to_publication": "20.0, p99 20.0",
        "latency_ms/to_the_fusion": "2.0, p99 2.0",
        "latency_ms/to_the_output": "3.0, p99 3.0",
    }


def test_frames_without_an_estimate_are_discarded():
    stages = LatencyStages()
    for frame in range(1000):
        stages.note_taken(frame * MS, frame * MS, frame * MS)
    assert len(stages._taken_ns) < 20
