"""Whoever has made a pipeline waits for no compilation when somebody steps before the sensors."""

import subprocess
import sys

SCRIPT = """
import importlib, pkgutil
import pose_core.filter
import pose_core.kernels
from pose_bench.sessions import SessionSpec, bench_session
from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline
from pose_core.streams.samples import SkeletonSample

modules = [
    importlib.import_module(f"{package.__name__}.{each.name}")
    for package in (pose_core.kernels, pose_core.filter)
    for each in pkgutil.iter_modules(package.__path__)
]


def ready():
    return {
        (module.__name__, name): len(kernel.signatures)
        for module in modules
        for name, kernel in vars(module).items()
        if hasattr(kernel, "signatures")
    }


session = bench_session(
    SessionSpec(choreography="leg_lift_march", level="typical", seed=1, duration_s=9.0)
)
pipeline = Pipeline(PipelineParameters(), session.extrinsics)
before = ready()
estimates = 0
for sample in session.samples:
    estimates += len(pipeline.add(sample))
after = ready()
print(estimates, *(".".join(name) for name in after if after[name] != before[name]))
"""


def test_no_kernel_is_compiled_or_loaded_during_tracking():
    run = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    estimates, *late = run.stdout.split()
    assert int(estimates) > 100
    assert late == []
