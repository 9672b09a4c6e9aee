"""Two laps of a figure of eight with robots that are not as described: open loop against feedback of the pose.

The wheels of both robots are 3 % too large, one gear is wrong by 2 %, and one wheel looks 0.5 deg to the side.
Run it with: python examples/track_figure_eight.py [FILE.svg], which also draws the paths
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

import rollerbench as rb

EIGHT = {"type": "path", "name": "figure_eight", "length": 2.0, "laps": 2}
DURATION = 32.5  # s; of that a quarter to speed up and a quarter to slow down makes 0.5 m/s in between
WRONG = {
    "youbot_base": {
        "radius_scale": {"all": 1.03},
        "gear_error": {"front_left": {"constant": 0.02}},
        "heading_offset_deg": {"front_left": 0.5},
    },
    "differential_cart": {  # its castor grows as well, or it would hang in the air
        "radius_scale": {"left": 1.03, "right": 1.03, "castor": 1.075},
        "gear_error": {"left": {"constant": 0.02}},
        "heading_offset_deg": {"left": 0.5},
    },
}


def drive(robot: str, controller: str) -> rb.Recording:
    """The recording of two laps."""
    scenario = {
        "name": f"{robot}_{controller}",
        "robot": robot,
        "duration": DURATION,
        "command": EIGHT,
        "controller": {"type": controller},
        "errors": WRONG[robot],
    }
    return rb.run(scenario, save=False).recording


def off_track(recording: rb.Recording) -> tuple[float, float]:
    """Largest distance [mm] and angle [deg] from the reference once the first lap is done."""
    reference, off = recording.reference_q_xyt, recording.q_xyt - recording.reference_q_xyt
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(reference[:, :2], axis=0).T))])
    later = way >= 0.5 * way[-1]
    turn = (off[later, 2] + np.pi) % (2 * np.pi) - np.pi
    return 1e3 * np.hypot(*off[later, :2].T).max(), np.degrees(np.abs(turn)).max()


def main() -> None:
    """Prints how far each robot is from its reference in the second lap."""
    figure, axes = plt.subplots(1, len(WRONG), figsize=(10, 5), sharex=True, sharey=True)
    for ax, robot in zip(axes, WRONG, strict=True):
        for controller, style in (("open_loop", "C1:"), ("pose_tracking", "C0-")):
            recording = drive(robot, controller)
            distance, angle = off_track(recording)
            print(f"{robot:17} {controller:13}, second lap: up to {distance:6.1f} mm and {angle:5.2f} deg off")
            ax.plot(*recording.q_xyt[:, :2].T, style, label=f"{controller}: {distance:.0f} mm off")
        ax.plot(*recording.reference_q_xyt[:, :2].T, "k--", linewidth=0.8, label="reference")
        ax.set(title=robot, xlabel="x [m]", ylabel="y [m]", aspect="equal")
        ax.legend()
    if sys.argv[1:]:
        figure.savefig(sys.argv[1])


if __name__ == "__main__":
    main()
