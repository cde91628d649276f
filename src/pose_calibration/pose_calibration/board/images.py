"""Grey images from folders and from messages."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pose_core.errors import InputError

GreyImage = NDArray[np.uint8]
SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm")
BRIGHTEST = 99.0  # [%] percentile of an infrared image that becomes white: the rest is glare
LAYOUTS = {  # type and channels by encoding, sensor_msgs/image_encodings.hpp
    "mono8": (np.uint8, 1),
    "8UC1": (np.uint8, 1),
    "mono16": (np.uint16, 1),
    "16UC1": (np.uint16, 1),
    "rgb8": (np.uint8, 3),
    "bgr8": (np.uint8, 3),
    "8UC3": (np.uint8, 3),
    "rgba8": (np.uint8, 4),
    "bgra8": (np.uint8, 4),
    "8UC4": (np.uint8, 4),
}


def grey_from_message(message: Any) -> GreyImage:
    """The image of a ``sensor_msgs/Image`` or ``CompressedImage`` (of ROS or of rosbags).

    Raises:
        InputError: If it is empty, damaged or of an unsupported encoding.
    """
    data = np.frombuffer(bytes(message.data), np.uint8)
    if not hasattr(message, "encoding"):
        image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if len(data) else None
        if image is None:
            raise InputError(f"an image compressed as '{message.format}' cannot be read")
        return to_grey(image, "bgr")
    if message.encoding not in LAYOUTS:
        raise InputError(
            f"images are encoded as '{message.encoding}', expected one of {', '.join(LAYOUTS)}"
        )
    dtype, channels = LAYOUTS[message.encoding]
    width = message.width * channels * np.dtype(dtype).itemsize
    if len(data) < message.height * message.step or message.step < width or not width:
        raise InputError(f"an image of {message.width} x {message.height} has {len(data)} bytes")
    rows = data[: message.height * message.step].reshape(message.height, message.step)[:, :width]
    deep = np.dtype(dtype).newbyteorder(">" if message.is_bigendian else "<")
    pixels = np.ascontiguousarray(rows).view(deep)
    image = pixels.reshape(message.height, message.width, channels).astype(dtype)
    return to_grey(image.squeeze(), "rgb" if message.encoding.startswith("rgb") else "bgr")


def to_grey(image: NDArray[Any], order: str = "bgr") -> GreyImage:
    """Convert an image to 8-bit grey; images of higher bit depth (infrared) are rescaled."""
    if image.ndim == 3:
        weights = np.array([0.114, 0.587, 0.299])  # ITU-R BT.601, blue first
        image = image[..., :3] @ (weights if order == "bgr" else weights[::-1])
        return np.clip(np.round(image), 0, 255).astype(np.uint8)
    if image.dtype == np.uint8:
        return image
    top = max(1.0, float(np.percentile(image, BRIGHTEST)))
    return np.clip(image * (255.0 / top), 0, 255).astype(np.uint8)


def read_grey(path: Path) -> GreyImage:
    """Read an image file.

    Raises:
        InputError: If it cannot be read.
    """
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise InputError(f"cannot read the image {path}")
    return to_grey(image)


def paired_files(folders: Mapping[str, Path]) -> list[dict[str, Path]]:
    """Simultaneous image files in the folders of several cameras.

    Files of the same name are simultaneous; where no name occurs twice, the folders must contain
    equally many files, which are paired in the order of their names.

    Raises:
        InputError: If a folder is missing or empty, or the files cannot be paired.
    """
    files = {camera: _image_files(folder) for camera, folder in folders.items()}
    names = [{path.stem: path for path in found} for found in files.values()]
    everywhere = sorted(set().union(*names))
    if len(everywhere) < sum(len(each) for each in names):
        return [
            {camera: each[stem] for camera, each in zip(files, names, strict=True) if stem in each}
            for stem in everywhere
        ]
    if len({len(found) for found in files.values()}) > 1:
        counts = ", ".join(f"{len(found)} of '{camera}'" for camera, found in files.items())
        raise InputError(
            f"found images {counts}, none of the same name: name files that were taken together "
            "alike, as in left/001.png and right/001.png"
        )
    return [dict(zip(files, row, strict=True)) for row in zip(*files.values(), strict=True)]


def _image_files(folder: Path) -> Sequence[Path]:
    if not folder.is_dir():
        raise InputError(f"found no folder {folder}: expected one with a camera's images")
    found = sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES)
    if not found:
        raise InputError(f"{folder} holds no images: expected {', '.join(SUFFIXES)}")
    return found
