"""Compiles the default estimator's kernels once, before several processes need them."""

from pose_core.api import load_body_model, warm_up
from pose_io.preparing import prepare_reading

if __name__ == "__main__":
    warm_up("default", load_body_model("default"))
    prepare_reading()
