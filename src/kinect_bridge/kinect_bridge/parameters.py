"""The parameters of the node, declared once."""

import re
from dataclasses import dataclass

from kinect_bridge.sources import SOURCES
from pose_core.errors import ParameterError
from pose_core.parameters import parameter
from pose_io.recordings.formats import AUTO, FORMATS
from pose_io.recordings.timeline import CLOCKS

MAX_START_NS = (
    2**31 - 10**7
) * 10**9  # [ns] stamps have 31 bits of seconds; some are for the replay


@dataclass(frozen=True, kw_only=True)
class KinectBridgeParameters:
    """What the user of the ``kinect_bridge`` node can set."""

    name: str = parameter(
        "left", doc="the sensor's name: topic `kinect_<name>/skeletons`, frame of the same name"
    )
    source: str = parameter("file", doc="where the skeletons come from", choices=tuple(SOURCES))
    joint_map: str = parameter(
        "",
        doc="of a live source: how its joints become ours, a shipped map or the path of your own; "
        "empty: the one of the source",
    )
    topic: str = parameter("", doc="of a source that is a topic: its name; empty: the usual one")
    message_type: str = parameter(
        "", doc="of `named_poses`: the message, `package/msg/Type`, if it is not NVIDIA's"
    )
    tf_frames: str = parameter(
        "{joint}_{person}",
        doc="of `tf`: how a joint's frame is named; without `{person}`: one person",
    )
    tf_root: str = parameter(
        "", doc="of `tf`: the sensor's frame; empty: the one that the joints' frames hang from"
    )
    udp_address: str = parameter(
        "127.0.0.1", doc="of `udp`: where to listen; beyond the loopback `udp_senders` is needed"
    )
    udp_port: int = parameter(9870, doc="of `udp`: where to listen", limits=(0, 65535))
    udp_senders: str = parameter(
        "",
        doc="of `udp`: IP addresses that may send, with commas between; empty: all that can reach "
        "it",
    )
    nite2_library: str = parameter(
        "", doc="of `nite2`: the folder of libOpenNI2 and libNiTE2; empty: where the system looks"
    )
    nite2_device: str = parameter(
        "", doc="of `nite2`: index from 0 or URI of the sensor; empty: any, for one sensor"
    )
    file: str = parameter("", doc="of `file`: the recording to replay; must be given")
    format: str = parameter(
        AUTO, doc="how to read the file; `auto` knows it by its beginning", choices=(AUTO, *FORMATS)
    )
    sensor: str = parameter("0", doc="which sensor of the file: its name, or its index from 0")
    clock: str = parameter(
        CLOCKS[0],
        doc="whose spacing of frames to keep: the sensor's own clock mapped onto the host's, or "
        "the host's times of arrival",
        choices=CLOCKS,
    )
    rate: float = parameter(
        1.0, doc="how many times faster than recorded to replay", limits=(0.01, 1000.0)
    )
    loop: bool = parameter(False, doc="begin anew at the end; stamps keep increasing")
    exit_at_end: bool = parameter(False, doc="end the node when the recording has ended")
    start_at: str = parameter(
        "",
        doc="UNIX time at which the recording's time zero is due, so that several bridges keep "
        "the sensors' timing; empty: now",
        unit="ns",
    )

    def checked_name(self) -> str:
        """The name, which becomes part of a topic.

        Raises:
            ParameterError: If it cannot.
        """
        if not re.fullmatch(r"[A-Za-z0-9]\w*", self.name, re.ASCII):
            raise ParameterError(
                f"name = {self.name!r} cannot be part of a topic: use letters, digits and "
                f"underscores, for example 'left'"
            )
        return self.name

    def start_at_ns(self, now_ns: int) -> int:
        """When time zero is due [ns].

        Raises:
            ParameterError: If it is no integer.
        """
        if not self.start_at:
            return now_ns
        is_integer = re.fullmatch(r"\d+", self.start_at, re.ASCII) is not None
        if not is_integer or int(self.start_at) > MAX_START_NS:
            raise ParameterError(
                f"start_at = {self.start_at!r} is no UNIX time in integer nanoseconds: give for "
                f"example the output of `date +%s%N`, or nothing for now"
            )
        return int(self.start_at)
