"""Send a webcam's skeletons to kinect_bridge: MediaPipe's landmarks, with the distance estimated.

pip install mediapipe==0.10.21        # Python 3.9 to 3.12; brings OpenCV, numpy and the model
python3 webcam_sender.py [--camera 0] [--field-of-view 60] [--port 9870]
./pose up kinect.launch.yaml name:=left source:=udp joint_map:=mediapipe      # in the repository

MediaPipe measures the body in metres, but from its hips; where it is follows from where the
landmarks are in the picture. Any other tracker of 33 landmarks can use :func:`place`.
"""

import argparse
import time

import numpy as np


def place(world, pixels, weights, focal):
    """Landmarks in the camera's optical frame, (33, 3) [m].

    Args:
        world: Landmarks relative to the hips, as if the camera pointed at them, (33, 3) [m].
        pixels: The same in the picture, from its centre, (33, 2) [px].
        weights: Visibilities, (33,).
        focal: Focal length [px].
    """
    u = pixels / focal
    centre = np.average(u, axis=0, weights=weights)
    z = np.array([*centre, 1.0]) / np.linalg.norm([*centre, 1.0])  # ray to the body
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    body = world @ np.stack([x, np.cross(z, x), z])
    # u (Z + t_z) = X + t_x, and the same with v and Y, is linear in the position t
    A = np.zeros((len(u), 2, 3))
    A[:, 0, 0] = A[:, 1, 1] = 1.0
    A[:, :, 2] = -u
    b = u * body[:, 2:] - body[:, :2]
    w = np.repeat(weights, 2)
    t = np.linalg.lstsq(w[:, None] * A.reshape(-1, 3), w * b.ravel(), rcond=None)[0]
    return body + t


def frames(capture, field_of_view):
    """(time of arrival [ns], joints of the person or None) of each picture."""
    import cv2
    from mediapipe.python.solutions.pose import Pose

    tracker = Pose(model_complexity=1)
    while True:
        is_read, picture = capture.read()
        time_ns = time.monotonic_ns()  # OpenCV does not tell the camera's own
        if not is_read:
            return
        height, width = picture.shape[:2]
        found = tracker.process(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))
        if found.pose_world_landmarks is None:
            yield time_ns, None
            continue
        rows = [(p.x, p.y, p.z, p.visibility) for p in found.pose_world_landmarks.landmark]
        world, visibility = np.array(rows)[:, :3], np.array(rows)[:, 3]
        pixels = [
            (width * (p.x - 0.5), height * (p.y - 0.5)) for p in found.pose_landmarks.landmark
        ]
        focal = 0.5 * width / np.tan(0.5 * np.radians(field_of_view))
        joints = place(world, np.array(pixels), visibility**2 + 1e-3, focal)
        yield time_ns, np.column_stack([joints, visibility]).round(4).tolist()


def main():
    """Send until the stream ends or Ctrl-C."""
    import socket

    import cv2
    from udp_sender import send

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--camera", default="0", help="its number, or the address of a stream (0)")
    parser.add_argument("--field-of-view", type=float, default=60.0, help="horizontal [°] (60)")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=9870)
    options = parser.parse_args()
    name = options.camera
    capture = cv2.VideoCapture(int(name) if name.isdigit() else name)
    if not capture.isOpened():
        parser.error(f"cannot open camera {name}")
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        for seq, (time_ns, joints) in enumerate(frames(capture, options.field_of_view)):
            people = {} if joints is None else {"1": joints}
            send(sock, (options.host, options.port), seq, time_ns, people)
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
