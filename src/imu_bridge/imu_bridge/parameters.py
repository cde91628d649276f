"""Parameters of the node, declared once."""

from dataclasses import dataclass

from pose_common.parameters import parameter


@dataclass(frozen=True, kw_only=True)
class ImuBridgeParameters:
    """Parameters of the node ``imu_bridge``."""

    port: str = parameter(
        "/dev/ttyUSB0",
        doc="serial device of the sink, or a pyserial URL such as `socket://HOST:PORT`",
    )
    baudrate: int = parameter(
        921600, unit="bit/s", low=1200, high=4_000_000, doc="speed of a real serial device"
    )
    wait_for_port: float = parameter(
        0.0,
        unit="s",
        low=0.0,
        high=1e6,
        doc="how long to wait for a port that is not there yet; 0: fail at once",
    )
    read_period: float = parameter(
        0.01,
        unit="s",
        low=0.001,
        high=0.1,
        doc="bytes are collected for so long and handled together: latency against load",
    )
    nodes_file: str = parameter("", doc="YAML file: node id to body segment, and calibrations")
    beta: float = parameter(
        0.1,
        unit="rad/s",
        low=0.0,
        high=10.0,
        doc="gain of Madgwick's filter: trust in accelerometer and magnetometer",
    )
    gyro_bias_window: float = parameter(
        2.0,
        unit="s",
        low=0.0,
        high=60.0,
        doc="a sensor at rest for so long gives its gyroscope's bias; 0: never",
    )
    max_gap: float = parameter(
        1.0,
        unit="s",
        low=0.01,
        high=60.0,
        doc="after a longer gap in a node's samples its orientation begins anew",
    )
    max_clock_drift: float = parameter(
        1e-4, unit="s/s", low=0.0, high=0.01, doc="largest relative drift of a node's clock"
    )
    transport_delay: float = parameter(
        0.0,
        unit="s",
        low=0.0,
        high=1.0,
        doc="least delay from sampling to arrival, if it is known; taken off the stamps",
    )
    inclination_stddev: float = parameter(
        0.04, unit="rad", low=1e-4, high=3.2, doc="published uncertainty of the inclination"
    )
    heading_stddev: float = parameter(
        0.08,
        unit="rad",
        low=1e-4,
        high=3.2,
        doc="published uncertainty of the heading, once the magnetometer has given one",
    )
