"""OpenSim's inverse kinematics on the same joints, for a comparison of the cost per frame.

The body is that of the model: a free root, a pin joint for each hinge, a gimbal joint for any other
link, and a marker for each of the 15 joints.
"""

import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from pose_core.api import BodyModel, BodyShape
from pose_core.arrays import FloatArray
from pose_core.joints import JOINTS
from pose_io.export.opensim import MM, trc_of_points

ACCURACY = 1e-5  # [-] of the assembly, as in OpenSim's own tool


class OpenSimIk:
    """Tracks markers frame by frame.

    Args:
        model: The body model.
        shape: The person's body measures.
        positions: Joints of all frames, shape (frames, 15, 3) [m], z up.
        rate: Rate of the frames [Hz].

    Raises:
        ImportError: If the package ``opensim`` is not installed.
    """

    def __init__(
        self, model: BodyModel, shape: BodyShape, positions: FloatArray, rate: float
    ) -> None:
        environment = dict(os.environ)
        import opensim

        os.environ.update(environment)  # the import changes it, also for child processes
        opensim.Logger.setLevelString("error")
        self._times_s = np.round(np.arange(len(positions)) / rate, 6)  # as the file has them
        self._model = _make_model(opensim, model, shape)
        self._state = self._model.initSystem()
        with tempfile.TemporaryDirectory(prefix="pose_bench_opensim_") as folder:
            path = Path(folder) / "markers.trc"
            path.write_text(trc_of_points(self._times_s, positions * MM, rate, path.name))
            weights = opensim.SetMarkerWeights()
            for joint in JOINTS:
                weights.cloneAndAppend(opensim.MarkerWeight(joint, 1.0))
            self._markers = opensim.MarkersReference(str(path), weights)
        self._coordinates = opensim.SimTKArrayCoordinateReference()
        self.solver = opensim.InverseKinematicsSolver(
            self._model, self._markers, self._coordinates, np.inf
        )
        self.solver.setAccuracy(ACCURACY)
        self._state.setTime(0.0)
        self.solver.assemble(self._state)

    def step(self, frame: int) -> None:
        """Solve for a frame."""
        self._state.setTime(float(self._times_s[frame]))
        self.solver.track(self._state)


def _make_model(opensim: Any, model: BodyModel, shape: BodyShape) -> Any:
    """Create the body with OpenSim's joints and markers."""
    made = opensim.Model()
    made.setName("body")
    places = dict(zip(JOINTS, shape.offsets, strict=True))
    bodies = {}
    for name, link in model.links.items():
        body = opensim.Body(name, 1.0, opensim.Vec3(0.0), opensim.Inertia(0.01, 0.01, 0.01))
        bodies[name] = body
        made.addBody(body)
        origin, none = opensim.Vec3(0.0), opensim.Vec3(0.0)
        if link.parent is None or link.joint is None:
            joint = opensim.FreeJoint(f"{name}_joint", made.getGround(), body)
        else:
            place = opensim.Vec3(*places[link.joint].tolist())
            is_hinge = len(link.dof) == 1
            kind = opensim.PinJoint if is_hinge else opensim.GimbalJoint
            # A pin rotates about its z axis, the hinges here about y.
            turn = opensim.Vec3(np.pi / 2.0, 0.0, 0.0) if is_hinge else none
            joint = kind(f"{name}_joint", bodies[link.parent], place, turn, body, origin, turn)
        made.addJoint(joint)
    for joint_name in JOINTS:
        body = bodies[model.joints[joint_name].link]
        place = opensim.Vec3(*places[joint_name].tolist())
        made.addMarker(opensim.Marker(joint_name, body, place))
    made.finalizeConnections()
    return made
