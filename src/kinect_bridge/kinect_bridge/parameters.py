"""The parameters of the node, declared once."""

from dataclasses import dataclass

from kinect_bridge.source import SOURCES
from pose_core.errors import ParameterError
from pose_core.parameters import NAME_ENDING, parameter
from pose_core.stamps import NS_PER_S
from pose_io.recordings.formats import AUTO, FORMATS
from pose_io.recordings.timeline import CLOCKS

MAX_START_NS = (2**31 - 10**7) * NS_PER_S  # [ns] a stamp's 31 bits of seconds, less a replay


@dataclass(frozen=True, kw_only=True)
class KinectBridgeParameters:
    """Parameters of the node ``kinect_bridge``."""

    name: str = parameter(
        "left",
        doc="the sensor's name: topic `kinect_<name>/skeletons`, and frame of the same name",
        pattern=NAME_ENDING,
    )
    source: str = parameter("file", doc="source of the skeletons", choices=tuple(SOURCES))
    joint_map: str = parameter(
        "",
        doc="live sources: mapping of the tracker's joints to ours, a bundled map or the path"
        " of your own; empty: the default of the source",
    )
    topic: str = parameter("", doc="sources that are a topic: its name; empty: the usual one")
    message_type: str = parameter(
        "", doc="`named_poses`: type of the message, `package/msg/Type`, if it is not NVIDIA's"
    )
    tf_frames: str = parameter(
        "{joint}_{person}",
        doc="`tf`: pattern of the joints' frames; without `{person}`: one person",
    )
    tf_root: str = parameter(
        "", doc="`tf`: the sensor's frame; empty: the parent of the joints' frames"
    )
    udp_address: str = parameter(
        "127.0.0.1",
        doc="`udp`: address to listen on; other than the loopback it requires `udp_senders`",
    )
    udp_port: int = parameter(9870, doc="`udp`: port to listen on", limits=(0, 65535))
    udp_senders: str = parameter(
        "",
        doc="`udp`: IP addresses of allowed senders, separated by commas; empty: all that can"
        " reach it",
    )
    nite2_library: str = parameter(
        "", doc="`nite2`: folder of libOpenNI2 and libNiTE2; empty: the system's search path"
    )
    nite2_device: str = parameter(
        "", doc="`nite2`: index from 0 or URI of the sensor; empty: any, if there is one sensor"
    )
    file: str = parameter("", doc="`file`: the recording to replay; required")
    format: str = parameter(
        AUTO,
        doc="format of the file; `auto` recognises it by its first line",
        choices=(AUTO, *FORMATS),
    )
    sensor: str = parameter("0", doc="sensor in the file: its name, or its index from 0")
    clock: str = parameter(
        CLOCKS[0],
        doc="source of the stamps: the sensor's own clock mapped to the host's, or the host's"
        " times of arrival",
        choices=CLOCKS,
    )
    rate: float = parameter(
        1.0, doc="speed of the replay, relative to the recording", limits=(0.01, 1000.0)
    )
    loop: bool = parameter(False, doc="restart at the end; stamps keep increasing")
    exit_at_end: bool = parameter(False, doc="stop the node at the end of the recording")
    start_at: str = parameter(
        "",
        doc="UNIX time of the recording's time zero, so that several bridges replay in "
        "synchrony; empty: now",
        unit="ns",
    )

    def start_at_ns(self, now_ns: int) -> int:
        """Host time of the recording's time zero [ns].

        Raises:
            ParameterError: If it is not an integer.
        """
        if not self.start_at:
            return now_ns
        is_integer = self.start_at.isascii() and self.start_at.isdecimal()
        if not is_integer or int(self.start_at) > MAX_START_NS:
            raise ParameterError(
                f"start_at = {self.start_at!r} is not a UNIX time in integer nanoseconds: give for "
                f"example the output of `date +%s%N`, or nothing for now"
            )
        return int(self.start_at)
