"""Calibration with a board, on rendered images (synthetic)."""

import cv2
import numpy as np
import pytest
from rendered_board import Scene, board_pose, board_poses
from scipy.spatial.transform import Rotation

from pose_calibration.board.camera import Camera, estimate_camera
from pose_calibration.board.collecting import BoardCollector
from pose_calibration.board.detection import BoardDetector, coverage
from pose_calibration.board.extrinsics import ON_FLOOR, board_extrinsics
from pose_calibration.board.solution import calibrate_board
from pose_calibration.board.target import Board, BoardParameters
from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_core.errors import ParameterError

CHARUCO = Board(BoardParameters(columns=7, rows=5, square=0.06))
CHECKERBOARD = Board(BoardParameters(board="checkerboard", columns=8, rows=5, square=0.06))
SECOND = 1_000_000_000


def camera(focus, distortion=(0.1, -0.2, 0.001, -0.001, 0.0), size=(800, 450)):
    K = [[focus, 0.0, size[0] / 2 + 3.0], [0.0, focus, size[1] / 2 - 2.0], [0.0, 0.0, 1.0]]
    return Camera(
        image_size=size, K=np.array(K), distortion=np.array(distortion), source="rendered"
    )


def aside(degrees, distance=2.0):
    """``T_reference_camera`` of a camera moved round a place straight ahead."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("yz", [-degrees, 2.0], degrees=True).as_matrix()
    angle = np.radians(degrees)
    T[:3, 3] = distance * np.sin(angle), 0.05, distance * (1.0 - np.cos(angle))
    return T


CAMERAS = {"left": camera(600.0), "right": camera(610.0, (0.08, -0.15, 0.0, 0.0, 0.0))}
PLACES = {"left": np.eye(4), "right": aside(38.0)}


def look(board, poses, seed=1, cameras=CAMERAS, places=PLACES, **rendering):
    """What detectors find in images of the board at the poses."""
    scene, detector = Scene(board, cameras, places), BoardDetector(board)
    rng = np.random.default_rng(seed)
    instants = []
    for pose in poses:
        seen = {
            name: detector.detect(scene.image(name, pose, rng, **rendering)) for name in cameras
        }
        instants.append({name: view for name, view in seen.items() if view is not None})
    return instants


def errors(calibration, name="right", places=PLACES):
    """Of a camera's place [m] and rotation [deg]."""
    off = np.linalg.inv(places[name]) @ calibration.T_reference_camera[name]
    turn = Rotation.from_matrix(off[:3, :3]).magnitude()
    return np.linalg.norm(off[:3, 3]), np.degrees(turn)


@pytest.fixture(scope="module")
def instants():
    """Both cameras on 20 views of a ChArUco board, 2 m away."""
    return look(CHARUCO, board_poses(CHARUCO, 20, np.random.default_rng(4)))


def test_a_charuco_board_at_2_m_places_the_camera_within_2_mm_and_a_tenth_of_a_degree(instants):
    calibration = calibrate_board(CHARUCO, instants, CAMERAS)
    off_m, turned_deg = errors(calibration)
    assert off_m < 0.002
    assert turned_deg < 0.1
    assert off_m < 4.0 * calibration.position_stddev["right"]
    assert calibration.rms_px < 0.3


def test_a_checkerboard_at_2_m_does_too_with_more_noise_and_blur():
    poses = board_poses(CHECKERBOARD, 10, np.random.default_rng(5))
    seen = look(CHECKERBOARD, poses, noise=4.0, blur=0.8)
    off_m, turned_deg = errors(calibrate_board(CHECKERBOARD, seen, CAMERAS))
    assert off_m < 0.002
    assert turned_deg < 0.1


def test_the_visible_corners_of_a_half_covered_board_are_used():
    poses = board_poses(CHARUCO, 14, np.random.default_rng(6))
    seen = look(CHARUCO, poses, hidden=(-0.1, -0.1, 0.2, 0.4))
    corners = [len(view.corners) for instant in seen for view in instant.values()]
    assert max(corners) <= CHARUCO.corner_count // 2 + 4
    off_m, turned_deg = errors(calibrate_board(CHARUCO, seen, CAMERAS))
    assert off_m < 0.005
    assert turned_deg < 0.2


def test_a_checkerboard_that_is_half_covered_is_not_taken_for_a_whole_one():
    (seen,) = look(CHECKERBOARD, [board_pose(CHECKERBOARD, 0, 0, 2)], hidden=(0.2, -1, 1, 1))
    assert seen == {}


def test_an_image_without_a_board_shows_none():
    grey = np.full((450, 800), 90, np.uint8)
    assert BoardDetector(CHARUCO).detect(grey) is None
    assert BoardDetector(CHECKERBOARD).detect(grey) is None


@pytest.mark.parametrize("roll", [0.0, 180.0])
def test_a_checkerboard_upside_down_is_recognised_as_such(roll):
    pose = board_pose(CHECKERBOARD, 0.1, 0.0, 1.5, tilt_y=20.0, roll=roll)
    (seen,) = look(CHECKERBOARD, [pose], cameras={"left": CAMERAS["left"]})
    model = CAMERAS["left"]
    turn = cv2.Rodrigues(pose[:3, :3])[0]
    true, _ = cv2.projectPoints(CHECKERBOARD.corners, turn, pose[:3, 3], model.K, model.distortion)
    np.testing.assert_allclose(seen["left"].pixels, true.reshape(-1, 2), atol=0.3)


