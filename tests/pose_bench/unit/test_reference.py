"""The compiled filter equals the reference implementation and satisfies its equations."""

import numpy as np
import pytest
from equal_states import arrays_of, assert_equal_states
from scipy.spatial.transform import Rotation

from pose_bench.reference.default_filter import ReferenceFilter, inject_error
from pose_core.body.average_body import neutral_pose
from pose_core.body.kinematics import ForwardKinematics
from pose_core.body.model import load_body_model
from pose_core.body.segment_tree import SegmentTree, without_side
from pose_core.body.shape import shape_of
from pose_core.filter.camera import add_camera_rows, predict_view
from pose_core.filter.constants import make_constants
from pose_core.filter.frame import CameraFrame
from pose_core.filter.imu import NO_IMUS, ImuFrame, add_imu_rows
from pose_core.filter.interpolated import interpolate_published
from pose_core.filter.layout import make_layout
from pose_core.filter.motion import predict
from pose_core.filter.posture import add_posture_rows, undo_half_turns
from pose_core.filter.published import predict_published
from pose_core.filter.rows import make_rows
from pose_core.filter.sigma_points import linearise_joint
from pose_core.filter.state import start_state, with_imu, with_shared_offset
from pose_core.filter.step import StepResult, update_with_frame, update_with_imus
from pose_core.filter.tuning import FilterTuning
from pose_core.joints import JOINT_INDEX, LIMB_ENDS
from pose_core.kernels.joint_kinematics import compute_joints
from pose_core.kernels.published_state import PublishedState

MODEL = load_body_model("default")
SHAPE = shape_of(MODEL, neutral_pose())
KINEMATICS = ForwardKinematics(MODEL, SHAPE.offsets)
TREE = SegmentTree(MODEL, SHAPE)
CONSTANTS = make_constants(TREE, FilterTuning(), 0.02)
LINKS = len(TREE.parents)
LAYOUT = make_layout(LINKS, len(TREE.sliding_links))
CAMERAS = np.array([[3.0, 0.5, 1.2], [0.5, 3.0, 1.2]])
WORN = (0, 1, 3, 4, 5, 6, 7, 8, 9)
FAR_JOINTS = [JOINT_INDEX[far] for _, far in LIMB_ENDS.values()]


def test_a_link_shares_its_parents_acceleration():
    """Accelerations a = own + carried times the parent's: (I - C) a = own."""
    motion, names = FilterTuning().motion, [without_side(name) for name in MODEL.link_names]
    I_minus_C = np.eye(LINKS)
    for link, parent in enumerate(TREE.parents):
        if parent >= 0:
            I_minus_C[link, parent] = -motion.carried[names[link]]
    own = np.diag([motion.acceleration[name] ** 2 / 30.0 for name in names])
    power = np.linalg.solve(I_minus_C, np.linalg.solve(I_minus_C, own).T)
    np.testing.assert_allclose(CONSTANTS.motion.power, power, rtol=1e-12)
    assert CONSTANTS.motion.root_power == pytest.approx(motion.root_acceleration**2 / 30.0)


def pose_of(dof):
    return KINEMATICS.pose(dof)


def joints_of(pose):
    """Joint positions of a filter's pose [m], shape (15, 3)."""
    levers, joints = np.zeros_like(TREE.offsets), np.empty((len(TREE.offsets), 3))
    compute_joints(TREE.arrays, pose.position, pose.rotations, pose.slides, levers, joints)
    return joints


def random_state(rng, sensors=2, imus=(), dof=None):
    """A started state, with IMUs aligned; and the degrees of freedom it stands at."""
    dof = rng.normal(0.0, 0.3, MODEL.size) if dof is None else dof
    pose = pose_of(dof)
    slide_variance = CONSTANTS.motion.slide_variance
    state = start_state(LAYOUT, sensors, FilterTuning(), slide_variance, dof[:3], pose.rotations)
    state.views.delay[:] = CONSTANTS.tracker_errors.known_delay_s
    for link in imus:
        mounting = Rotation.random(random_state=rng).as_matrix()
        covariance = np.diag([0.1, 0.1, 0.2, 0.1]) ** 2
        state = with_imu(state, link, mounting, rng.uniform(-3.0, 3.0), covariance)
        state = with_shared_offset(state, int(rng.choice(FAR_JOINTS)), 0.01**2)
    return state, dof


