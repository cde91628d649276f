"""Exported files read by third-party readers (synthetic motion)."""

from dataclasses import replace

import bvhio
import ezc3d
import numpy as np
import pytest
from exported_motion import body_models, write_motion_bag
from scipy.spatial.transform import Rotation

from pose_core.joints import JOINT_INDEX, JOINTS, SIDES
from pose_io.bags import open_bag
from pose_io.export.bvh import bvh_text
from pose_io.export.c3d_file import c3d_bytes
from pose_io.export.motion import read_motion
from pose_io.export.opensim import OPENSIM_MODELS, coordinate_map, coordinates, mot_text, trc_text

RATE = 30.0  # [Hz] the bag's own, but for a third of a nanosecond
MM = 1e-3
MODELS = body_models()
COUNT = 40
GAP = range(20, 30)


@pytest.fixture(scope="module", params=MODELS, ids=[model.name for model in MODELS])
def motion(request, tmp_path_factory):
    """A motion at a constant rate, with the joints and angles that went into the bag."""
    model = request.param
    path = tmp_path_factory.mktemp("export") / "bag"
    dof, joints = write_motion_bag(path, model, COUNT)
    with pytest.MonkeyPatch.context() as patch, open_bag(path) as bag:
        patch.setattr("pose_io.export.motion.model_of_angles", lambda names: model)
        return read_motion(bag).at_rate(RATE), dof, joints


@pytest.fixture(scope="module")
def gappy(tmp_path_factory):
    path = tmp_path_factory.mktemp("export") / "gappy"
    _, joints = write_motion_bag(path, MODELS[0], COUNT, drop=GAP)
    with open_bag(path) as bag:
        return read_motion(bag).at_rate(RATE), joints


def to_ground(points):
    """OpenSim's ground: x forward, y up, z right."""
    return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)


# -- BVH ----------------------------------------------------------------------------------------


def bvh_joints(path, frame):
    """Joint and end positions [m] in map, by the joint's name; the end's by 'end of NAME'."""
    tree = bvhio.readAsBvh(str(path)).Root.layout()
    ends = {joint.Name: joint.EndSite for joint, _, _ in tree if not joint.Children}
    root = bvhio.readAsHierarchy(str(path))
    root.loadRestPose()
    ends = {  # in bvhio's own axes of the joint, y along the bone
        joint.Name: joint.pointToLocal(joint.PositionWorld + ends[joint.Name])
        for joint, _, _ in root.layout()
        if joint.Name in ends
    }
    root.loadPose(frame)
    found = {}
    for joint, _, _ in root.layout():
        found[joint.Name] = np.array(joint.PositionWorld)
        if joint.Name in ends:
            found[f"end of {joint.Name}"] = np.array(joint.pointToWorld(ends[joint.Name]))
    x_left, y_up, z_forward = np.array(list(found.values())).T / 100.0
    return dict(zip(found, np.stack([z_forward, x_left, y_up], axis=1), strict=True))


def test_bvhio_finds_the_joints_where_the_bag_has_them(motion, tmp_path):
    written, _, joints = motion
    path = tmp_path / "motion.bvh"
    path.write_text(bvh_text(written, RATE))
    named = {"neck": "head", "elbow": "hand", "knee": "foot"}
    for frame in (0, 17, COUNT - 1):
        found = bvh_joints(path, frame)
        for name, position in found.items():
            side, _, joint = name.removeprefix("end of ").rpartition("_")
            if name == "hips":
                expected = joints[frame, [JOINT_INDEX[f"{s}_hip"] for s in SIDES]].mean(axis=0)
            elif name.startswith("end of "):
                end = "_".join(filter(None, (side, named[joint])))
                expected = joints[frame, JOINT_INDEX[end]]
            else:
                expected = joints[frame, JOINT_INDEX[name]]
            np.testing.assert_allclose(position, expected, atol=MM)
    assert {f"{side}_knee" for side in SIDES} | {"neck", "end of left_elbow"} <= set(found)


