"""When a fault counts as reported."""

import numpy as np
import pytest

from pose_bench.faults.fault import Fault
from pose_bench.faults.judging import _said
from pose_core.stamps import NS_PER_S
from pose_node.node_status import Level, NodeStatus

FAULT = Fault(name="right: silent", said=("right",))


def report(at_s, message, level=Level.WARN):
    return NodeStatus(
        name="/fusion", level=level, message=message, received_ns=round(at_s * NS_PER_S)
    )


def said_after(*reports):
    return _said(FAULT, reports, 10 * NS_PER_S, 20 * NS_PER_S)[0]


def test_a_warning_that_ended_before_the_fault_counts_again():
    reports = (
        report(8.0, "right is late"),
        report(9.0, "tracking", Level.OK),
        report(10.5, "right is late"),
    )
    assert said_after(*reports) == pytest.approx(0.5)


def test_a_warning_from_before_the_fault_does_not_count():
    assert np.isnan(said_after(report(9.0, "right is late"), report(10.5, "right is late")))


def test_what_is_no_warning_or_names_another_source_does_not_count():
    assert np.isnan(
        said_after(report(10.5, "right is fine", Level.OK), report(11.0, "left is late"))
    )
