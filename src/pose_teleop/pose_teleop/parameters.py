"""The parameters of the nodes, declared once."""

from dataclasses import dataclass

from pose_core.joints import SIDES
from pose_core.parameters import NAME, parameter
from pose_teleop.arm_mapping import MODES

DEAD_MEN = ("heartbeat", "joy", "none")


@dataclass(frozen=True, kw_only=True)
class RobotParameters:
    """Parameters of the nodes that know a robot."""

    robot: str = parameter(
        "g1", doc="a bundled robot (`g1`, `panda`), or a YAML file of the same form"
    )
    urdf: str = parameter("", doc="another URDF than the robot's; a path or `package://`")


@dataclass(frozen=True, kw_only=True)
class ArmParameters(RobotParameters):
    """Parameters of the node ``arm``."""

    subject: str = parameter("subject", doc="the person to follow", pattern=NAME)
    side: str = parameter("left", doc="the person's arm", choices=SIDES)
    mirror: bool = parameter(
        False, doc="exchange left and right, as in a mirror: the robot's other arm follows"
    )
    mode: str = parameter(
        "joints", doc="follow joint by joint, or the pose of the wrist", choices=MODES
    )
    scale: float = parameter(
        1.0, doc="`wrist`: reach of the robot relative to its arm's length", limits=(0.1, 2.0)
    )
    rate: float = parameter(
        100.0,
        doc="rate of the commands while no joint states arrive",
        unit="Hz",
        limits=(20.0, 1000.0),
    )
    dead_man: str = parameter(
        "heartbeat",
        doc="dead-man input: `heartbeat` is a `std_msgs/Bool`, `joy` a button of a gamepad; "
        "`none` is for simulations",
        choices=DEAD_MEN,
    )
    joy_button: int = parameter(4, doc="`joy`: the button to hold", limits=(0, 31))
    dead_man_timeout: float = parameter(
        0.3,
        doc="silence of the dead-man input after which it counts as released",
        unit="s",
        limits=(0.02, 5.0),
    )
    max_age: float = parameter(
        0.15,
        doc="age of joint states, of person or robot, or of estimates, at which the robot stops",
        unit="s",
        limits=(0.02, 2.0),
    )
    max_deviation: float = parameter(
        0.5,
        doc="standard deviation of the hand's position at which, after 0.1 s, the robot stops",
        unit="m",
        limits=(0.005, 1.0),
    )
    max_jump: float = parameter(
        0.5,
        doc="step of an angle between two joint states at which the robot stops",
        unit="rad",
        limits=(0.05, 6.3),
    )
    settle_time: float = parameter(
        0.5,
        doc="time for which all conditions must hold before the robot starts",
        unit="s",
        limits=(0.0, 60.0),
    )
    soft_velocity: float = parameter(
        0.5,
        doc="velocity of every joint in the soft start; it is increased after 3 s, so that "
        "the robot catches up",
        unit="rad/s",
        limits=(0.01, 10.0),
    )
    soft_tolerance: float = parameter(
        0.1,
        doc="distance of every joint to the person's pose at which the soft start ends",
        unit="rad",
        limits=(0.01, 1.0),
    )
    ramp_time: float = parameter(
        1.5, doc="time from the soft start's velocity to the full one", unit="s", limits=(0.0, 60.0)
    )
    velocity_share: float = parameter(
        0.9, doc="share of the URDF's velocity limits to use", limits=(0.01, 1.0)
    )
    max_acceleration: float = parameter(
        0.0,
        doc="acceleration limit of every joint; 0: the robot file's",
        unit="rad/s²",
        limits=(0.0, 1000.0),
    )
    max_jerk: float = parameter(
        0.0,
        doc="jerk limit of every joint; 0: 25 per second times the acceleration",
        unit="rad/s³",
        limits=(0.0, 100000.0),
    )
    position_margin: float = parameter(
        0.02, doc="distance of commands from the position limits", unit="rad", limits=(0.0, 0.5)
    )
    max_lag: float = parameter(
        0.5,
        doc="distance of the robot from its command at which it is stopped",
        unit="rad",
        limits=(0.01, 6.3),
    )


@dataclass(frozen=True, kw_only=True)
class RetargetParameters:
    """Parameters of the node ``retarget``."""

    subject: str = parameter("subject", doc="the person", pattern=NAME)
    message_type: str = parameter(
        "pose_msgs/msg/NamedPoseArray",
        doc="type of the message; any with the same fields, such as "
        "`teleop_ros2_interfaces/msg/NamedPoseArray`",
    )
    frame: str = parameter(
        "map",
        doc="reference frame of the poses: `map`, or `body`, the person's own frame",
        choices=("map", "body"),
    )


@dataclass(frozen=True, kw_only=True)
class HriParameters:
    """Parameters of the node ``hri``."""

    subject: str = parameter("subject", doc="the person", pattern=NAME)
    id: str = parameter(
        "person",
        doc="the body's id for REP 155's tools: not `subject`, whose topics have other joint names",
        pattern=NAME,
    )
    ids_type: str = parameter(
        "hri_msgs/msg/IdsList", doc="type of the message of `/humans/bodies/tracked`"
    )
    timeout: float = parameter(
        1.0, doc="silence after which the person is no longer tracked", unit="s", limits=(0.1, 60.0)
    )


@dataclass(frozen=True, kw_only=True)
class SimulatedRobotParameters(RobotParameters):
    """Parameters of the node ``simulated_robot``."""

    side: str = parameter("left", doc="the robot's arm", choices=SIDES)
    x: float = parameter(2.0, doc="x of the robot's base in map", unit="m", limits=(-100.0, 100.0))
    y: float = parameter(-0.9, doc="y of the robot's base in map", unit="m", limits=(-100.0, 100.0))
    z: float = parameter(0.8, doc="z of the robot's base in map", unit="m", limits=(-100.0, 100.0))
    yaw: float = parameter(
        3.1416, doc="heading of the robot's base: 0 along map's x", unit="rad", limits=(-6.3, 6.3)
    )
    rate: float = parameter(200.0, doc="rate of its joint states", unit="Hz", limits=(10.0, 1000.0))
    mass_error: float = parameter(
        0.1, doc="relative error of the masses in its controller's model", limits=(-0.5, 0.5)
    )


@dataclass(frozen=True, kw_only=True)
class HoldParameters:
    """Parameters of the node ``hold``."""

    rate: float = parameter(20.0, doc="rate of the heartbeat", unit="Hz", limits=(5.0, 100.0))
