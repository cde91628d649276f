"""The example that sends a webcam's skeletons: where it places the person."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

EXAMPLE = Path(__file__).parents[3] / "examples" / "webcam_sender.py"
FOCAL = 560.0  # [px]


@pytest.fixture(scope="module")
def place():
    spec = importlib.util.spec_from_file_location("webcam_sender", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.place


@pytest.mark.parametrize("hips", [(0.0, 0.2, 3.0), (0.9, -0.3, 2.6), (-1.4, 0.0, 4.0)])
def test_the_person_is_found_where_the_picture_shows_it(place, hips):
    rng = np.random.default_rng(3)
    joints = np.array(hips) + rng.normal(scale=(0.25, 0.5, 0.2), size=(33, 3))
    pixels = FOCAL * joints[:, :2] / joints[:, 2:]
    weights = rng.uniform(0.1, 1.0, 33)
    centre = np.average(pixels / FOCAL, axis=0, weights=weights)
    z = np.array([*centre, 1.0]) / np.linalg.norm([*centre, 1.0])
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    towards_body = np.stack([x, np.cross(z, x), z])  # axes of a camera that points at the body

    placed = place((joints - hips) @ towards_body.T, pixels, weights, FOCAL)

    assert placed == pytest.approx(joints, abs=1e-9)
