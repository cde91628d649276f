"""``./pose calibrate board``: images in, a YAML out, one line on what is wrong (rendered)."""

import sys

import cv2
import numpy as np
import pytest
import yaml
from rendered_board import Scene, board_poses
from scipy.spatial.transform import Rotation

from pose_calibration.board.camera import Camera
from pose_calibration.board.target import Board, BoardParameters
from pose_calibration.files.extrinsics_file import load_extrinsics
from pose_fusion.tools import calibrate
from pose_io.bag_writer import BagWriter
from pose_io.typestore import make_typestore

BOARD = Board(BoardParameters(square=0.06))
SIZE = (640, 480)
K = np.array([[550.0, 0.0, 322.0], [0.0, 550.0, 238.0], [0.0, 0.0, 1.0]])
CAMERA = Camera(image_size=SIZE, K=K, distortion=np.zeros(5), source="rendered")
RIGHT = np.eye(4)
RIGHT[:3, :3] = Rotation.from_euler("y", -25.0, degrees=True).as_matrix()
RIGHT[:3, 3] = 0.8, 0.0, 0.2


@pytest.fixture(scope="module")
def pictures():
    """Images of a board at seven places, by camera."""
    places = {"left": np.eye(4), "right": RIGHT}
    scene = Scene(BOARD, dict.fromkeys(places, CAMERA), places)
    rng = np.random.default_rng(3)
    poses = board_poses(BOARD, 7, rng, distance=1.7)
    return [{name: scene.image(name, pose, rng) for name in places} for pose in poses]


@pytest.fixture(scope="module")
def folders(pictures, tmp_path_factory):
    root = tmp_path_factory.mktemp("board")
    for index, images in enumerate(pictures):
        for name, image in images.items():
            (root / name).mkdir(exist_ok=True)
            cv2.imwrite(str(root / name / f"{index:03d}.png"), image)
    info = {
        "image_width": SIZE[0],
        "image_height": SIZE[1],
        "camera_matrix": {"data": K.ravel().tolist()},
        "distortion_coefficients": {"data": [0.0] * 5},
        "distortion_model": "plumb_bob",
    }
    (root / "info.yaml").write_text(yaml.safe_dump(info))
    return root


def run(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["calibrate", "board", *map(str, arguments)])
    with pytest.raises(SystemExit) as ending:
        calibrate.main()
    return ending.value.code


def of_folders(folders):
    infos = [f"{name}={folders / 'info.yaml'}" for name in ("left", "right")]
    images = [f"{name}={folders / name}" for name in ("left", "right")]
    return [*images, "--square", "0.06", "--info", *infos]


def test_folders_of_images_give_a_file_and_a_table(folders, tmp_path, monkeypatch, capsys):
    output = tmp_path / "extrinsics.yaml"
    assert run(monkeypatch, *of_folders(folders), "-o", output, "--height", 1.2) == 0
    found = load_extrinsics(output)
    assert np.linalg.norm(found.T_reference_sensor["right"][:3, 3] - RIGHT[:3, 3]) < 0.005
    assert found.T_map_reference[2, 3] == pytest.approx(1.2)
    text = capsys.readouterr().out
    assert "seen from 'left'" in text
    assert "reprojection 0." in text
    board = yaml.safe_load(output.read_text())["sensors"]["right"]["board"]
    assert board["views"] >= 4


def test_a_bag_with_images_and_camera_infos_is_read(pictures, tmp_path, monkeypatch):
    types = make_typestore().types
    info = types["sensor_msgs/msg/CameraInfo"]
    roi = types["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
    path, output = tmp_path / "images", tmp_path / "extrinsics.yaml"
    with BagWriter(path) as bag:
        for index, images in enumerate(pictures):
            for look in (0, 1):  # a board that stands still is seen twice alike
                for name, image in images.items():
                    stamp_ns = index * 10**9 + look * 400_000_000 + 10**9
                    header = types["std_msgs/msg/Header"](
                        types["builtin_interfaces/msg/Time"](stamp_ns // 10**9, stamp_ns % 10**9),
                        f"kinect_{name}_optical_frame",
                    )
                    size = image.shape
                    bag.write(
                        f"/kinect_{name}/image_raw",
                        types["sensor_msgs/msg/Image"](
                            header, *size, "mono8", 0, size[1], image.ravel()
                        ),
                        stamp_ns,
                    )
                    camera = info(
                        header,
                        *size,
                        "plumb_bob",
                        np.zeros(5),
                        K.ravel(),
                        np.eye(3).ravel(),
                        np.zeros(12),
                        0,
                        0,
                        roi,
                    )
                    bag.write(f"/kinect_{name}/camera_info", camera, stamp_ns)
    assert run(monkeypatch, path, "--square", 0.06, "-o", output) == 0
    found = load_extrinsics(output)
    assert np.linalg.norm(found.T_reference_sensor["right"][:3, 3] - RIGHT[:3, 3]) < 0.005


def test_the_board_is_printed(tmp_path, monkeypatch):
    assert run(monkeypatch, "--print", tmp_path / "board.pdf") == 0
    assert (tmp_path / "board.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ([], "no output: name"),
        (["left=a", "-o", "x.yaml"], "expected NAME=FOLDER of two or more cameras"),
        (["left=a", "left=b", "-o", "x.yaml"], "'left=b' is not a folder of images"),
        (["left=a", "right=b", "-o", "nowhere/x.yaml"], "its folder does not exist"),
        (["left=a", "right=b", "-o", "x.yaml"], "found no folder a"),
        (["--live", "left", "left", "-o", "x.yaml"], "two or more different cameras"),
        (["--columns", "2", "--print", "x.pdf"], "columns = 2 is outside [3, 30]"),
        (["--board", "checkerboard", "--rows", "7", "--print", "x.pdf"], "same from four sides"),
    ],
)
def test_errors_are_reported_in_one_line(arguments, text, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(monkeypatch, *arguments) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: ")
    assert text in error
    assert error.count("\n") == 1


def test_a_floor_view_that_does_not_exist_is_refused(folders, tmp_path, monkeypatch, capsys):
    arguments = [*of_folders(folders), "-o", tmp_path / "x.yaml", "--floor-view", "lawn"]
    assert run(monkeypatch, *arguments) == 1
    assert "--floor-view lawn: no image of that name" in capsys.readouterr().err
