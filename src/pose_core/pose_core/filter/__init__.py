r"""The default filter: an error-state Kalman filter over link rotations with robust measurements.

State :math:`x = (p, R_1 \ldots R_L, s, v, \omega_1 \ldots \omega_L, \{M_i, \psi_i\})`: root
position and velocity, each link's rotation in ``map`` and angular velocity, slides of the joints
that shift in their link, and of each aligned IMU its mounting and heading.
Rotations are corrected in their tangent space, :math:`R = \exp([\delta\theta]_\times)\,\hat R`.

One step is a prediction (``motion``), then the measurement updates of :mod:`pose_core.filter.step`:
one robust update (``update``) by the IMUs (``imu``), one by a camera's joints (``camera``) together
with the posture prior (``posture``).

References:
    Barfoot (2017), State Estimation for Robotics, chapters 5 and 7.
"""
