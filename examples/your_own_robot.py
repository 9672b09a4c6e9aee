"""Describe a robot of your own in Python: three wheels of three kinds; simulate it; read its pose error.

Run it with: python examples/your_own_robot.py
"""

import math

from rich.console import Console

import rollerbench as rb


def three_wheels() -> rb.Robot:
    """A base with a tyre at the rear left, a Mecanum wheel at the rear right and an omni wheel in front."""
    return rb.Robot(
        name="three_wheels",
        summary="A tyre, a Mecanum wheel and an omni wheel",
        body=rb.Body(size=(0.5, 0.3, 0.1), mass=10.0, center_of_mass=(0.05, 0.0, 0.04)),
        wheels=(
            rb.FixedWheel(name="left", position=(0.0, 0.22), radius=0.075, width=0.03, mass=0.8),
            rb.MecanumWheel(
                name="right",
                position=(0.0, -0.22),
                radius=0.075,
                width=0.06,
                mass=1.0,
                roller_angle_deg=45.0,
                rollers=rb.Rollers(count=12, radius=0.012),
            ),
            rb.OmniWheel(
                name="front",
                position=(0.3, 0.0),
                radius=0.075,
                width=0.046,
                mass=0.8,
                driven=False,
                rollers=rb.Rollers(count=16, radius=0.011, rows=2),
            ),
        ),
    )


def main() -> None:
    """Prints what the equations say of the robot, then what Drake says."""
    robot = three_wheels()
    kinematics = rb.WheelKinematics(robot)
    mobility = kinematics.mobility()
    print(f"{robot.name}: {robot.mass:.1f} kg, degree of mobility {mobility.degree_of_mobility}.")
    v_xyw_B = [0.3, 0.0, 0.4]
    speeds = dict(zip((wheel.name for wheel in robot.driven_wheels), kinematics.inverse(v_xyw_B), strict=True))
    print("Wheel speeds for 0.3 m/s and 0.4 rad/s:", ", ".join(f"{k} {v:.3f} rad/s" for k, v in speeds.items()))

    scenario = rb.load_scenario(
        {
            "name": "three_wheels_arc",
            "robot": robot,
            "duration": 4.0,
            "command": {"type": "twist", "v_xyw_B": v_xyw_B},
        }
    )
    result = rb.run(scenario, output="runs/three_wheels_arc")
    error = rb.pose_error(result.recording)
    Console().print(
        f"Pose error after {result.summary['path_length']:.2f} m: {1e3 * error.final_position:.2f} mm "
        f"({error.percent_of_path:.2f} % of the path), {math.degrees(error.final_yaw):+.3f} deg"
    )
    print(f"Look at it: {result.folder}/recording.html, and at its numbers: {result.folder}/report.html")


if __name__ == "__main__":
    main()
