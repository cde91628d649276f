"""Input and output of the calibration with a board: images, camera infos, the printed page."""

import io
import re
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
import yaml

from pose_calibration.board.camera import camera_from_info, load_camera
from pose_calibration.board.detection import BoardDetector
from pose_calibration.board.images import grey_from_message, paired_files, to_grey
from pose_calibration.board.printing import board_figure, print_board
from pose_calibration.board.target import Board, BoardParameters
from pose_core.errors import InputError, ParameterError

CHARUCO = Board(BoardParameters())


def image_message(pixels, encoding, bigendian=False, padding=0):
    rows = pixels.reshape(pixels.shape[0], -1)
    data = b"".join(row.tobytes() + b"\0" * padding for row in rows)
    return SimpleNamespace(
        height=pixels.shape[0],
        width=pixels.shape[1],
        encoding=encoding,
        is_bigendian=bigendian,
        step=len(data) // pixels.shape[0],
        data=data,
    )


def test_images_of_every_encoding_become_grey():
    grey = np.arange(12, dtype=np.uint8).reshape(3, 4) * 20
    np.testing.assert_array_equal(grey_from_message(image_message(grey, "mono8", padding=3)), grey)
    colour = np.repeat(grey[..., None], 3, axis=2)
    np.testing.assert_array_equal(grey_from_message(image_message(colour, "bgr8")), grey)
    red = np.zeros((2, 2, 3), np.uint8)
    red[..., 0] = 255
    assert grey_from_message(image_message(red, "rgb8"))[0, 0] == 76  # 0.299 of 255
    assert grey_from_message(image_message(red, "bgr8"))[0, 0] == 29  # 0.114 of 255


def test_deep_infrared_images_are_stretched_in_either_byte_order():
    deep = np.linspace(0, 4000, 100).reshape(10, 10).astype(np.uint16)
    little = grey_from_message(image_message(deep, "mono16"))
    big = grey_from_message(image_message(deep.astype(">u2"), "mono16", bigendian=True))
    np.testing.assert_array_equal(little, big)
    assert little.max() == 255


def test_compressed_images_are_read():
    grey = np.random.default_rng(0).integers(0, 255, (20, 30)).astype(np.uint8)
    data = cv2.imencode(".png", grey)[1].tobytes()
    message = SimpleNamespace(format="png", data=data)
    np.testing.assert_array_equal(grey_from_message(message), grey)


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (SimpleNamespace(format="jpeg", data=b"rubbish"), "compressed as 'jpeg' cannot be read"),
        (image_message(np.zeros((2, 2), np.uint8), "bayer_rggb8"), "encoded as 'bayer_rggb8'"),
        (image_message(np.zeros((2, 2), np.uint8), "rgb8"), "of 2 x 2 has 4 bytes"),
    ],
)
def test_images_that_cannot_be_used_are_refused(message, text):
    with pytest.raises(InputError, match=text):
        grey_from_message(message)


def test_sixteen_bit_files_are_stretched_too():
    assert to_grey(np.array([[0, 1000]], np.uint16)).max() > 250


def touch(folder, names):
    folder.mkdir()
    for name in names:
        (folder / name).write_bytes(b"")
    return folder


def test_files_of_the_same_name_belong_together(tmp_path):
    folders = {
        "left": touch(tmp_path / "l", ["1.png", "2.png", "notes.txt"]),
        "right": touch(tmp_path / "r", ["2.jpg", "3.png"]),
    }
    pairs = [{name: path.name for name, path in pair.items()} for pair in paired_files(folders)]
    assert pairs == [{"left": "1.png"}, {"left": "2.png", "right": "2.jpg"}, {"right": "3.png"}]


def test_files_of_different_names_are_paired_in_order_if_there_are_as_many(tmp_path):
    folders = {
        "left": touch(tmp_path / "l", ["a1.png", "a2.png"]),
        "right": touch(tmp_path / "r", ["b1.png", "b2.png"]),
    }
    assert [pair["right"].name for pair in paired_files(folders)] == ["b1.png", "b2.png"]
    (tmp_path / "r" / "b3.png").write_bytes(b"")
    with pytest.raises(InputError, match="2 of 'left', 3 of 'right', none of the same name"):
        paired_files(folders)


