"""Parameters of the viewer."""

from dataclasses import dataclass

from pose_core.parameters import NAME, parameter, sensors_parameter


@dataclass(frozen=True, kw_only=True)
class ViewParameters:
    """Parameters of the viewer, for a live graph and for a recording."""

    host: str = parameter(
        "127.0.0.1", doc="address of the page's server; 0.0.0.0: for everybody with the token"
    )
    port: int = parameter(
        8080, limits=(0, 65535), doc="port of the page; if it is taken, the next free one; 0: any"
    )
    bodies: tuple[str, ...] = parameter(
        ("subject_kinect", "subject", "subject_imu"),
        doc="ids of the bodies to show, from left to right; only the middle one is at its "
        "true position",
        pattern=NAME,
    )
    sensors: tuple[str, ...] = sensors_parameter()
    rate: float = parameter(
        30.0, unit="Hz", limits=(1.0, 120.0), doc="largest frame rate of the page"
    )
    plot_span: float = parameter(10.0, unit="s", limits=(2.0, 120.0), doc="time span of the plots")
