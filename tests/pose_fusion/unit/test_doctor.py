"""What the doctor finds on machines and with devices that are made up."""

import json
import os
import sys

import pytest

from pose_fusion.tools import doctor
from pose_fusion.watching.devices import SerialPort, device_findings, kinects
from pose_fusion.watching.findings import Finding, Verdict
from pose_fusion.watching.machine import (
    cores_finding,
    disk_finding,
    domain_finding,
    machine_findings,
    multicast_finding,
    python_finding,
    shared_memory_finding,
)


@pytest.mark.parametrize(
    ("version", "verdict"),
    [
        ((3, 9), Verdict.WRONG),
        ((3, 10), Verdict.OK),
        ((3, 13), Verdict.OK),
        ((3, 14), Verdict.WRONG),
    ],
)
def test_an_unsupported_python_is_reported(version, verdict):
    assert python_finding(version).verdict is verdict


def test_a_single_core_is_reported():
    assert cores_finding(1).verdict is Verdict.WRONG
    assert cores_finding(2).verdict is Verdict.OK


def test_a_full_disk_is_an_error(tmp_path):
    assert disk_finding(tmp_path, 5e8).verdict is Verdict.WRONG
    assert disk_finding(tmp_path, 5e10).verdict is Verdict.OK


def test_missing_shared_memory_is_an_error_with_a_remedy_for_containers(tmp_path):
    finding = shared_memory_finding(tmp_path / "shm")
    assert finding.verdict is Verdict.WRONG
    assert "--ipc=host" in finding.remedy
    assert shared_memory_finding(tmp_path).verdict is Verdict.OK


def test_a_file_that_a_leaving_participant_takes_away_is_not_counted(tmp_path):
    (tmp_path / "fastdds_gone").symlink_to(tmp_path / "nowhere")
    finding = shared_memory_finding(tmp_path)
    assert finding.verdict is Verdict.OK
    assert "0 Fast DDS files" in finding.found


@pytest.mark.parametrize(
    ("domain", "verdict"),
    [("", Verdict.OK), ("42", Verdict.OK), ("200", Verdict.WRONG), ("mine", Verdict.WRONG)],
)
def test_the_ros_domain_is_a_number_that_has_ports(domain, verdict):
    assert domain_finding({"ROS_DOMAIN_ID": domain}).verdict is verdict


def test_missing_multicast_is_reported_only_between_hosts():
    asked = []
    here = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    assert multicast_finding(here, lambda: bool(asked.append(1))).verdict is Verdict.OK
    assert asked == []
    assert multicast_finding({}, lambda: False).verdict is Verdict.WRONG
    assert multicast_finding({}, lambda: True).verdict is Verdict.OK


def test_every_check_runs_on_this_machine(tmp_path):
    subjects = [finding.subject for finding in machine_findings(tmp_path, os.environ)]
    assert subjects == ["Python", "cores", "disk", "shared memory", "ROS domain", "multicast"]


def test_a_port_without_permission_is_reported_with_its_group():
    port = SerialPort(
        path="/dev/ttyUSB0", description="USB serial", may_open=False, group="dialout"
    )
    finding = next(iter(device_findings([port], [])))
    assert finding.verdict is Verdict.WRONG
    assert "usermod -aG dialout" in finding.remedy


def test_missing_devices_are_a_note_not_an_error():
    assert {finding.verdict for finding in device_findings([], [])} == {Verdict.NOTE}


def test_kinects_are_found_by_their_usb_ids(tmp_path):
    for folder, vendor, product in (
        ("1-1", "045e", "02c4"),
        ("1-2", "1234", "02c4"),
        ("usb1", "", ""),
    ):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "idVendor").write_text(f"{vendor}\n")
        (tmp_path / folder / "idProduct").write_text(f"{product}\n")
    assert kinects(tmp_path) == ["Kinect v2"]


@pytest.fixture
def run(monkeypatch, capsys):
    """Run the doctor with findings that are made up; its exit code and output."""

    def run(findings, *words):
        monkeypatch.setattr(sys, "argv", ["doctor", "--listen", "0", *words])
        monkeypatch.setattr(doctor, "machine_findings", lambda *_: findings)
        monkeypatch.setattr(doctor, "device_findings", lambda *_: [])
        with pytest.raises(SystemExit) as ending:
            doctor.main()
        return ending.value.code, capsys.readouterr().out

    return run


FINE = Finding(subject="cores", verdict=Verdict.OK, found="4")
ODD = Finding(subject="ports", verdict=Verdict.NOTE, found="none", remedy="plug in")
BAD = Finding(subject="disk", verdict=Verdict.WRONG, found="full", remedy="tidy up")


def test_doctor_exits_with_1_only_after_an_error(run):
    assert run([FINE, ODD])[0] == 0
    code, output = run([FINE, BAD])
    assert code == 1
    assert "→ tidy up" in output
    assert "1 thing is wrong" in output


def test_json_holds_every_finding(run):
    code, output = run([FINE, BAD], "--json")
    content = json.loads(output)
    assert code == 1
    assert content["wrong"] == 1
    assert content["findings"][1] == {
        "area": "machine",
        "subject": "disk",
        "verdict": "wrong",
        "found": "full",
        "remedy": "tidy up",
    }


def test_a_failing_start_of_ros_is_a_finding(monkeypatch):
    import rclpy

    def refuse(**_):
        raise RuntimeError("failed to load\nlibrmw_nothing.so")

    monkeypatch.setattr(rclpy, "init", refuse)
    (finding,) = doctor.look_at_graph(1.0)
    assert finding.verdict is Verdict.WRONG
    assert finding.found == "a node cannot start: failed to load librmw_nothing.so"