def test_an_empty_or_missing_folder_is_named(tmp_path):
    with pytest.raises(InputError, match="holds no images"):
        paired_files({"left": touch(tmp_path / "l", [])})
    with pytest.raises(InputError, match="found no folder"):
        paired_files({"left": tmp_path / "nowhere"})


INFO = {
    "image_width": 640,
    "image_height": 480,
    "camera_matrix": {"rows": 3, "cols": 3, "data": [500, 0, 320, 0, 500, 240, 0, 0, 1]},
    "distortion_model": "plumb_bob",
    "distortion_coefficients": {"rows": 1, "cols": 5, "data": [0.1, -0.2, 0, 0, 0]},
}


def test_a_camera_info_file_is_read(tmp_path):
    path = tmp_path / "left.yaml"
    path.write_text(yaml.safe_dump(INFO))
    camera = load_camera(path)
    assert camera.image_size == (640, 480)
    assert camera.K[0, 0] == 500.0
    assert camera.distortion.tolist() == [0.1, -0.2, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"camera_matrix": None}, "is not a camera info"),
        ({"distortion_model": "equidistant"}, "distortion model 'equidistant'"),
        ({"camera_matrix": {"data": [0.0] * 9}}, "holds no intrinsics"),
        ({"distortion_coefficients": {"data": [0.1] * 7}}, "7 distortion coefficients"),
        ({"distortion_coefficients": {"data": ["much"] * 5}}, "distortion coefficients: could not"),
        ({"distortion_coefficients": {"data": [{"k1": 0.1}]}}, "distortion coefficients: float"),
        ({"distortion_coefficients": {"data": [np.nan] * 5}}, "are not finite"),
    ],
)
def test_a_wrong_camera_info_is_refused(change, text, tmp_path):
    path = tmp_path / "left.yaml"
    path.write_text(yaml.safe_dump({**INFO, **change}))
    with pytest.raises(InputError, match=text):
        load_camera(path)


def test_a_camera_info_message_is_read_and_an_uncalibrated_one_refused():
    message = SimpleNamespace(
        k=[500, 0, 320, 0, 500, 240, 0, 0, 1], d=[], width=640, height=480, distortion_model=""
    )
    assert camera_from_info(message).distortion.tolist() == [0.0] * 5
    message.k = [0.0] * 9
    with pytest.raises(InputError, match="holds no intrinsics"):
        camera_from_info(message)


@pytest.mark.parametrize("kind", ["charuco", "checkerboard"])
def test_the_printed_board_has_its_true_size_and_is_found(kind):
    board = Board(BoardParameters(board=kind, columns=8, rows=5, square=0.03))
    page = io.BytesIO()
    board_figure(board, "A4").savefig(page, format="png", dpi=127)  # 5 px a millimetre
    image = cv2.imdecode(np.frombuffer(page.getvalue(), np.uint8), cv2.IMREAD_GRAYSCALE)
    assert image.shape == (1050, 1485)
    view = BoardDetector(board).detect(image)
    assert len(view.corners) == board.corner_count
    grid = view.pixels.reshape(4, 7, 2)
    np.testing.assert_allclose(np.diff(grid[..., 0], axis=1), 150.0, atol=0.3)
    np.testing.assert_allclose(np.diff(grid[..., 1], axis=0), 150.0, atol=0.3)


def test_the_page_is_a_pdf_of_the_paper_s_size(tmp_path):
    path = tmp_path / "board.pdf"
    print_board(CHARUCO, path, "A4")
    (box,) = re.findall(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+) ?\]", path.read_bytes())
    assert [float(side) / 72 * 25.4 for side in box] == pytest.approx([297.0, 210.0], abs=0.1)


def test_a_board_that_is_larger_than_the_paper_is_refused_with_what_would_fit():
    with pytest.raises(ParameterError, match=r"does not fit on A4: expected squares of \d+ mm"):
        board_figure(Board(BoardParameters(square=0.06)), "A4")
