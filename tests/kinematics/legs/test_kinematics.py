"""A leg's pose and Jacobian: by hand, by differences, by Drake, and as printed."""

import functools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import rollerbench as rb
from rollerbench.description.legs import FootWheel, Leg, Link

SONG = [(0.0, 90.0, 0.0, 0.0), (0.09, 0.0, 0.0, 0.0), (0.0, -90.0, 0.0, 90.0), (0.09, -90.0, -0.09, 0.0)]
OTHER = [
    (0.03, 90.0, 0.02, 10.0),
    (0.15, 5.0, 0.0, 0.0),
    (0.12, -30.0, 0.01, -90.0),
    (0.1, 20, 0.0, 0),
    (0.05, 0, 0, 0),
]
THREE = [(0.05, 90.0, 0.0, 0.0), (0.2, 0.0, 0.0, 0.0), (0.25, 0.0, 0.0, 0.0)]


def make_leg(rows, limit=180.0) -> Leg:
    links = tuple(
        Link(a=a, alpha_deg=alpha, d=d, theta_offset_deg=offset, mass=0.5, min_deg=-limit, max_deg=limit)
        for a, alpha, d, offset in rows
    )
    wheel = FootWheel(radius=0.05, width=0.03, mass=0.3)
    posture = (10.0, 20.0, -70.0, 30.0, 40.0)[: len(rows)]
    return Leg(name="leg", hip=(0.0, 0.0, 0.0), links=links, wheel=wheel, postures={"stand": posture})


def by_hand(rows, q):
    """Product of the Denavit-Hartenberg matrices as textbooks print them; q may be complex."""
    pose = np.eye(4)
    for (a, alpha, d, offset), angle in zip(rows, q, strict=True):
        c, s = np.cos(angle + np.radians(offset)), np.sin(angle + np.radians(offset))
        ca, sa = np.cos(np.radians(alpha)), np.sin(np.radians(alpha))
        pose = pose @ np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])
    return pose


chains = st.sampled_from([SONG, OTHER, THREE])
angles = st.lists(st.floats(-3.1, 3.1), min_size=5, max_size=5)


def test_printed_position() -> None:
    position = rb.legs.LegKinematics(make_leg(SONG)).position(np.radians([90, 30, 45, 60]))
    assert_allclose(position, [-0.0779423, 0.0577693, 0.1435802], atol=5e-8)  # as many digits as the paper prints


@given(chains, angles)
def test_forward_is_the_product_of_the_rows(rows, q) -> None:
    kinematics = rb.legs.LegKinematics(make_leg(rows))
    q = np.array(q[: len(rows)])
    assert_allclose(kinematics.forward(q), by_hand(rows, q), atol=1e-14)
    assert_allclose(kinematics.position(q), by_hand(rows, q)[:3, 3], atol=1e-14)


