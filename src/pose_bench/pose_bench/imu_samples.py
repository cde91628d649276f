"""A session's IMU nodes as ``imu_bridge`` would publish them."""

import numpy as np

from imu_bridge.parameters import ImuBridgeParameters
from imu_bridge.pipeline import Chunk, ImuBatch, ImuPipeline
from imu_bridge.segments import ImuNode
from pose_core.api import ImuSample
from pose_sim.captured.session import START_NS
from pose_sim.imu_file import encode_all
from pose_sim.session import Session
from pose_sim.virtual_imu import NODES

MAGNETOMETER = "start"  # as in the launch file
FILTER = "vqf"
TimedImuSample = tuple[int, ImuSample]
"""Arrival at the host [ns], and the sample."""


def processed(session: Session, parameters: ImuBridgeParameters) -> ImuBatch:
    """The bytes of a session's nodes, processed by the bridge; one sample per frame."""
    nodes = [ImuNode(node_id=node_id, segment=segment) for node_id, segment in NODES.items()]
    chunks = zip(session.imus.due_ns.tolist(), encode_all(session.imus), strict=True)
    return ImuPipeline(nodes, parameters).process(
        [Chunk(arrival_ns=due_ns, data=data) for due_ns, data in chunks]
    )


def imu_samples(session: Session, imu_filter: str = FILTER) -> list[TimedImuSample]:
    """The samples of all nodes of a session, in order of arrival.

    Args:
        session: The session.
        imu_filter: The bridge's orientation filter.
    """
    parameters = ImuBridgeParameters(filter=imu_filter, magnetometer=MAGNETOMETER)
    arrivals_ns = session.imus.due_ns.tolist()
    batch = processed(session, parameters)
    inclination = np.full(len(batch), parameters.inclination_stddev)
    stddev = np.stack([inclination, inclination, batch.heading_stddev], axis=1)
    segments = list(NODES.values())
    return [
        (
            START_NS + arrivals_ns[row],
            ImuSample(
                stamp_ns=START_NS + batch.stamp_ns[row],
                segment=segments[batch.node[row]],
                orientation=batch.orientation[row],
                orientation_stddev=stddev[row],
                angular_velocity=batch.angular_velocity[row],
                linear_acceleration=batch.acceleration[row],
            ),
        )
        for row in np.flatnonzero(~np.isnan(batch.orientation[:, 3])).tolist()
    ]
