"""A cart with two tyres drives arcs of its mass centre C, after Xu et al., and finds its smallest one.

Run it with: python examples/differential_arcs.py
"""

import math

import rollerbench as rb


def main() -> None:
    """Prints wheel speeds, and how far Drake ends from the equations, for arcs that get tighter."""
    robot = rb.load_robot("differential_cart")
    ahead = float(robot.inertia.com[0])  # C lies ahead of the axle: l sin(gamma) in the paper
    print(f"C lies {ahead:.4f} m ahead of the axle, so no arc of C is tighter than R_min = {ahead:.4f} m.\n")
    kinematics = rb.WheelKinematics(robot).at([ahead, 0.0])

    print("R of C     left, right wheel         end of C by the equations, by Drake            yaw error")
    for radius in (1.2, 0.6, 0.3, 0.15, ahead):
        # The middle of the axle travels on the circle of this radius about the same centre.
        axle_radius = math.sqrt(radius**2 - ahead**2)
        v_xyw_B = [0.5 * axle_radius, 0.0, 0.5]
        left, right = rb.WheelKinematics(robot).inverse(v_xyw_B)
        result = rb.run(
            {
                "name": "arc",
                "robot": robot,
                "duration": 4.0,
                "command": {"type": "twist", "v_xyw_B": v_xyw_B},
            },
            save=False,
        )
        theory, drake = (
            pose[:2] + rb.odometry.rotate(pose[2], [ahead, 0.0])
            for pose in (result.recording.reference_q_xyt[-1], result.recording.q_xyt[-1])
        )
        yaw = math.degrees(result.summary["pose_error"]["final_yaw"])
        print(
            f"{radius:6.4f} m  {left:+6.3f}, {right:+6.3f} rad/s   "
            f"({theory[0]:.4f}, {theory[1]:.4f}) m, ({drake[0]:.4f}, {drake[1]:.4f}) m   {yaw:+.3f} deg"
        )

    try:
        kinematics.inverse([0.0, 0.0, 0.5])
    except rb.InfeasibleTwist as refused:
        print(f"\nA turn about C itself is refused: {refused}")


if __name__ == "__main__":
    main()
