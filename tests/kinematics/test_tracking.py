"""Laws of pose tracking: how errors decay, on bases that can go anywhere and on those with fixed tyres."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import robots
import rollerbench as rb
from rollerbench.kinematics.odometry import integrate
from rollerbench.kinematics.tracking import TrackingGains, axle, pose_error, tracking_law

DT = 2e-3
GAINS = TrackingGains(position=3.0, heading=2.0, lateral=4.0)


def driven(kinematics, twists, starts, duration, gains=GAINS):
    """Pose errors (k, n, 3) over time of n ideal bases that track references of constant twists (n, 3)."""
    law = tracking_law(kinematics, gains)
    twists, q = np.broadcast_arrays(np.atleast_2d(twists).astype(float), np.atleast_2d(starts))
    reference, errors = np.zeros_like(q), []
    for _ in range(round(duration / DT)):
        errors.append(pose_error(q.T, reference.T).T)
        q = integrate(q, law(q.T, reference.T, twists.T).T, np.full(len(q), DT))
        reference = integrate(reference, twists, np.full(len(q), DT))
    return np.array(errors)


def anything(seed: int, count: int = 100):
    """Random poses and twists (count, 3)."""
    rng = np.random.default_rng(seed)
    return rng.uniform(-1, 1, (count, 3)) * [1, 1, 3], rng.uniform(-1, 1, (count, 3))


def test_errors_of_an_omnidirectional_base_decay_on_their_own() -> None:
    starts, twists = anything(0)
    errors = driven(rb.WheelKinematics("youbot_base"), twists, starts, 1.0)
    distance, time = np.hypot(errors[..., 0], errors[..., 1]), DT * np.arange(len(errors))[:, np.newaxis]
    # 1 % and 5 mm: the twist is held for two milliseconds.
    assert_allclose(distance, distance[0] * np.exp(-3.0 * time), rtol=0.01, atol=5e-3)
    assert_allclose(errors[..., 2], errors[0, :, 2] * np.exp(-2.0 * time), rtol=0.01)


def test_the_lyapunov_function_of_the_unicycle_falls() -> None:
    starts, twists = anything(1)
    errors = driven(rb.WheelKinematics(robots.cart()), twists * [1, 0, 1], starts, 1.0)
    energy = 4.0**2 * (errors[..., 0] ** 2 + errors[..., 1] ** 2) + errors[..., 2] ** 2
    # Held twists: the explicit step may add a little where there is nothing left to lose.
    assert (np.diff(energy, axis=0) <= 1e-3 * energy[0]).all()
    assert (energy[-1] < 0.9 * energy[0]).all()


def test_a_cart_comes_back_to_its_path_forwards_and_backwards() -> None:
    twists = [[0.3, 0.0, 0.2], [-0.3, 0.0, 0.2]]
    errors = driven(rb.WheelKinematics(robots.cart()), twists, (0.1, -0.2, 0.6), 10.0)
    assert np.abs(errors[-1]).max() < 5e-3


def shifted_cart(offset: float, heading_deg: float) -> dict:
    """The cart with its two tyres on another axle, at a distance from Bo; looking another way."""
    data = robots.cart()
    along = np.array([np.cos(np.radians(heading_deg)), np.sin(np.radians(heading_deg))])
    left = np.array([-along[1], along[0]])
    for wheel, side in zip(data["wheels"], (0.2, -0.2), strict=False):
        wheel["position"] = (offset * along + side * left).tolist()
        wheel["heading_deg"] = heading_deg
    data["wheels"][2]["position"] = [*(-0.25 * along).tolist(), -0.06]
    data["body"]["center_of_mass"] = [*((0.5 * offset - 0.05) * along).tolist(), 0.03]
    return data


@pytest.mark.parametrize(
    ("offset", "heading_deg"), [(0.0, 0.0), (-0.1, 0.0), (0.05, 90.0), (-0.08, 180.0), (0.1, 30.0)]
)
def test_a_cart_tracks_wherever_its_axle_is(offset: float, heading_deg: float) -> None:
    kinematics = rb.WheelKinematics(shifted_cart(offset, heading_deg))
    place, heading = axle(kinematics)
    forward = np.array([np.cos(heading), np.sin(heading)])
    twist = np.array([0.4 * forward[0] + 0.3 * place[1], 0.4 * forward[1] - 0.3 * place[0], 0.3])
    kinematics.require_feasible(twist)
    law = tracking_law(kinematics, GAINS)
    rng = np.random.default_rng(0)
    for _ in range(20):
        kinematics.require_feasible(law(rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 3), twist))
    assert_allclose(law(np.zeros(3), np.zeros(3), twist), twist, atol=1e-12)
    assert np.abs(driven(kinematics, twist, (0.02, -0.02, 0.1), 3.0)[-1]).max() < 0.01


def test_with_one_motion_left_the_way_along_it_is_tracked() -> None:
    data = robots.cart()
    data["wheels"].append({**data["wheels"][0], "name": "ahead", "position": [0.3, 0.0], "driven": False})
    kinematics = rb.WheelKinematics(data)
    assert kinematics.mobility().degree_of_mobility == 1
    errors = driven(kinematics, (0.2, 0.0, 0.0), (-0.1, 0.0, 0.0), 3.0)
    assert np.abs(errors[-1]).max() < 1e-4


@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf])
def test_bad_gains_are_named(value: float) -> None:
    with pytest.raises(rb.KinematicsError, match="position"):
        TrackingGains(position=value)


@pytest.mark.parametrize("robot", ["differential_cart", "kiwi"])
def test_twists_of_another_point_are_refused(robot: str) -> None:
    kinematics = rb.WheelKinematics(robot).at([0.1, 0.0])
    for make in (tracking_law, axle):
        with pytest.raises(rb.KinematicsError, match=r"p_BoCo_B = \[0.1, 0.0\]: .* accepted: \[0, 0\]"):
            make(kinematics)