def imus_of(rng, state, rotations, links, noise=0.05):
    """Samples of IMUs on links with these rotations."""
    R = np.empty((len(links), 3, 3))
    for row, link in enumerate(links):
        heading = Rotation.from_euler("z", state.imus.heading[link]).as_matrix()
        turned = Rotation.from_rotvec(rng.normal(0.0, noise, 3)).as_matrix()
        R[row] = heading.T @ turned @ rotations[link] @ state.imus.R_sensor_link[link].T
    age_s, rate_stddev = rng.choice([0.0, 0.02], len(links)), rng.choice([0.0, 0.2], len(links))
    rates = rng.normal(0.0, 1.0, (len(links), 3))
    return ImuFrame(np.array(links, np.int64), R, rates, age_s, rate_stddev)


def random_frame(rng, joints, sensor):
    """A frame with joints unseen, inferred and far off."""
    positions = joints + rng.normal(0.0, 0.03, joints.shape)
    positions[rng.random(15) < 0.1] = np.nan
    positions[rng.random(15) < 0.1] += rng.normal(0.0, 0.6, 3)
    states = rng.choice([0, 1, 2], size=15, p=[0.1, 0.2, 0.7]).astype(np.uint8)
    return CameraFrame(sensor, positions, states, CAMERAS[sensor].copy())


def frame_of_nothing():
    """A frame in which no joint is seen."""
    return CameraFrame(0, np.full((15, 3), np.nan), np.zeros(15, np.uint8), CAMERAS[0].copy())


@pytest.mark.parametrize("sensors", [1, 2])
@pytest.mark.parametrize("links", [(), (3, 7), WORN])
@pytest.mark.parametrize("seed", [3, 4])
def test_the_compiled_filter_equals_the_plain_one(sensors, links, seed):
    rng = np.random.default_rng(seed)
    state, dof = random_state(rng, sensors, links)
    plain = ReferenceFilter(CONSTANTS, state)
    for step in range(30):
        dof = dof + rng.normal(0.0, 0.05, MODEL.size)
        truth = pose_of(dof)
        dt_s = rng.uniform(0.001, 0.05)
        predict(CONSTANTS.motion, state, dt_s)
        plain.predict(dt_s)
        heard = [link for link in links if rng.random() > 0.2]  # the others are silent
        imus = imus_of(rng, state, truth.rotations, heard) if heard else NO_IMUS
        frame = random_frame(rng, truth.positions, step % sensors)
        information = np.zeros((2, LINKS, 3, 3))
        assert update_with_imus(CONSTANTS, state, imus, information[1])
        result = StepResult(*update_with_frame(CONSTANTS, state, frame, information[0]))
        by_imus = plain.update_with_imus(imus)
        expected, by_camera = plain.update_with_frame(frame)
        assert_equal_states(state, plain.state)
        np.testing.assert_allclose(information, [by_camera, by_imus], rtol=1e-7, atol=1e-7)
        assert result == pytest.approx(expected, rel=1e-7, nan_ok=True)