def test_a_view_of_a_moving_board_is_left_out(instants):
    cheated = list(instants)
    pairs = [i for i, seen in enumerate(instants) if len(seen) == 2]
    a, b = pairs[:2]
    cheated[a] = {"left": instants[a]["left"], "right": instants[b]["right"]}
    calibration = calibrate_board(CHARUCO, cheated, CAMERAS)
    assert "contradicts" in calibration.left_out[a]
    assert errors(calibration)[0] < 0.003


def test_cameras_are_linked_through_one_that_shares_the_board_with_both():
    cameras = {**CAMERAS, "back": camera(620.0)}
    places = {**PLACES, "back": aside(76.0)}
    turned = [
        board_pose(CHARUCO, *np.array([x, y, 2.0]), tilt_x=tilt, tilt_y=-side)
        for side in (20.0, 55.0)
        for x, y, tilt in [
            (-0.3, 0.2, 10),
            (0.2, -0.2, -20),
            (0.3, 0.2, 25),
            (0, 0, -10),
            (0, 0.2, 0),
        ]
    ]
    seen = look(CHARUCO, turned, cameras=cameras, places=places)
    calibration = calibrate_board(CHARUCO, seen, cameras)
    assert errors(calibration, "back", places)[0] < 0.006
    assert errors(calibration, "right", places)[0] < 0.004


def test_too_few_common_views_are_refused_with_their_number(instants):
    with pytest.raises(CalibrationError, match="found 2 instants at which 'left' and 'right'"):
        calibrate_board(CHARUCO, [i for i in instants if len(i) == 2][:2], CAMERAS)


def test_intrinsics_of_another_image_size_are_refused(instants):
    wrong = {**CAMERAS, "right": camera(610.0, size=(640, 480))}
    with pytest.raises(CalibrationError, match=r"images of 'right' have \(800, 450\) pixels"):
        calibrate_board(CHARUCO, instants, wrong)


def test_intrinsics_are_estimated_from_near_and_tilted_views_only(instants):
    with pytest.raises(CalibrationError, match=r"uncertain|covers|views of the board"):
        estimate_camera("left", [i["left"] for i in instants if "left" in i][:12], CHARUCO)
    rng = np.random.default_rng(8)
    near = [
        board_pose(
            CHARUCO, x, y, rng.uniform(0.75, 0.95), *rng.uniform(-40, 40, 2), rng.uniform(-30, 30)
        )
        for x in (-0.3, 0.0, 0.3)
        for y in (-0.15, 0.0, 0.15)
        for _ in range(2)
    ]
    seen = look(CHARUCO, near, cameras={"left": CAMERAS["left"]})
    found = estimate_camera("left", [i["left"] for i in seen if i], CHARUCO)
    assert found.K[0, 0] == pytest.approx(600.0, rel=0.005)
    assert found.focus_stddev < 0.004


def test_a_board_on_the_floor_gives_the_map(instants):
    lying = np.eye(4)
    lying[:3, :3] = Rotation.from_euler("x", -70.0, degrees=True).as_matrix()
    lying[:3, 3] = -0.2, 0.45, 2.2
    (floor,) = look(CHARUCO, [lying])
    extrinsics = board_extrinsics(
        calibrate_board(CHARUCO, [*instants, floor], CAMERAS), floor_instant=len(instants)
    )
    normal = -lying[:3, 2]
    assert extrinsics.floor.source == ON_FLOOR
    assert extrinsics.floor.height == pytest.approx(-normal @ lying[:3, 3], abs=0.02)
    np.testing.assert_allclose(extrinsics.T_map_reference[2, :3], normal, atol=0.02)


def test_coverage_names_the_parts_of_the_image_that_are_empty():
    (seen,) = look(
        CHARUCO, [board_pose(CHARUCO, -0.8, -0.35, 2)], cameras={"left": CAMERAS["left"]}
    )
    found = coverage(seen.values())
    assert found.cells[0, 0]
    assert "bottom right" in found.missing_text


def test_the_collector_stores_boards_at_rest_in_new_poses_and_instructs_the_user():
    scene, rng = Scene(CHARUCO, CAMERAS, PLACES), np.random.default_rng(2)
    collector = BoardCollector(CHARUCO, ["left", "right"], max_skew_s=0.1)
    here, there = board_pose(CHARUCO, 0, 0, 2), board_pose(CHARUCO, 0.3, 0.1, 2)
    for second, pose in enumerate([here, here, here, there, there]):
        for name in CAMERAS:
            collector.add(name, second * SECOND, scene.image(name, pose, rng))
    assert len(collector.instants) == 2
    assert collector.counters["moving"] == 4  # the first look at each place
    assert collector.counters["alike"] == 1
    assert 0.0 < collector.progress < 1.0
    assert "'left'" in collector.missing


def test_a_square_checkerboard_is_refused():
    with pytest.raises(ParameterError, match="is the same from four sides"):
        BoardParameters(board="checkerboard", columns=6, rows=6)
