"""Bytes received by a UART at another speed."""

import numpy as np

from pose_sim.uart import received


def test_the_right_speed_changes_nothing():
    assert received(b"bytes", 9600, 9600) == b"bytes"


def test_a_slightly_fast_clock_still_reads_every_byte():
    data = np.random.default_rng(0).bytes(300)
    assert received(data, 9600, 9800) == data


def test_half_the_speed_reads_other_bytes_and_fewer():
    data = np.random.default_rng(1).bytes(300)
    garbled = received(data, 19200, 9600)
    assert garbled not in data
    assert 50 < len(garbled) < 200


def test_twice_the_speed_reads_each_bit_twice():
    # 0x0f: start, 1111, 0000, stop. Twice as fast: start, 0, 11111111 …
    assert received(b"\x0f", 9600, 19200)[0] == 0b11111110
