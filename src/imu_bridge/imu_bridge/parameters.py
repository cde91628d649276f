"""Parameters of the node, declared once."""

from dataclasses import dataclass

from imu_bridge.filters import FILTERS
from imu_bridge.filters.orientation_filter import MAGNETOMETER_MODES, FilterSettings
from pose_core.parameters import parameter


@dataclass(frozen=True, kw_only=True)
class ImuBridgeParameters:
    """Parameters of the node ``imu_bridge``."""

    port: str = parameter(
        "/dev/ttyUSB0",
        doc="of the star network: serial device of its sink, or a pyserial URL such as "
        "`socket://HOST:PORT`",
    )
    baudrate: int = parameter(
        921600, unit="bit/s", limits=(1200, 4_000_000), doc="speed of that port"
    )
    wait_for_port: float = parameter(
        0.0,
        unit="s",
        limits=(0.0, 1e6),
        doc="how long to wait for a port that is not there yet; 0: fail at once",
    )
    read_period: float = parameter(
        0.01,
        unit="s",
        limits=(0.001, 0.1),
        doc="bytes are collected for so long and handled together: latency against load",
    )
    nodes_file: str = parameter("", doc="YAML file: ports, node id to body segment, calibrations")
    filter: str = parameter(
        "vqf", choices=tuple(FILTERS), doc="orientation filter; `device`: what the sensor sends"
    )
    magnetometer: str = parameter(
        "auto",
        choices=MAGNETOMETER_MODES,
        doc="`start`: sets the heading, the gyroscope carries it on; `auto`: also later, where its "
        "field looks like the earth's; `on`: always; `off`: never",
    )
    acceleration_tau: float = parameter(
        FilterSettings.acceleration_tau_s,
        unit="s",
        limits=(0.05, 60.0),
        doc="`vqf`: time constant of the inclination's correction",
    )
    magnetometer_tau: float = parameter(
        FilterSettings.magnetometer_tau_s,
        unit="s",
        limits=(0.05, 600.0),
        doc="`vqf`: time constant of the heading's correction",
    )
    beta: float = parameter(
        FilterSettings.beta,
        unit="rad/s",
        limits=(0.0, 10.0),
        doc="`madgwick`: gain, trust in accelerometer and magnetometer",
    )
    gain: float = parameter(
        FilterSettings.gain, limits=(0.0, 10.0), doc="`imufusion`: gain, the same"
    )
    gyro_bias_window: float = parameter(
        FilterSettings.bias_window_s,
        unit="s",
        limits=(0.0, 60.0),
        doc="a sensor at rest for so long gives its gyroscope's bias; 0: no bias is estimated",
    )
    max_gap: float = parameter(
        0.3,
        unit="s",
        limits=(0.01, 60.0),
        doc="after a longer gap in a node's samples its orientation begins anew",
    )
    max_clock_drift: float = parameter(
        1e-3, unit="s/s", limits=(0.0, 0.05), doc="largest relative drift of a node's clock"
    )
    transport_delay: float = parameter(
        0.0,
        unit="s",
        limits=(0.0, 1.0),
        doc="least delay from sampling to arrival, if it is known; taken off the stamps",
    )
    inclination_stddev: float = parameter(
        0.025, unit="rad", limits=(1e-4, 3.2), doc="published uncertainty of the inclination"
    )
    heading_stddev: float = parameter(
        FilterSettings.heading_stddev,
        unit="rad",
        limits=(1e-4, 3.2),
        doc="published uncertainty of a heading that a good magnetic field corrects",
    )
    heading_drift: float = parameter(
        FilterSettings.heading_drift,
        unit="rad/s",
        limits=(0.0, 1.0),
        doc="by which that uncertainty grows while no field corrects it",
    )

    def filter_settings(self) -> FilterSettings:
        """What concerns the filters."""
        return FilterSettings(
            magnetometer=self.magnetometer,
            beta=self.beta,
            gain=self.gain,
            acceleration_tau_s=self.acceleration_tau,
            magnetometer_tau_s=self.magnetometer_tau,
            bias_window_s=self.gyro_bias_window,
            heading_stddev=self.heading_stddev,
            heading_drift=self.heading_drift,
        )
