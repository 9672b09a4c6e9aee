"""Uneven ground: the same seed gives the same ground, and contacts are recorded as Drake sees them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robots
import rollerbench as rb
from contacts import steps_with_contacts

BUMPS = {"height": 0.002, "width": 0.06, "density": 60}
ROUGH: dict[str, Any] = {
    **{"name": "rough", "robot": "youbot_base", "duration": 2.0, "seed": 1, "recording": {"html": False}},
    "command": {"type": "twist", "v_xyw_B": [0.3, 0.1, 0.3], "ramp": 0.5},
    "errors": {"ground_bumps": BUMPS},
}


@pytest.mark.usefixtures("undrawn")
def test_the_seed_makes_the_ground(tmp_path: Path) -> None:
    first = rb.run(ROUGH, output=tmp_path / "first")
    assert first.folder is not None
    again = rb.run(first.folder / "scenario.yaml", output=tmp_path / "again")
    assert again.recording.to_bytes() == first.recording.to_bytes()
    other = rb.run({**ROUGH, "seed": 2}, save=False)
    assert np.abs(other.recording.columns["z"] - first.recording.columns["z"]).max() > 1e-4
    # The body rises by no more than its highest wheel, and starts on level ground.
    z = first.recording.columns["z"]
    assert z[:10] == pytest.approx(z[0], abs=2e-5)
    assert 0.2 * BUMPS["height"] < z.max() - z[0] < BUMPS["height"]
    assert first.summary["status"] == "ok"


@pytest.mark.parametrize(
    ("make", "bumps", "slip_tolerance"),
    [("youbot_base", BUMPS, 8e-3), (robots.cart(), {**BUMPS, "width": 0.2}, 1e-4)],
)
def test_depth_contact_and_slip_on_bumps_are_those_of_drake(
    make: Any, bumps: dict[str, float], slip_tolerance: float
) -> None:
    """The deepest contact of each wheel with Drake's: Drake seeks it by iteration, to within 1 % of the depth.

    Its normal is uncertain by up to 0.15 rad then. So a roller that hits a bump at 0.4 m/s has some of its speed along
    the normal counted as slip.
    """
    from rollerbench.kinematics.contact import wheel_contact
    from rollerbench.plant.ground import BUMPS as CARRIER

    command = {**ROUGH["command"], "infeasible": "project"}
    scenario = rb.load_scenario({**ROUGH, "robot": make, "command": command, "errors": {"ground_bumps": bumps}})
    compared = 0
    for plant, motion, results in steps_with_contacts(scenario, range(300)):
        deepest: dict[str, Any] = {}
        for i in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(i)
            pair = {plant.get_body(index).name() for index in (info.bodyA_index(), info.bodyB_index())}
            (part,) = pair - {"WorldBody", "world", CARRIER}
            wheel = next(name for name in scenario.robot.wheel_names if part.startswith(name))
            if wheel not in deepest or info.point_pair().depth > deepest[wheel][0].point_pair().depth:
                deepest[wheel] = (info, CARRIER in pair)
        for wheel in scenario.robot.wheels:
            contact = wheel_contact(scenario.robot, wheel, motion, scenario.bumps)
            if wheel.name not in deepest:
                assert contact.depth[0] < 1e-9
                continue
            info, on_bump = deepest[wheel.name]
            depth = info.point_pair().depth
            assert contact.depth[0] == pytest.approx(depth, rel=0.02 if on_bump else 1e-6, abs=1e-9)
            if on_bump:
                side = np.sign(info.point_pair().nhat_BA_W[2])
                assert np.arccos(min(1.0, side * contact.normal_W[0] @ info.point_pair().nhat_BA_W)) < 0.15
                assert contact.p_WC[0] == pytest.approx(info.contact_point(), abs=depth)
                assert np.linalg.norm(contact.slip_W[0]) == pytest.approx(info.slip_speed(), abs=slip_tolerance)
                compared += 1
    assert compared > 20


def test_slip_is_along_the_bump() -> None:
    recording = rb.run(ROUGH, save=False).recording
    flat = rb.run({**ROUGH, "errors": {}}, save=False).recording
    slip, base = (np.hypot(r.wheels("slip_x"), r.wheels("slip_y")) for r in (recording, flat))
    touching = recording.wheels("depth") > 0
    # Most of the time a wheel rolls, on bumps as on level ground.
    assert np.median(slip[touching]) < 5 * np.median(base)


@pytest.mark.parametrize(
    ("bumps", "words"),
    [
        ({**BUMPS, "height": -0.001}, ["errors.ground_bumps.height = -0.001", "greater than 0"]),
        ({**BUMPS, "height": 0.04}, ["errors.ground_bumps", "height = 0.04", "to less than 0.03"]),
        ({**BUMPS, "height": 0.01}, ["errors.ground_bumps.height = 0.01", "youbot_base", "up to 0.007"]),
        ({**BUMPS, "density": 1e5}, ["errors.ground_bumps.density = 100000.0", "up to 2000"]),
        ({**BUMPS, "density": 0}, ["errors.ground_bumps.density = 0", "greater than 0"]),
        ({"height": 0.002, "width": 0.06}, ["errors.ground_bumps.density", "required"]),
        ({**BUMPS, "count": 3}, ["errors.ground_bumps.count", "accepted: density, height, width"]),
        (True, ["errors.ground_bumps = True"]),
    ],
)
def test_impossible_bumps_are_refused(bumps: Any, words: list[str]) -> None:
    with pytest.raises(rb.DescriptionError) as caught:
        rb.run({**ROUGH, "errors": {"ground_bumps": bumps}}, save=False)
    for word in words:
        assert word in str(caught.value)
