"""Closed loops with imperfect robots: how far from the reference they are, where open loops are far off."""

import numpy as np

import rollerbench as rb

EIGHT = {"type": "path", "name": "figure_eight", "length": 2.0, "speed": 0.5}
YOUBOT = {
    "radius_scale": {"all": 1.03},
    "gear_error": {"front_left": {"constant": 0.02}},
    "heading_offset_deg": {"front_left": 0.5},
}
# The castor grows with the tyres, or it would hang in the air.
CART = {
    "radius_scale": {"left": 1.03, "right": 1.03, "castor": 1.075},
    "gear_error": {"left": {"constant": 0.02}},
    "heading_offset_deg": {"left": 0.5},
}


def errors(robot, errors, controller, command=EIGHT, duration=24.5):
    """Distance [m] and angle [rad] between robot and reference over time, and the run."""
    scenario = {
        "name": "closed_loop",
        "robot": robot,
        "duration": duration,
        "command": command,
        "errors": errors,
        "controller": controller,
    }
    result = rb.run(scenario, save=False)
    off = result.recording.q_xyt - result.recording.reference_q_xyt
    turn = (off[:, 2] + np.pi) % (2 * np.pi) - np.pi
    return np.hypot(off[:, 0], off[:, 1]), np.abs(turn), result


def test_feedback_keeps_an_imperfect_robot_on_its_eight() -> None:
    distance, angle, result = errors("youbot_base", YOUBOT, {"type": "pose_tracking"})
    assert distance.max() < 0.010
    assert np.degrees(angle.max()) < 0.5
    # What the feedback did is part of the budget, which still adds up.
    budget = rb.error_budget(result.recording)
    assert np.abs(budget.parts["feedback"][-1, :2]).max() > 0.02
    off = result.recording.q_xyt - result.recording.reference_q_xyt
    assert np.abs(budget.total[-1, :2] - off[-1, :2]).max() < 1e-9
