"""Simulation of a UART receiver whose speed differs from the sender's."""

import numpy as np

FRAME_BITS = 10  # start bit, eight data bits with the lowest first, stop bit


def received(data: bytes, sent_baud: int, read_baud: int) -> bytes:
    """The bytes that a receiver decodes; unchanged if its speed is the sender's.

    The idle line is high. The receiver waits for a falling edge and then samples the middle of each
    bit by its own clock; it ignores a stop bit that is low.

    Args:
        data: The bytes, sent without pauses.
        sent_baud: Speed of the sender [bit/s].
        read_baud: Speed of the receiver [bit/s].
    """
    if sent_baud == read_baud or not data:
        return data
    octets = np.unpackbits(np.frombuffer(data, np.uint8)[:, None], axis=1, bitorder="little")
    frames = np.ones((len(data), FRAME_BITS), dtype=bool)
    frames[:, 0] = False
    frames[:, 1:-1] = octets
    line = np.concatenate([frames.ravel(), np.ones(2 * FRAME_BITS, dtype=bool)])
    step = sent_baud / read_baud  # [sent bits] per received bit
    low = np.flatnonzero(~line)
    out = bytearray()
    position = 0.0
    while (k := int(np.searchsorted(low, np.ceil(position)))) < len(low):
        start = max(position, float(low[k]))
        middles = (start + step * (np.arange(1, 9) + 0.5)).astype(int)
        bits = line[np.minimum(middles, len(line) - 1)]
        out.append(int(np.packbits(bits, bitorder="little")[0]))
        position = start + step * (FRAME_BITS - 0.5)
    return bytes(out)