@given(chains, angles)
def test_jacobian_is_the_derivative(rows, q) -> None:
    kinematics = rb.legs.LegKinematics(make_leg(rows))
    q = np.array(q[: len(rows)])
    jacobian = kinematics.jacobian(q)
    for joint, column in enumerate(jacobian.T):
        step = np.zeros(len(q))
        step[joint] = 1.0
        derivative = by_hand(rows, q + 1e-30j * step).imag / 1e-30
        assert_allclose(column[3:], derivative[:3, 3], atol=1e-14)
        spin = derivative[:3, :3] @ by_hand(rows, q)[:3, :3].T
        assert_allclose(column[:3], [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-14)
        difference = (kinematics.position(q + 1e-6 * step) - kinematics.position(q - 1e-6 * step)) / 2e-6
        assert_allclose(column[3:], difference, atol=1e-9)


def test_broadcasts() -> None:
    kinematics = rb.legs.LegKinematics(make_leg(SONG))
    q = np.random.default_rng(1).uniform(-3, 3, (5, 2, 4))
    assert kinematics.forward(q).shape == (5, 2, 4, 4)
    assert_allclose(kinematics.jacobian(q)[3, 1], kinematics.jacobian(q[3, 1]), atol=1e-16)
    assert kinematics.singularity(q).cause.shape == (5, 2)


def test_axle_of_the_foot() -> None:
    # The wheel's axle as the closed forms have it: upright iff s4 c_phi = 0.
    q = np.random.default_rng(2).uniform(-3, 3, (100, 4))
    pose = rb.legs.LegKinematics(make_leg(SONG)).forward(q)
    phi, (c1, s1), (c4, s4) = q[:, 1] + q[:, 2], (np.cos(q[:, 0]), np.sin(q[:, 0])), (np.cos(q[:, 3]), np.sin(q[:, 3]))
    along, across = s4 * np.sin(phi), c4
    axle = np.stack([c1 * along - s1 * across, s1 * along + c1 * across, -s4 * np.cos(phi)], axis=-1)
    assert_allclose(pose[:, :3, 2], axle, atol=1e-14)


@given(angles)
def test_determinant_of_the_first_three_joints(q) -> None:
    kinematics = rb.legs.LegKinematics(rb.load_robot("wheel_leg_hexapod").legs[0])
    found = kinematics.singularity(q[:4])
    jacobian = kinematics.jacobian(q[:4])[3:]
    assert found.determinant == pytest.approx(abs(np.linalg.det(jacobian[:, :3])), abs=1e-16)
    assert found.smallest_singular_value == pytest.approx(np.linalg.svd(jacobian)[1][-1], abs=1e-15)


def test_singular_poses() -> None:
    robot = rb.load_robot("wheel_leg_hexapod")
    kinematics = rb.legs.LegKinematics(robot.legs[0])
    mammal = kinematics.singularity(robot.legs[0].posture("mammal"))
    assert mammal.cause == "hip"  # the foot is under the hip
    assert mammal.hip_distance < 0.001
    assert mammal.determinant < 0.001 * 0.2 * np.hypot(0.22, 0.09)
    lead = np.arctan2(0.09, 0.22)
    stretched = kinematics.singularity([0.0, 0.3, -lead, 0.0])
    assert stretched.cause == "knee"
    assert stretched.knee_distance == pytest.approx(0.0, abs=1e-15)
    assert stretched.determinant == pytest.approx(0.0, abs=1e-15)
    other = rb.legs.LegKinematics(make_leg(THREE)).singularity([0.1, 0.2, 0.0])
    assert other.determinant is None
    assert other.cause is None
    assert other.smallest_singular_value == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("rows", [SONG, OTHER, THREE], ids=["song", "five", "three"])
def test_drake_agrees(rows) -> None:
    from pydrake.math import RigidTransform, RotationMatrix
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import FixedOffsetFrame, JacobianWrtVariable, RevoluteJoint, SpatialInertia

    plant = MultibodyPlant(0.001)
    frame, base = plant.world_frame(), plant.world_frame()
    for index, (a, alpha, d, offset) in enumerate(rows):
        turned = RigidTransform(RotationMatrix.MakeZRotation(np.radians(offset)), [0, 0, 0])
        start = plant.AddFrame(FixedOffsetFrame(f"joint{index}", frame, turned))
        link = plant.AddRigidBody(f"link{index}", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        plant.AddJoint(RevoluteJoint(f"q{index}", start, link.body_frame(), [0, 0, 1]))
        end = RigidTransform(RotationMatrix.MakeXRotation(np.radians(alpha)), [a, 0, d])
        frame = plant.AddFrame(FixedOffsetFrame(f"end{index}", link.body_frame(), end))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    kinematics = rb.legs.LegKinematics(make_leg(rows))
    for q in np.random.default_rng(3).uniform(-3, 3, (20, len(rows))):
        plant.SetPositions(context, q)
        assert_allclose(kinematics.forward(q), frame.CalcPose(context, base).GetAsMatrix4(), atol=1e-13)
        jacobian = functools.partial(
            plant.CalcJacobianSpatialVelocity, context, JacobianWrtVariable.kV, frame, np.zeros(3), base, base
        )
        assert_allclose(kinematics.jacobian(q), jacobian(), atol=1e-13)


@pytest.mark.parametrize("q", [[0.0, 1.0], [[0.0] * 5], 1.0, [0.0, 0.0, np.nan, 0.0]])
def test_wrong_angles_are_refused(q) -> None:
    with pytest.raises(rb.KinematicsError, match="q "):
        rb.legs.LegKinematics(make_leg(SONG)).forward(q)
