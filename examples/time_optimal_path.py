"""Round a path as fast as the wheels allow: time, limits and tracking of a time-optimal run of a Mecanum base.

Run it with: python examples/time_optimal_path.py [FOLDER]
With a folder it also draws there, over time, which share of each limit the run uses. It takes about ten seconds.
"""

import itertools
import math
import sys
from pathlib import Path

import numpy as np

import rollerbench as rb

ROBOT, MARGIN = "youbot_base", 0.8
POINTS = [[2.0, 0.0, 90.0], [2.0, 2.0, 90.0], [0.0, 2.0, -45.0], [0.0, 0.5, 0.0]]


def describe(run: rb.paths.TimeOptimal) -> None:
    """Prints which limit the run is at, and when."""
    print("At its limits:", end=" ")
    start = 0.0
    for name, group in itertools.groupby(zip(run.active, run.time, strict=True), key=lambda item: item[0]):
        end = list(group)[-1][1]
        if end - start > 0.05:
            print(f"{name} from {start:.2f} to {end:.2f} s,", end=" ")
        start = end
    top = np.array(list(run.usage.values())).max(axis=0)
    print(f"\nwith {100 * np.mean(top > 0.99 * MARGIN):.1f} % of the moments at 99 % of a limit or more.")


def simulate(speed_law: dict[str, object], duration: float) -> rb.RunResult:
    """Runs the path in Drake under a speed law."""
    command = {"type": "path", "name": "clothoid", "points": POINTS, "heading": "free", **speed_law}
    # Equations that count the rollers: textbook ones promise a sideways way that is too long by 1.2 %.
    controller = {"rollers": "finite"}
    scenario = {"name": "round", "robot": ROBOT, "duration": duration, "command": command, "controller": controller}
    return rb.run({**scenario, "plant": {"time_step": 0.002}}, save=False)


def draw(run: rb.paths.TimeOptimal, folder: Path) -> None:
    """Draws the shares of the limits over time."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
    for name, usage in run.usage.items():
        axes.plot(run.time, usage, label=name)
    axes.set(xlabel="time [s]", ylabel="share of the limit [-]", ylim=(0, 1))
    axes.legend()
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / "time_optimal_path.svg")
    plt.close(figure)
    print(f"Drawn: {folder / 'time_optimal_path.svg'}")


def main() -> None:
    """Plans, compares with a trapezoidal speed law, simulates."""
    robot = rb.load_robot(ROBOT)
    places, yaws = [point[:2] for point in POINTS], [math.radians(point[2]) for point in POINTS]
    leg = rb.paths.clothoid(places, yaw=yaws)
    run = rb.paths.time_optimal(robot, [leg], margin=MARGIN)

    # The trapezoidal law knows one speed: the fastest at which, anywhere on the path, no wheel turns too fast.
    wheels = rb.WheelKinematics(robot).drive_matrix
    limit = MARGIN * np.array([wheel.max_speed for wheel in robot.driven_wheels])
    slow = rb.paths.twist_along([leg], 1.0, "trapezoidal", radius=0.3)
    duration = float(np.max(slow.mapped(wheels).peak / limit))
    print(f"{leg.length:.2f} m round the corners of {len(POINTS)} points, turning {math.degrees(leg.turn):.0f} deg,")
    print(f"take {run.duration:.2f} s at {MARGIN:.0%} of the limits; with a trapezoidal speed law {duration:.2f} s.")
    describe(run)

    result = simulate({"speed_law": "time_optimal", "margin": MARGIN}, math.ceil(10 * run.duration) / 10)
    recording = result.recording
    speed = np.abs(recording.wheels("measured")) / [wheel.max_speed for wheel in robot.wheels]
    effort = np.abs(recording.wheels("effort")) / [wheel.max_effort for wheel in robot.wheels]
    slip = np.hypot(recording.wheels("slip_x"), recording.wheels("slip_y")).max(axis=1)
    error = rb.pose_error(recording)
    print(f"In Drake: wheels at up to {speed.max():.1%} of their speed and {effort.max():.1%} of their effort,")
    print(f"half of the time sliding by less than {1e3 * np.median(slip):.1f} mm/s; off the path by up to", end=" ")
    print(f"{1e3 * error.max_position:.1f} mm and {math.degrees(error.max_yaw):.2f} deg.")
    if len(sys.argv) > 1:
        draw(run, Path(sys.argv[1]))


if __name__ == "__main__":
    main()
