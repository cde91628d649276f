"""A person's kinematic tree: model, measures, kinematics, angles."""
