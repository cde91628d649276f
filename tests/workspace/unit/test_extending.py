"""The how-tos of docs/extending: their code works as it stands there."""

import re
import sys
from importlib import resources
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import yaml
from builtin_interfaces.msg import Time
from exported_motion import write_motion_bag
from geometry_msgs.msg import Point, Pose, PoseArray
from std_msgs.msg import Header
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples

from imu_bridge.protocols import PROTOCOLS, ProtocolEntry
from kinect_bridge.parameters import KinectBridgeParameters
from pose_core.api import ESTIMATORS, Pipeline, PipelineParameters, fuse, load_body_model
from pose_core.joints import JOINTS
from pose_core.stamps import NS_PER_S
from pose_fusion.tools import export
from pose_io.export.registry import EXPORTERS
from pose_io.recordings.formats import FORMATS
from pose_io.samples import read_samples
from pose_view.tools import report

DEFAULT_BODY = resources.files("pose_core.body") / "body_models" / "default.yaml"
PAGES = Path(__file__).parents[3] / "docs" / "extending"


@pytest.fixture
def new_module(monkeypatch):
    """Makes a module of a page's code, under the name that the page gives it."""

    def make(page):
        text = (PAGES / page).read_text()
        path = re.search(r"`src/\w+/([\w/]+)\.py`", text)[1]
        (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
        module = ModuleType(path.replace("/", "."))
        exec(compile(code, path, "exec"), module.__dict__)
        monkeypatch.setitem(sys.modules, module.__name__, module)
        return module

    return make


def status(tool, monkeypatch, *words):
    """Exit status of a tool, run in this process."""
    monkeypatch.setattr(sys, "argv", list(words))
    with pytest.raises(SystemExit) as ended:
        tool.main()
    return ended.value.code


def line_of(page):
    """The registry's line that a page shows: name and value."""
    text = (PAGES / page).read_text()
    (line,) = re.findall(r"```\n    (\".*?)```", text, re.DOTALL)
    name, _, value = line.strip().rstrip(",").partition(": ")
    return name.strip('"'), value


def test_an_estimator_is_added_by_a_file_and_a_line(new_module, monkeypatch):
    new_module("estimator.md")
    name, value = line_of("estimator.md")
    monkeypatch.setitem(ESTIMATORS, name, value.strip('"'))
    _, dof = motion(4.0)
    samples = skeleton_samples(
        kinematics().pose(dof).positions, extrinsics(), np.random.default_rng(1), 0.005
    )
    pipeline = Pipeline(PipelineParameters(estimator=name, use_imus=False), extrinsics())
    estimates = [estimate for sample in samples for estimate in pipeline.add(sample)]
    assert len(estimates) > 30
    for estimate in estimates:
        assert np.isfinite(estimate.position).all()
        assert estimate.tracking_state.shape == (15,)
        assert estimate.tracking_state.dtype == np.uint8


def test_a_skeleton_format_is_added_by_a_file_and_a_line(new_module, monkeypatch, tmp_path):
    arrays = new_module("skeleton_format.md")
    name, value = line_of("skeleton_format.md")
    monkeypatch.setitem(FORMATS, name, eval(value, {"arrays": arrays}))
    rng = np.random.default_rng(2)
    joints = rng.normal(size=(len(JOINTS), 3)) + 0.01 * rng.normal(size=(5, len(JOINTS), 3))
    np.savez(tmp_path / "joints.npz", time_s=100.0 + np.arange(5) / 30.0, joints_m=joints)
    recorded = read_samples(tmp_path / "joints.npz")
    assert recorded.sensors == ("kinect",)
    np.testing.assert_array_equal([s.positions for s in recorded.samples], joints)


def test_a_live_source_is_added_by_a_file_and_a_line(new_module):
    module = new_module("live_source.md")
    name, value = line_of("live_source.md")
    file, _, class_name = value.strip('"').partition(".")  # as in SOURCES
    assert module.__name__ == f"kinect_bridge.sources.{file}"
    source = getattr(module, class_name)(KinectBridgeParameters(source=name, topic="tracker/body"))
    assert [topic.name for topic in source.topics] == ["tracker/body"]
    source.start(lambda: 2 * NS_PER_S, lambda: None)
    joints = np.arange(3.0 * len(JOINTS)).reshape(-1, 3)
    poses = [Pose(position=Point(x=x, y=y, z=z)) for x, y, z in joints.tolist()]
    for ms, sent in ((940, poses[:3]), (960, poses), (980, [])):
        header = Header(stamp=Time(sec=1, nanosec=ms * 10**6))
        source.receive(PoseArray(header=header, poses=sent), "tracker/body")
    frame, empty = source.take(), source.take()
    assert (frame.stamp_ns, frame.person) == (1_960_000_000, ("0",))
    np.testing.assert_array_equal(frame.positions, [joints])
    assert empty.person == ()
    assert source.report().values["messages_of_other_length"] == 1


def test_an_imu_protocol_is_added_by_a_file_and_a_line(new_module, monkeypatch):
    module = new_module("imu_protocol.md")
    name, value = line_of("imu_protocol.md")
    entry = eval(value, {"ProtocolEntry": ProtocolEntry, **vars(module)})
    monkeypatch.setitem(PROTOCOLS, name, entry)
    parser = PROTOCOLS[name].make_parser({})
    frame = module.FRAME.pack(module.BEGIN, 0, 0, 1000, 0, 500, 0)
    data = frame + b"noise" + frame
    readings = [reading for byte in data for reading in parser.parse(bytes([byte]))]
    assert [r.acceleration[2] for r in readings] == pytest.approx([9.80665, 9.80665])
    assert readings[0].angular_velocity == pytest.approx((0.0, 0.5, 0.0))
    assert parser.counters["bytes_skipped"] == len(b"noise")


def test_a_bag_with_your_own_body_model_is_reported_and_exported(monkeypatch, tmp_path):
    document = yaml.safe_load(DEFAULT_BODY.read_text())
    (code,) = re.findall(r"```yaml\n(.*?)```", (PAGES / "body_model.md").read_text(), re.DOTALL)
    example = yaml.safe_load(code)
    document["name"] = example["name"]
    document["links"].update(example["links"])
    document["order"].append("neck_rotation")
    own = tmp_path / "my_body.yaml"
    own.write_text(yaml.safe_dump(document, sort_keys=False))
    bag = str(tmp_path / "bag")
    write_motion_bag(tmp_path / "bag", load_body_model(str(own)))
    bvh, made = tmp_path / "motion.bvh", tmp_path / "report"
    words = ("export", bag, "--to", "bvh", "-o", str(bvh), "--body-model", str(own))
    assert status(export, monkeypatch, *words) == 0
    assert status(report, monkeypatch, "report", bag, "-o", str(made)) == 0
    assert bvh.exists()
    assert (made / "report.html").exists()


def test_other_tuning_parameters_are_given_by_a_file(tmp_path):
    (code,) = re.findall(r"```yaml\n(.*?)```", (PAGES / "filter.md").read_text(), re.DOTALL)
    own = tmp_path / "my_tuning.yaml"
    own.write_text(code)
    _, dof = motion(5.0)
    rng = np.random.default_rng(3)
    samples = skeleton_samples(kinematics().pose(dof).positions, extrinsics(), rng, 0.01)
    default, tuned, same = (
        fuse(samples, extrinsics(), PipelineParameters(tuning=path)) for path in ("", str(own), "")
    )
    np.testing.assert_array_equal(same.position, default.position)
    assert 1e-4 < np.abs(tuned.position - default.position).max() < 1.0


def test_an_exporter_is_added_by_a_file_and_a_line(new_module, monkeypatch, tmp_path, capsys):
    stick = new_module("exporter.md")
    name, value = line_of("exporter.md")
    monkeypatch.setitem(EXPORTERS, name, eval(value, {"stick": stick}))
    write_motion_bag(tmp_path / "bag", load_body_model("li2020"))
    words = ("export", str(tmp_path / "bag"), "--to", name, "-o", str(tmp_path / "out.txt"))
    assert status(export, monkeypatch, *words) == 0, capsys.readouterr().err
    lines = (tmp_path / "out.txt").read_text().splitlines()
    assert lines[0].startswith("# out.txt at")
    assert len(lines[1].split()) == 1 + len(JOINTS)
