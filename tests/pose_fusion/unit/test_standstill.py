from dataclasses import dataclass

from pose_core.errors import InputError
from pose_fusion.nodes.standstill import Standstill

LOOK_S = 0.2


@dataclass
class Queue:
    newest: int = 0
    has_publisher: bool = True


class Scene:
    """A node that looks five times a second; what it says."""

    def __init__(self):
        self.now_s = self.cpu_s = 0.0
        self.queues = {"left": Queue(), "right": Queue(), "imu_torso": Queue()}
        self.standstill = Standstill(self.queues, lambda: self.now_s, lambda: self.cpu_s)
        self.found = []

    def run(self, seconds, *sending):
        for _ in range(round(seconds / LOOK_S)):
            self.now_s += LOOK_S
            for name in sending:
                self.queues[name].newest += 6
            try:
                self.standstill.check()
            except InputError as error:
                self.found.append(str(error))


def test_sources_that_are_not_heard_after_a_standstill_are_found_once():
    scene = Scene()
    scene.run(3.0, "left", "right")
    scene.now_s += 8.0
    scene.queues["right"].newest += 1  # waited in the queue
    scene.run(0.2)
    assert scene.found == []
    scene.run(1.4, "left")
    assert len(scene.found) == 1
    assert scene.found[0].startswith("right not heard since this process stood still")
    scene.run(5.0, "left")
    assert len(scene.found) == 1


def test_nothing_is_found_without_a_standstill():
    scene = Scene()
    scene.run(3.0, "left", "right")
    scene.run(20.0, "left")
    assert scene.found == []


def test_a_source_that_has_ended_is_not_waited_for():
    scene = Scene()
    scene.run(3.0, "left", "right")
    scene.now_s += 8.0
    scene.queues["right"].has_publisher = False
    scene.run(5.0, "left")
    assert scene.found == []


def test_sources_that_are_heard_again_are_not_found():
    scene = Scene()
    scene.run(3.0, "left", "imu_torso")
    scene.now_s += 8.0
    scene.run(5.0, "left", "imu_torso")
    assert scene.found == []


def test_long_work_is_no_standstill():
    scene = Scene()
    scene.run(3.0, "left", "right")
    scene.now_s += 8.0
    scene.cpu_s += 7.0
    scene.run(5.0, "left")
    assert scene.found == []