def test_bvh_channels_are_the_joint_angles(motion, tmp_path):
    written, dof, _ = motion
    path = tmp_path / "motion.bvh"
    path.write_text(bvh_text(written, RATE))
    root = bvhio.readAsHierarchy(str(path))
    knee = written.model.dof_index["left_knee_flexion"]
    for frame in (3, 25):
        root.loadPose(frame)
        turn = root.filter("left_knee")[0].Rotation
        angle = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).magnitude()
        np.testing.assert_allclose(np.degrees(angle), np.degrees(dof[frame, knee]), atol=0.01)


def test_bvh_holds_one_frame_for_each_and_its_time(motion, tmp_path):
    path = tmp_path / "motion.bvh"
    path.write_text(bvh_text(motion[0], RATE))

    content = bvhio.readAsBvh(str(path))

    assert content.FrameCount == COUNT
    assert content.FrameTime == pytest.approx(1.0 / RATE)


# -- C3D ----------------------------------------------------------------------------------------


def test_ezc3d_finds_the_joints_where_the_bag_has_them(motion, tmp_path):
    written, _, joints = motion
    path = tmp_path / "motion.c3d"
    path.write_bytes(c3d_bytes(written, RATE))

    content = ezc3d.c3d(str(path))

    point = content["parameters"]["POINT"]
    assert point["LABELS"]["value"] == list(JOINTS)
    assert point["UNITS"]["value"] == ["mm"]
    assert point["RATE"]["value"] == [RATE]
    positions = content["data"]["points"][:3].transpose(2, 1, 0) * MM
    np.testing.assert_allclose(positions, joints, atol=MM)


def test_unknown_points_are_invalid_in_c3d(gappy, tmp_path):
    written, joints = gappy
    path = tmp_path / "motion.c3d"
    path.write_bytes(c3d_bytes(written, RATE))

    points = ezc3d.c3d(str(path))["data"]["points"][:3].transpose(2, 1, 0) * MM

    unknown = np.isnan(points).any(axis=(1, 2))
    assert list(np.flatnonzero(unknown)) == list(GAP)
    np.testing.assert_allclose(points[~unknown], joints[~unknown], atol=MM)


# -- OpenSim ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def opensim():
    return pytest.importorskip("opensim", reason="opensim has no wheel for this Python")


def read_trc(opensim, path):
    """Times [s], labels, markers [m] (n, markers, 3) in OpenSim's ground."""
    table = opensim.TimeSeriesTableVec3(str(path))
    assert table.getTableMetaDataAsString("Units") == "mm"
    rows = [table.getRowAtIndex(index) for index in range(table.getNumRows())]
    columns = table.getNumColumns()
    markers = [[row.getElt(0, column).to_numpy() for column in range(columns)] for row in rows]
    return (
        np.array(table.getIndependentColumn()),
        list(table.getColumnLabels()),
        np.array(markers) * MM,
    )


@pytest.mark.parametrize(
    ("axis", "name", "largest"), [("z", "pelvis_rotation", 720.0), ("y", "pelvis_tilt", 180.0)]
)
def test_of_the_pelvis_only_turns_about_the_vertical_are_counted(motion, axis, name, largest):
    dof = motion[0].dof.copy()
    turns = np.linspace(0.0, 720.0, len(dof))
    dof[:, 3:6] = Rotation.from_euler(axis, turns[:, None], degrees=True).as_rotvec()
    column = coordinates(replace(motion[0], dof=dof), OPENSIM_MODELS["rajagopal2016"])[name]
    assert np.abs(column).max() == pytest.approx(largest, abs=10.0)


def read_mot(opensim, path):
    """Columns by name; angles [deg]."""
    table = opensim.TimeSeriesTable(str(path))
    assert table.getTableMetaDataAsString("inDegrees") == "yes"
    return {
        label: table.getDependentColumn(label).to_numpy().copy()
        for label in table.getColumnLabels()
    }


def test_opensim_finds_the_markers_where_the_bag_has_the_joints(opensim, motion, tmp_path):
    written, _, joints = motion
    path = tmp_path / "motion.trc"
    path.write_text(trc_text(written, RATE, path.name))

    times_s, labels, markers = read_trc(opensim, path)

    assert labels == list(JOINTS)
    np.testing.assert_allclose(times_s, np.arange(COUNT) / RATE, atol=1e-6)
    np.testing.assert_allclose(markers, to_ground(joints), atol=MM)


