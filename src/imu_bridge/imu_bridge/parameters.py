"""Parameters of the node, declared once."""

from dataclasses import dataclass, fields

from imu_bridge.filters import FILTERS
from imu_bridge.filters.orientation_filter import MAGNETOMETER_MODES, FilterSettings
from pose_core.parameters import parameter


@dataclass(frozen=True, kw_only=True)
class ImuBridgeParameters:
    """Parameters of the node ``imu_bridge``."""

    port: str = parameter(
        "/dev/ttyUSB0",
        doc="star network: serial device of its sink, or a pyserial URL such as "
        "`socket://HOST:PORT`",
    )
    baudrate: int = parameter(
        921600, unit="bit/s", limits=(1200, 4_000_000), doc="baud rate of that port"
    )
    wait_for_port: float = parameter(
        0.0,
        unit="s",
        limits=(0.0, 1e6),
        doc="longest wait for a missing port; 0: fail at once",
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
    magnetometer: str = parameter(
        "auto",
        choices=MAGNETOMETER_MODES,
        doc="`start`: sets the initial heading, then only the gyroscope; `auto`: also later, "
        "while the field looks like the earth's; `on`: always; `off`: never",
    )
    acceleration_tau: float = parameter(
        FilterSettings.acceleration_tau,
        unit="s",
        limits=(0.05, 60.0),
        doc="`vqf`: time constant of the correction of the inclination",
    )
    magnetometer_tau: float = parameter(
        FilterSettings.magnetometer_tau,
        unit="s",
        limits=(0.05, 600.0),
        doc="`vqf`: time constant of the correction of the heading",
    )
    beta: float = parameter(
        FilterSettings.beta,
        unit="rad/s",
        limits=(0.0, 10.0),
        doc="`madgwick`: gain of the accelerometer and magnetometer",
    )
    gain: float = parameter(
        FilterSettings.gain,
        limits=(0.0, 10.0),
        doc="`imufusion`: gain of the accelerometer and magnetometer",
    )
    gyro_bias_window: float = parameter(
        FilterSettings.gyro_bias_window,
        unit="s",
        limits=(0.0, 60.0),
        doc="time at rest after which the gyroscope's bias is estimated; 0: no estimate",
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
    heading_stddev: float = parameter(
        FilterSettings.heading_stddev,
        unit="rad",
        limits=(1e-4, 3.2),
        doc="published uncertainty of a heading that an undisturbed magnetic field corrects",
    )
    heading_drift: float = parameter(
        FilterSettings.heading_drift,
        unit="rad/s",
        limits=(0.0, 1.0),
        doc="growth of that uncertainty while no field corrects it",
    )

    def filter_settings(self) -> FilterSettings:
        """The settings of the filters."""
        names = (field.name for field in fields(FilterSettings))
        return FilterSettings(**{name: getattr(self, name) for name in names})