def noise_learnt_with_trackers_that_are(late_s, absent=0):
    """Mean factor of the IMUs' noise after frames of two cameras with the same errors."""
    errors = CONSTANTS.tracker_errors._replace(known_delay_s=late_s, delay_prior=1e6)
    constants = CONSTANTS._replace(tracker_errors=errors)
    rng = np.random.default_rng(8)
    state, dof = random_state(rng, sensors=2 + absent, imus=WORN)
    state.views.delay[:2], state.views.delay[2:], state.imus.noise[:] = late_s, 0.0, 4.0
    plain, truth = ReferenceFilter(constants, state), pose_of(dof)
    for step in range(20):
        predict(constants.motion, state, 0.02)
        plain.predict(0.02)
        imus = imus_of(rng, state, truth.rotations, WORN)
        if step % 2 == 0:
            shared = truth.positions + rng.normal(0.0, 0.03, (15, 3))
        frame = CameraFrame(step % 2, shared, np.full(15, 2, np.uint8), CAMERAS[step % 2].copy())
        information = np.zeros((2, LINKS, 3, 3))
        update_with_imus(constants, state, imus, information[1])
        update_with_frame(constants, state, frame, information[0])
        plain.update_with_imus(imus)
        plain.update_with_frame(frame)
        assert_equal_states(state, plain.state)
    return state.imus.noise[list(WORN)].mean()


def test_what_cameras_see_alike_is_blamed_on_an_imu_the_less_the_later_their_trackers_are():
    in_time, later, smoothing = map(noise_learnt_with_trackers_that_are, (0.0, 0.1, 0.15))
    assert in_time > later > smoothing


def test_cameras_that_are_absent_say_nothing_about_the_delay_of_the_others():
    in_time, smoothing = (noise_learnt_with_trackers_that_are(s, absent=2) for s in (0.0, 0.15))
    assert smoothing < 0.9 * in_time


def published(state, dt_s, earlier=NO_IMUS, imus=NO_IMUS):
    shapes = [(3,), (3,), (LINKS, 3, 3), (LINKS, 3), (15, 3), (3,), (LINKS, 3, 3)]
    out = PublishedState(*map(np.zeros, [*shapes, (2, LINKS, 3, 3), (1,), (1,)]))
    unchanged = state.copy()
    predict_published(CONSTANTS, state, dt_s, earlier, imus, out)
    for name, before in arrays_of(unchanged).items():
        np.testing.assert_array_equal(arrays_of(state)[name], before)
    return out


def test_the_published_part_of_a_later_instant_is_that_of_the_predicted_state():
    state, _ = random_state(np.random.default_rng(16))
    ahead = published(state, 0.02)
    predict(CONSTANTS.motion, state, 0.02)
    for name, value in published(state, 0.0)._asdict().items():
        if name not in ("position", "joints", "position_variance", "ahead_s"):
            np.testing.assert_allclose(getattr(ahead, name), value, rtol=1e-9, atol=1e-12)


def test_the_published_position_keeps_its_velocity_for_a_while():
    state, _ = random_state(np.random.default_rng(16))
    state.pose.velocity[:] = 1.2, -0.4, 0.1
    state.pose.rates[:] = 0.0
    now, ahead = published(state, 0.0), published(state, 0.1)
    moved = np.array([0.12, -0.04, 0.01])
    np.testing.assert_allclose(ahead.position - now.position, moved, atol=1e-12)
    rigid = [JOINT_INDEX["neck"], JOINT_INDEX["torso"]]
    np.testing.assert_allclose((ahead.joints - now.joints)[rigid], [moved] * 2, atol=1e-12)
    much_later = published(state, 1.0).position - now.position
    np.testing.assert_allclose(much_later, 0.2 * state.pose.velocity, atol=1e-12)


