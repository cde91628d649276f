r"""The default filter: an error-state Kalman filter over link rotations with robust measurements.

State :math:`x = (p, R_1 \ldots R_L, s, v, \omega_1 \ldots \omega_L, \{M_i, \psi_i\})`: root
position and velocity, each link's rotation in ``map`` and angular velocity, displacements (slides)
of joints in their links, and mounting and heading of each aligned IMU.
Rotations are corrected in their tangent space, :math:`R = \exp([\delta\theta]_\times)\,\hat R`.

One step is a prediction (``motion``), followed by the measurement updates of
:mod:`pose_core.filter.step`: one robust update (``update``) with the IMUs (``imu``), and one with a
camera's joints (``camera``) together with the posture prior (``posture``).

References:
    Barfoot (2017), State Estimation for Robotics, chapters 5 and 7.
"""