def test_opensim_takes_empty_markers_for_missing_ones(opensim, gappy, tmp_path):
    written, joints = gappy
    path = tmp_path / "motion.trc"
    path.write_text(trc_text(written, RATE, path.name))

    _, _, markers = read_trc(opensim, path)

    unknown = np.isnan(markers).any(axis=(1, 2))
    assert list(np.flatnonzero(unknown)) == list(GAP)
    np.testing.assert_allclose(markers[~unknown], to_ground(joints[~unknown]), atol=MM)


@pytest.mark.parametrize("name", OPENSIM_MODELS)
def test_opensim_reads_the_angles_of_the_bag(opensim, motion, tmp_path, name):
    written, dof, _ = motion
    path = tmp_path / "motion.mot"
    path.write_text(mot_text(written, OPENSIM_MODELS[name], "motion"))

    columns = read_mot(opensim, path)

    names = coordinate_map(OPENSIM_MODELS[name])
    for ours in written.model.angle_names:
        theirs, sign = names.get(ours, (ours, 1.0))
        expected = sign * np.degrees(dof[:, written.model.dof_index[ours]])
        np.testing.assert_allclose(columns[theirs], expected, atol=0.01)


def custom_joint(name, parent, place, body, turns, slides=()):
    """OpenSim's XML of a joint that turns about axes in turn: [(coordinate, axis, sign)]."""
    kinds = [f"{kind}{number}" for kind in ("rotation", "translation") for number in (1, 2, 3)]
    moves = dict(zip(kinds, turns, strict=False)) | dict(zip(kinds[3:], slides, strict=False))
    default = dict(zip(kinds, (Z, X, Y) if turns[0][1] == Z else (), strict=False))
    default |= dict(zip(kinds[3:], (X, Y, (0, 0, 1)), strict=True))
    axes = ""
    for kind in kinds:
        coordinate, axis, sign = moves.get(kind, ("", default[kind], 0))
        function = (
            f"<LinearFunction><coefficients>{sign} 0</coefficients></LinearFunction>"
            if coordinate
            else "<Constant><value>0</value></Constant>"
        )
        axes += (
            f'<TransformAxis name="{kind}"><coordinates>{coordinate}</coordinates>'
            f"<axis>{numbers(axis)}</axis><function>{function}</function></TransformAxis>"
        )
    coordinates = "".join(
        f'<Coordinate name="{coordinate}"><range>-100 100</range></Coordinate>'
        for coordinate, _, _ in moves.values()
    )
    frames = "".join(
        f'<PhysicalOffsetFrame name="{frame}"><socket_parent>{path}</socket_parent>'
        f"<translation>{numbers(offset)}</translation></PhysicalOffsetFrame>"
        for frame, path, offset in (("from", parent, place), ("to", body, np.zeros(3)))
    )
    return (
        f'<CustomJoint name="{name}"><socket_parent_frame>from</socket_parent_frame>'
        f"<socket_child_frame>to</socket_child_frame><coordinates>{coordinates}</coordinates>"
        f"<frames>{frames}</frames><SpatialTransform>{axes}</SpatialTransform></CustomJoint>"
    )


def numbers(values):
    return " ".join(f"{value:.9g}" for value in values)


Z, X, Y = (0, 0, 1), (1, 0, 0), (0, 1, 0)