def test_between_two_frames_a_link_turns_as_its_imu_does():
    rng, dt_s = np.random.default_rng(17), 0.02
    state, dof = random_state(rng, imus=WORN)
    before = imus_of(rng, state, pose_of(dof).rotations, WORN)
    later = imus_of(rng, state, pose_of(dof + 0.05).rotations, WORN)
    now, ahead = published(state, 0.0, before, before), published(state, dt_s, before, later)
    for row, link in enumerate(WORN):
        R_z = Rotation.from_rotvec([0.0, 0.0, state.imus.heading[link]]).as_matrix()
        change = R_z @ later.R_world_sensor[row] @ later.angular_velocity[row]
        change -= R_z @ before.R_world_sensor[row] @ before.angular_velocity[row]
        np.testing.assert_allclose(ahead.rates[link], now.rates[link] + change, atol=1e-12)
        turn = R_z @ later.R_world_sensor[row] @ before.R_world_sensor[row].T @ R_z.T
        np.testing.assert_allclose(ahead.rotations[link], turn @ now.rotations[link], atol=1e-12)
    measured = [link for link in WORN if TREE.parents[link] in WORN]
    np.testing.assert_allclose(ahead.covariance[measured], now.covariance[measured], rtol=1e-9)


@pytest.mark.parametrize("latency_s", [0.05, 0.13])
def test_a_swinging_limb_is_predicted_over_a_cameras_latency(latency_s):
    rng, shank = np.random.default_rng(21), MODEL.link_names.index("left_shank")
    swing = 1.0  # [rad]

    def swung(state, at_s):
        """The IMU's sample, with the shank's rotation and rate [rad/s], at an instant."""
        phase = 2.0 * np.pi * 2.0 * at_s  # [rad] of two swings a second
        turn = Rotation.from_rotvec([0.0, swing * np.sin(phase), 0.0]).as_matrix()
        rate = np.array([0.0, swing * 4.0 * np.pi * np.cos(phase), 0.0])
        rotations = rest.copy()
        rotations[shank] = turn @ rest[shank]
        imu = imus_of(rng, state, rotations, [shank], noise=0.0)
        R_z = Rotation.from_rotvec([0.0, 0.0, state.imus.heading[shank]]).as_matrix()
        imu.angular_velocity[0] = (R_z @ imu.R_world_sensor[0]).T @ rate
        return imu, rotations[shank], rate

    state, dof = random_state(rng, imus=[shank])
    rest = pose_of(dof).rotations.copy()
    for start_s in np.arange(0.0, 0.5, 0.05):
        before, state.pose.rotations[shank], state.pose.rates[shank] = swung(state, start_s)
        later, expected, rate = swung(state, start_s + latency_s)
        ahead = published(state, latency_s, before, later)
        np.testing.assert_allclose(ahead.rotations[shank], expected, atol=1e-9)
        np.testing.assert_allclose(ahead.rates[shank], rate, atol=1e-9)


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_between_two_states_of_a_recording_links_rotate_steadily_or_by_their_imus_rates(share):
    rng, interval_s = np.random.default_rng(18), 0.03
    state, dof = random_state(rng, imus=WORN)
    before = state.copy().pose
    state.pose.rotations[:] = pose_of(dof + 0.02).rotations
    state.imus.is_used[:] = np.isin(np.arange(LINKS), WORN)
    out = PublishedState(*(np.zeros((1, *each.shape)) for each in published(state, 0.0)))
    shares = np.array([share])
    interpolate_published(CONSTANTS, before, state, interval_s, shares, out)
    apart = Rotation.from_matrix(state.pose.rotations @ np.swapaxes(before.rotations, 1, 2))
    turned = Rotation.from_matrix(out.rotations[0] @ np.swapaxes(before.rotations, 1, 2))
    worn, free = state.imus.is_used, ~state.imus.is_used
    expected = share * apart.as_rotvec()
    np.testing.assert_allclose(turned.as_rotvec()[free], expected[free], atol=1e-9)
    if share in (0.0, 1.0):
        np.testing.assert_allclose(turned.as_rotvec()[worn], expected[worn], atol=1e-9)
    else:  # the cubic, whose slopes at both ends are the rates
        first, second = (T * interval_s for T in (before.rates[worn], state.pose.rates[worn]))
        whole = apart.as_rotvec()[worn]
        second = second - 0.5 * np.cross(whole, second)
        h = [share**3 - 2 * share**2 + share, 3 * share**2 - 2 * share**3, share**3 - share**2]
        cubic = h[0] * first + h[1] * whole + h[2] * second
        np.testing.assert_allclose(turned.as_rotvec()[worn], cubic, atol=1e-9)
    if share == 1.0:
        for name, value in published(state, 0.0)._asdict().items():
            if name not in ("information", "scale"):
                np.testing.assert_allclose(getattr(out, name)[0], value, atol=1e-9)


