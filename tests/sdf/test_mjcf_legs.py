"""Robots on legs in MuJoCo: the keyframes are postures in which they stand."""

import mujoco
import numpy as np
import pytest

import robots
import rollerbench as rb

LEGGED = {"hexapod": lambda: "wheel_leg_hexapod", **robots.LEGGED}


@pytest.mark.parametrize("make", LEGGED.values(), ids=LEGGED)
def test_a_robot_stands_in_every_keyframe(make) -> None:
    robot = rb.load_robot(make())
    model = mujoco.MjModel.from_xml_string(rb.sdf.robot_to_mjcf(robot))
    data = mujoco.MjData(model)
    for index, posture in enumerate(robot.standing):
        mujoco.mj_resetDataKeyframe(model, data, index)
        mujoco.mj_forward(model, data)
        for leg, foot in zip(robot.legs, robot.feet_B(posture.name), strict=True):
            assert data.body(f"{leg.name}_wheel").xpos - data.body("body").xpos == pytest.approx(foot, abs=1e-10)
        start = data.qpos.copy()
        while data.time < 1.0:
            mujoco.mj_step(model, data)
        assert data.qpos[:3] == pytest.approx(start[:3], abs=3e-3)
        assert abs(data.qpos[3]) > np.cos(np.radians(0.3))
        assert np.abs(data.qvel).max() < 1e-3