class Person:
    """A skeleton in OpenSim with the joint definitions of Rajagopal2016 and measured bones.

    Axes, order and signs are those of the published model's joints: pelvis z, x, y; ball joints
    z, x, y with adduction and rotation reversed on the left; knee and elbow about z.
    """

    def __init__(self, opensim, model, offsets, path):
        self._opensim = opensim
        self._names, self._joints = [], []
        self._offsets = {name: to_ground(offsets[index]) for name, index in JOINT_INDEX.items()}
        hips = np.array(OPENSIM_MODELS["rajagopal2016"].hips_in_pelvis)
        turns = [("pelvis_tilt", Z, 1), ("pelvis_list", X, 1), ("pelvis_rotation", Y, 1)]
        slides = [("pelvis_tx", X, 1), ("pelvis_ty", Y, 1), ("pelvis_tz", Z, 1)]
        self._join("/ground", np.zeros(3), "pelvis", turns, slides)
        trunk, origin = "/bodyset/pelvis", hips
        if "waist_flexion" in model.dof_index:
            turns = [("lumbar_extension", Z, 1), ("lumbar_bending", X, 1)]
            place = hips + self._offsets[model.links["trunk"].joint]
            self._join(trunk, place, "torso", [*turns, ("lumbar_rotation", Y, 1)])
            trunk, origin = "/bodyset/torso", np.zeros(3)
        for side in SIDES:
            self._add_limb("/bodyset/pelvis", hips, side, "hip", "knee", -1, "knee_angle")
            self._add_limb(trunk, origin, side, "shoulder", "elbow", 1, "elbow_flex")
        self._model = opensim.Model(self._write(path))
        self._state = self._model.initSystem()

    def _write(self, path):
        bodies = "".join(
            f'<Body name="{name}"><mass>1</mass><mass_center>0 0 0</mass_center>'
            "<inertia>1 1 1 0 0 0</inertia></Body>"
            for name in self._names
        )
        path.write_text(
            '<?xml version="1.0"?><OpenSimDocument Version="40000"><Model name="person">'
            f'<BodySet name="bodyset"><objects>{bodies}</objects></BodySet>'
            f'<JointSet name="jointset"><objects>{"".join(self._joints)}</objects></JointSet>'
            "</Model></OpenSimDocument>"
        )
        return str(path)

    def _join(self, parent, place, body, turns, slides=()):
        self._names.append(body)
        path = f"/bodyset/{body}"
        self._joints.append(custom_joint(f"to_{body}", parent, place, path, turns, slides))

    def _add_limb(self, parent, origin, side, ball, hinge, bend, hinge_coordinate):
        letter, mirror = side[0], 1 if side == "right" else -1
        names = {
            "hip": ("hip_flexion", "hip_adduction", "hip_rotation"),
            "shoulder": ("arm_flex", "arm_add", "arm_rot"),
        }[ball]
        axes = zip(names, (Z, X, Y), (1, mirror, mirror), strict=True)
        turns = [(f"{name}_{letter}", axis, sign) for name, axis, sign in axes]
        self._join(parent, origin + self._offsets[f"{side}_{ball}"], f"{side}_{ball}", turns)
        turns = [(f"{hinge_coordinate}_{letter}", Z, bend)]
        upper = f"/bodyset/{side}_{ball}"
        self._join(upper, self._offsets[f"{side}_{hinge}"], f"{side}_{hinge}", turns)

    def joints(self, columns, row):
        """Limb joints [m] in the ground for a row of coordinates."""
        coordinates = self._model.updCoordinateSet()
        for index in range(coordinates.getSize()):
            coordinate = coordinates.get(index)
            value = float(columns[coordinate.getName()][row])
            is_length = coordinate.getName() in ("pelvis_tx", "pelvis_ty", "pelvis_tz")
            coordinate.setValue(self._state, value if is_length else np.radians(value), False)
        self._model.realizePosition(self._state)
        bodies = {name: self._model.getBodySet().get(name) for name in self._names}
        found = {
            name: body.getPositionInGround(self._state).to_numpy().copy()
            for name, body in bodies.items()
        }
        for side in SIDES:
            for hinge, end in (("knee", "foot"), ("elbow", "hand")):
                station = self._opensim.Vec3(*self._offsets[f"{side}_{end}"])
                body = bodies[f"{side}_{hinge}"]
                place = body.findStationLocationInGround(self._state, station)
                found[f"{side}_{end}"] = place.to_numpy().copy()
        return found


def test_opensim_moves_a_skeleton_by_the_coordinates_to_where_the_bag_has_it(
    opensim, motion, tmp_path
):
    written, _, joints = motion
    path = tmp_path / "motion.mot"
    path.write_text(mot_text(written, OPENSIM_MODELS["rajagopal2016"], "motion"))
    columns = read_mot(opensim, path)
    person = Person(opensim, written.model, written.offsets, tmp_path / "person.osim")
    for row in range(0, COUNT, 7):
        found = person.joints(columns, row)
        for name in set(found) & set(JOINTS):
            expected = to_ground(joints[row, JOINT_INDEX[name]])
            np.testing.assert_allclose(found[name], expected, atol=MM, err_msg=name)