def test_a_frame_that_shows_nothing_leaves_the_posture_alone_to_correct():
    state, _ = random_state(np.random.default_rng(5))
    plain = ReferenceFilter(CONSTANTS, state)
    frame = frame_of_nothing()
    result = StepResult(*update_with_frame(CONSTANTS, state, frame, np.zeros((LINKS, 3, 3))))
    plain.update_with_frame(frame)
    assert np.isnan(result.mean_nis)
    assert_equal_states(state, plain.state)


def rows_of(state, add):
    """The derivatives and the residuals of the rows that ``add`` adds for a state."""
    rows = make_rows(200, 100, len(state.P))
    add(state, rows)
    count = rows.filled[0]
    return rows.H[:count], rows.residual[:count]


def slope(state, add, step=1e-6):
    """The derivative of the rows' prediction by the state's error, by central differences."""
    result = []
    for column in range(len(state.P)):
        error = np.zeros(len(state.P))
        error[column] = step
        ahead, behind = state.copy(), state.copy()
        inject_error(ahead, error)
        inject_error(behind, -error)
        change = rows_of(ahead, add)[1] - rows_of(behind, add)[1]
        result.append(-change / (2.0 * step))
    return np.array(result).T


def assert_slope(state, add, atol, columns=slice(None)):
    H, _ = rows_of(state, add)
    assert len(H) > 0
    np.testing.assert_allclose(H[:, columns], slope(state, add)[:, columns], atol=atol)


@pytest.mark.parametrize("rate", [0.0, 2.0])
def test_derivatives_of_camera_rows(rate):
    rng = np.random.default_rng(6)
    state, dof = random_state(rng, imus=(3,))
    state.views.delay[:] = 0.0
    state.pose.rates[:] = rng.uniform(-rate, rate, (LINKS, 3))
    state.P[:] *= 1e-8  # where the points' line is the tangent
    tracked = np.full(15, 2, np.uint8)
    frame = CameraFrame(0, pose_of(dof).positions, tracked, CAMERAS[0].copy())

    def add(at, rows):
        view = predict_view(CONSTANTS.camera, at, frame)
        add_camera_rows(CONSTANTS.camera, at, frame, view, rows)

    assert_slope(state, add, 1e-8)


def test_derivatives_of_imu_rows_but_for_a_rate_by_the_heading():
    rng = np.random.default_rng(7)
    links = (0, 4)
    state, dof = random_state(rng, imus=links)
    imus = imus_of(rng, state, pose_of(dof).rotations, links, noise=0.0)

    def add(at, rows):
        add_imu_rows(CONSTANTS.imu, at, imus, rows)

    headings = state.imus.column[list(links)] + 3
    assert_slope(state, add, 1e-8, np.setdiff1d(np.arange(len(state.P)), headings))
    H, _ = rows_of(state, add)
    by_heading = slope(state, add)[:, headings]
    orientation = [row for row in range(len(H)) if row % 6 < 3]
    np.testing.assert_allclose(H[orientation][:, headings], by_heading[orientation], atol=1e-8)


def bend_hinges(state, angle):
    """Bend all hinges by an angle about their parent's lateral axis, in place."""
    posture = CONSTANTS.posture
    R_parent_link = Rotation.from_euler("y", angle).as_matrix()
    for parent, link in zip(posture.hinges.parents, posture.hinges.links, strict=True):
        state.pose.rotations[link] = state.pose.rotations[parent] @ R_parent_link


