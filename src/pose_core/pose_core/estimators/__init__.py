"""Table of the estimators by name.

A new estimator is a module here with a subclass of
:class:`pose_core.estimators.estimator.StepwiseEstimator`, and one line in :data:`ESTIMATORS`
(``docs/extending/estimator.md``). The classes are named, not imported: the parameters take their
choices from this table, and the estimators import the parameters.
"""

ESTIMATORS: dict[str, str] = {
    "default": "default.DefaultEstimator",
    "smoothed": "smoothed.SmoothedEstimator",
    "ukf": "default.DefaultEstimator",  # alias of the default
    "li2020": "li2020.Li2020Estimator",
    "zhang2015": "zhang2015.Zhang2015Estimator",
    "joint_kf": "joint_kf.JointKalmanFilter",
    "dof_kf": "dof_kf.DofKalmanFilter",
    "mean": "raw.MeanOfSensors",
    "left": "raw.LeftSensor",
    "right": "raw.RightSensor",
    "imu": "imu.ImuEstimator",
}
