"""The three sentences at the top of the report, the legend, and what is left out."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pose_core.api import ANGLES, JOINTS, SkeletonSeries, TrackingState
from pose_evaluation.agreement import MethodStability, ViewAgreement
from pose_evaluation.reference_alignment import ReferenceAlignment
from pose_evaluation.table import Table, number_row
from pose_view.report.page.page import verdict
from pose_view.report.page.sections import Section, without_empty
from pose_view.report.report_data import ReportData, usual_methods

VIEW = ViewAgreement(
    first="left",
    second="right",
    frames=900,
    as_logged_cm=30.0,
    calibrated_cm=4.0,
    best_rigid_cm=3.5,
    angle_difference_deg=dict.fromkeys(ANGLES, 10.0),
)
STEADY = MethodStability(
    frames=900,
    gaps=0,
    longest_gap_s=0.1,
    bone_cv_percent={},
    bone_sd_mm={},
    jerk={},
)


def view_without(joint=None):
    """Skeletons of one camera, which never tracks a joint."""
    state = np.full((900, len(JOINTS)), TrackingState.TRACKED, np.uint8)
    if joint is not None:
        state[:, JOINTS.index(joint)] = TrackingState.NOT_TRACKED
    positions = np.zeros((900, len(JOINTS), 3))
    return SkeletonSeries(stamps_ns=np.arange(900), positions=positions, tracking_state=state)


class Analysis:
    """What the verdict reads of one."""

    def __init__(
        self, *views, stability=STEADY, segments=("pelvis",), unused=(), placed=True, lacks=None
    ):
        self.compared = None
        self.views = views
        self.stability = {"default": stability}
        sensors = ("left", "right") if views else ("left",)
        self.recording = ReportData(
            name="walk",
            begin_ns=0,
            duration_s=30.0,
            comment="",
            views=dict.fromkeys(sensors, view_without(lacks)),
            segments=segments,
            unused_imus=unused,
            T_map_sensor=dict.fromkeys(sensors, np.eye(4)) if placed else {},
            methods={},
            estimates={},
            focus="default",
        )


def with_reference(correlation, next_best, **errors_deg):
    """An analysis with a reference, from which each method has this error."""
    methods = [
        SimpleNamespace(name=name, mean_rmse_deg=error) for name, error in errors_deg.items()
    ]
    analysis = Analysis(VIEW)
    analysis.compared = SimpleNamespace(
        alignment=ReferenceAlignment(
            begins_at_s=0.0, shares_clock=False, correlation=correlation, next_best=next_best
        ),
        reference=SimpleNamespace(name="Vicon"),
        evaluation=SimpleNamespace(
            angle_count=12,
            methods=methods,
            method=lambda name: next(each for each in methods if each.name == name),
        ),
        left_out=(),
    )
    return analysis


def test_the_summary_has_accuracy_agreement_and_a_recommendation():
    good, near, to_do = verdict(Analysis(VIEW))

    assert good == "There is no reference to compare with, so how good the angles are is not known."
    assert near.startswith("The views of left and right agree well: the same joint is 4.0 cm apart")
    assert to_do == "Nothing has to be done."


@pytest.mark.parametrize(
    ("analysis", "advice"),
    [
        (Analysis(replace(VIEW, calibrated_cm=np.nan), placed=False), "Calibrate (./pose"),
        (Analysis(replace(VIEW, calibrated_cm=12.0)), "Calibrate again"),
        (Analysis(VIEW, stability=replace(STEADY, longest_gap_s=4.0)), "Keep the whole person"),
        (Analysis(replace(VIEW, calibrated_cm=11.0, best_rigid_cm=10.0)), "Look at the cameras"),
        (Analysis(VIEW, lacks="left_knee"), "Let a camera see left knee: none tracks it"),
        (Analysis(VIEW, unused=("left_thigh",)), "Look at the IMUs that are not used (left thigh)"),
        (Analysis(VIEW, segments=()), "Nothing has to be done; worn IMUs"),
        (Analysis(), "Nothing has to be done."),
    ],
)
def test_the_advice_is_of_the_worst_trouble(analysis, advice):
    assert verdict(analysis)[2].startswith(advice)


def test_the_pair_of_views_that_agrees_least_is_named():
    back = replace(VIEW, second="back", calibrated_cm=9.0)

    assert "left and back agree badly: the same joint is 9.0 cm" in verdict(Analysis(VIEW, back))[1]


def test_three_methods_are_compared_unless_others_are_named():
    known = ["left", "right", "mean", "joint_kf", "li2020", "default", "default+imus"]
    assert usual_methods(known, ["left", "right"]) == ("mean", "joint_kf", "default+imus")
    assert usual_methods(["left", "fused", *known], ["left"]) == ("left", "joint_kf", "fused")


def test_an_empty_table_is_left_out():
    tables = [
        Table(caption="", head="", columns=("a",), rows=rows)
        for rows in ((), (number_row("x", [np.nan], 1),), (number_row("x", [1.0], 1),))
    ]
    parts = [
        Section(anchor="some", title="", blocks=tables),
        Section(anchor="none", title="", blocks=tables[:2]),
    ]

    (left,) = without_empty(parts)

    assert left.blocks == tables[2:]


@pytest.mark.parametrize(
    ("analysis", "advice"),
    [
        (with_reference(0.51, 0.50, default=60.0), "Check the reference Vicon"),
        (with_reference(0.95, 0.93, default=5.0, left=4.0), "left is nearer to the reference"),
        (with_reference(0.95, 0.93, default=5.0, left=7.0), "Nothing has to be done."),
    ],
)
def test_a_reference_that_fits_badly_or_is_nearer_to_others_is_said(analysis, advice):
    assert verdict(analysis)[2].startswith(advice)