@pytest.mark.parametrize("angle", [0.7, -0.7])
def test_derivatives_of_hinge_twist_and_spine_rows(angle):
    state, _ = random_state(np.random.default_rng(8), dof=np.zeros(MODEL.size))
    bend_hinges(state, angle)
    assert_slope(
        state, lambda at, rows: add_posture_rows(CONSTANTS.posture, at.pose.rotations, rows), 1e-8
    )


@pytest.mark.parametrize("angle", [1.2, -1.2])
def test_limbs_bent_the_wrong_way_are_turned_back_by_both(angle):
    state, _ = random_state(np.random.default_rng(13), dof=np.zeros(MODEL.size))
    bend_hinges(state, angle)
    plain = ReferenceFilter(CONSTANTS, state)
    frame = frame_of_nothing()
    result = StepResult(*update_with_frame(CONSTANTS, state, frame, np.zeros((LINKS, 3, 3))))
    assert result.turned_back == plain.update_with_frame(frame)[0].turned_back == 2
    assert_equal_states(state, plain.state)


@pytest.mark.parametrize("has_imu", [False, True])
@pytest.mark.parametrize("link", ["left_shank", "right_forearm"])
def test_a_link_half_a_turn_off_about_its_own_axis_is_turned_back_alone(link, has_imu):
    """Opposite lateral axes satisfy the hinge, too; a link with an IMU stays."""
    lower = MODEL.link_names.index(link)
    upper = TREE.parents[lower]
    true, _ = random_state(np.random.default_rng(14), dof=np.zeros(MODEL.size))
    bend_hinges(true, 0.6)
    state, _ = random_state(np.random.default_rng(14), dof=np.zeros(MODEL.size))
    bend_hinges(state, 0.6)
    state.imus.is_used[lower] = has_imu
    off, kept = (upper, lower) if has_imu else (lower, upper)
    state.pose.rotations[off] = state.pose.rotations[off] @ np.diag([-1.0, -1.0, 1.0])
    joints = joints_of(state.pose)
    assert undo_half_turns(CONSTANTS.posture, state, np.empty((3, 3))) == 1
    np.testing.assert_array_equal(state.pose.rotations[kept], true.pose.rotations[kept])
    np.testing.assert_allclose(state.pose.rotations, true.pose.rotations, atol=1e-12)
    if not has_imu:
        np.testing.assert_allclose(joints_of(state.pose), joints, atol=1e-12)


def test_derivatives_of_a_hinges_plane_hold_out_of_the_plane_too():
    state, _ = random_state(np.random.default_rng(9))

    def add(at, rows):
        add_posture_rows(CONSTANTS.posture, at.pose.rotations, rows)

    H, exact = rows_of(state, add)[0], slope(state, add)
    np.testing.assert_allclose(H[:2], exact[:2], atol=1e-8)


def test_the_covariance_stays_symmetric_and_positive_over_ten_thousand_steps():
    rng = np.random.default_rng(10)
    state, dof = random_state(rng, imus=WORN)
    information = np.zeros((LINKS, 3, 3))
    truths = [pose_of(dof + rng.normal(0.0, 0.2, MODEL.size)) for _ in range(20)]
    instants = [
        (random_frame(rng, truth.positions, k % 2), imus_of(rng, state, truth.rotations, WORN))
        for truth in truths
        for k in range(25)
    ]
    for step in range(10_000):
        frame, imus = instants[step % len(instants)]
        predict(CONSTANTS.motion, state, float(rng.choice([1e-4, 0.01, 0.03, 0.5])))
        if step % 3:
            assert update_with_imus(CONSTANTS, state, imus, information)
        assert StepResult(*update_with_frame(CONSTANTS, state, frame, information)).is_finite
        if step % 50 == 0:
            assert np.all(state.P == state.P.T)
            assert np.linalg.eigvalsh(state.P)[0] > 0.0


