"""The ten motions of Huai and Jin (2022), Table 1: wheel speeds beside the printed ones, then simulated in Drake.

Run it with: python examples/mecanum_ten_motions.py
"""

import math

from rich.console import Console
from rich.progress import track
from rich.table import Table

import rollerbench as rb

# Motions in our axes, x forward and y left, and the printed wheel speeds [rad/s] in the paper's order of wheels:
# front left, rear left, rear right, front right.
TABLE_1 = {
    "plus_x": (2.5, 2.5, 2.5, 2.5),
    "minus_x": (-2.5, -2.5, -2.5, -2.5),
    "plus_y": (-2.5, 2.5, -2.5, 2.5),
    "minus_y": (2.5, -2.5, 2.5, -2.5),
    "plus_x_plus_y": (0, 5, 0, 5),
    "plus_x_minus_y": (5, 0, 5, 0),
    "minus_x_plus_y": (-5, 0, -5, 0),
    "minus_x_minus_y": (0, -5, 0, -5),
    "turn_counter_clockwise": (-3.5, -3.5, 3.5, 3.5),
    "turn_clockwise": (3.5, 3.5, -3.5, -3.5),
}
ORDER = ("front_left", "rear_left", "rear_right", "front_right")


def main() -> None:
    """Prints one row a motion: Table 1, the equations, and how far the simulation is from them."""
    kinematics = rb.WheelKinematics("mecanum_platform")
    table = Table("Motion", "Table 1 (rad/s)", "J v_xyw_B (rad/s)", "Position error", "Yaw error")
    for motion, printed in track(TABLE_1.items(), description="Simulating", transient=True):
        scenario = rb.load_scenario(f"mecanum_{motion}")
        wheel_speeds = dict(
            zip(kinematics.robot.wheel_names, kinematics.inverse(scenario.command.v_xyw_B), strict=True)
        )
        error = rb.run(scenario, save=False).summary["pose_error"]
        percent = error["percent_of_path"]
        table.add_row(
            motion,
            " ".join(f"{speed:+.1f}" for speed in printed),
            " ".join(f"{wheel_speeds[name]:+.1f}" for name in ORDER),
            f"{1e3 * error['final_position']:.2f} mm" + ("" if percent is None else f" ({percent:.2f} %)"),
            f"{math.degrees(error['final_yaw']):+.3f} deg",
        )
        assert all(abs(wheel_speeds[name] - speed) < 1e-12 for name, speed in zip(ORDER, printed, strict=True))
    Console(width=110).print(table)
    print("Sideways and diagonal runs fall short because the wheels have twelve rollers, not infinitely many:")
    print(f"sin(pi/12)/(pi/12) = {math.sin(math.pi / 12) / (math.pi / 12):.4f}. See models/mecanum_platform/README.md.")


if __name__ == "__main__":
    main()
