"""Parameters of the node, declared once."""

from dataclasses import dataclass

from imu_bridge.filters import FILTERS
from imu_bridge.filters.orientation_filter import FilterSettings
from pose_core.parameters import parameter


@dataclass(frozen=True, kw_only=True)
class ImuBridgeParameters(FilterSettings):
    """Parameters of the node ``imu_bridge``: the filters', and these."""

    port: str = parameter(
        "/dev/ttyUSB0",
        doc="star network: serial device of its sink, or a pyserial URL such as "
        "`socket://HOST:PORT`",
    )
    baudrate: int = parameter(
        921600, unit="bit/s", limits=(1200, 4_000_000), doc="baud rate of that port"
    )
    wait_for_port: float = parameter(
        0.0, unit="s", limits=(0.0, 1e6), doc="longest wait for a missing port; 0: fail at once"
    )
    read_period: float = parameter(
        0.01,
        unit="s",
        limits=(0.001, 0.1),
        doc="period of processing the received bytes: latency against load",
    )
    nodes_file: str = parameter("", doc="YAML file: ports, segments of the node ids, calibrations")
    filter: str = parameter(
        "vqf",
        choices=tuple(FILTERS),
        doc="orientation filter; `device`: the orientation sent by the sensor",
    )
    max_gap: float = parameter(
        0.3,
        unit="s",
        limits=(0.01, 60.0),
        doc="gap in a node's samples after which its orientation filter restarts",
    )
    max_clock_drift: float = parameter(
        1e-3, unit="s/s", limits=(0.0, 0.05), doc="largest relative drift of a node's clock"
    )
    transport_delay: float = parameter(
        0.0,
        unit="s",
        limits=(0.0, 1.0),
        doc="minimum latency from sampling to arrival, if known; subtracted from the stamps",
    )
    inclination_stddev: float = parameter(
        0.025, unit="rad", limits=(1e-4, 3.2), doc="published uncertainty of the inclination"
    )