def test_one_joint_a_metre_off_moves_the_pose_by_little():
    state, dof = random_state(np.random.default_rng(11), dof=np.zeros(MODEL.size))
    joints, tracked = pose_of(dof).positions, np.full(15, 2, np.uint8)

    def take(positions, sensor):
        predict(CONSTANTS.motion, state, 1.0 / 30.0)
        frame = CameraFrame(sensor, positions, tracked, CAMERAS[sensor].copy())
        update_with_frame(CONSTANTS, state, frame, np.zeros((LINKS, 3, 3)))

    for step in range(60):
        take(joints, step % 2)
    before = joints_of(state.pose)
    off = joints.copy()
    off[5] += [0.0, 0.0, 1.0]
    take(off, 0)
    assert np.linalg.norm(joints_of(state.pose) - before, axis=1).max() < 0.02


@pytest.mark.parametrize(("turn", "least", "most"), [(6.0, 0.3, 0.65), (30.0, 0.8, 1.1)])
def test_of_a_hips_line_that_is_seen_turned_for_a_minute_what_offsets_explain_is_put_right(
    turn, least, most
):
    state, dof = random_state(np.random.default_rng(15), dof=np.zeros(MODEL.size))
    joints, tracked = pose_of(dof).positions.copy(), np.full(15, 2, np.uint8)
    left, right = JOINT_INDEX["left_hip"], JOINT_INDEX["right_hip"]
    line = joints[left] - joints[right]
    turned = Rotation.from_euler("z", turn, degrees=True).apply(line)
    joints[left] += 0.5 * (turned - line)
    joints[right] -= 0.5 * (turned - line)

    def turn_after(seconds):
        for step in range(int(30 * seconds)):
            predict(CONSTANTS.motion, state, 1.0 / 30.0)
            frame = CameraFrame(step % 2, joints, tracked, CAMERAS[step % 2].copy())
            update_with_frame(CONSTANTS, state, frame, np.zeros((LINKS, 3, 3)))
        placed = joints_of(state.pose)
        x, y, _ = placed[left] - placed[right]
        return np.degrees(np.arctan2(-x, y))

    at_once = turn_after(0.5)
    assert at_once > 0.6 * turn
    assert least < turn_after(60.0) / at_once < most


def test_no_kernel_is_compiled_twice():
    test_the_compiled_filter_equals_the_plain_one(2, (3, 7), 12)
    kernels = (predict, update_with_imus, update_with_frame)
    assert {k.py_func.__name__: len(k.signatures) for k in kernels if len(k.signatures) > 1} == {}


def test_a_joints_line_and_noise_have_the_moments_of_its_place():
    rng = np.random.default_rng(14)
    state, _ = random_state(rng)
    factor = rng.normal(0.0, 0.015, (len(state.P), len(state.P)))  # 0.15 rad
    state.P[:] = factor @ factor.T
    body, joint = CONSTANTS.camera.body, JOINT_INDEX["left_hand"]
    levers, places = np.zeros((15, LINKS, 3)), np.empty((15, 3))
    pose = state.pose
    compute_joints(body, pose.position, pose.rotations, pose.slides, levers, places)
    H, shift, noise = np.zeros((3, len(state.P))), np.empty(3), np.zeros((3, 3))
    linearise_joint(body, joint, levers, state.P, H, shift, noise)

    links = slice(3, 3 + 3 * LINKS)
    errors = rng.multivariate_normal(np.zeros(3 * LINKS), state.P[links, links], 200_000)
    turns = Rotation.from_rotvec(errors.reshape(-1, 3)).as_matrix().reshape(-1, LINKS, 3, 3)
    moved = np.einsum("nlik,lk->ni", turns, levers[joint]) - levers[joint].sum(axis=0)
    np.testing.assert_allclose(shift, moved.mean(axis=0), atol=0.1 * np.linalg.norm(shift))
    total = H[:, links] @ state.P[links, links] @ H[:, links].T + noise
    np.testing.assert_allclose(total, np.cov(moved.T), atol=0.05 * np.abs(total).max())
