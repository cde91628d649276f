r"""The default filter: an error-state Kalman filter over link rotations with robust measurements.

State :math:`x = (p, R_1 \ldots R_L, s, v, \omega_1 \ldots \omega_L, \{M_i, \psi_i\}, \{b_j\})`:
root position and velocity, each link's rotation in ``map`` and angular velocity, displacements
(slides) of joints in their links, sensor-to-segment rotation and heading of each aligned IMU, and
of each limb with an IMU the offset of its far joint that all views share. The drift of each heading
is estimated beside it (``heading_drift``).
Rotations are corrected in their tangent space: those of links in ``map``,
:math:`R = \exp([\delta\theta]_\times)\,\hat R`, sensor-to-segment rotations in the link,
:math:`M = \hat M\,\exp([\delta m]_\times)`. Joints of cameras are linearised by sigma points
(``sigma_points``), everything else by its Jacobian.

One step is a prediction (``motion``), followed by the measurement updates of
:mod:`pose_core.filter.step`: one robust update (``update``) with the IMUs (``imu``), and one with a
camera's joints (``camera``) together with the posture prior (``posture``).

References:
    Barfoot (2017), State Estimation for Robotics, chapters 5 and 7.
"""
