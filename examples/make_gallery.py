"""Draws a picture of each shipped robot at the end of a run, without a display or a GPU.

Run it with: python examples/make_gallery.py --all
"""

import argparse
import time
from pathlib import Path

import rollerbench as rb
from rollerbench.sdf import robot_to_sdf
from rollerbench.visualization.render import preview
from rollerbench.visualization.scenes import SeenRun, scene_of

SCENARIOS = {
    "mecanum_platform": "mecanum_plus_x_plus_y",
    "youbot_base": "fastest_youbot",
    "differential_cart": "cart_arc",
    "kiwi": "kiwi_mixed",
    "omni_platform": "omni_mixed",
    "six_wheel": "six_wheel_pivot",
    "swerve_base": "swerve_arc",
    "wheel_leg_hexapod": "hexapod_tripod_walk",
}
"""A scenario that explains the robot; the first ones are drawn by default."""

QUICK = 2


def main() -> None:
    """Simulates a scenario of each robot and writes ROBOT/preview.png for it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("gallery"), help="folder to write, such as models")
    parser.add_argument("--all", action="store_true", help=f"all robots instead of the first {QUICK}")
    arguments = parser.parse_args()

    for robot, name in list(SCENARIOS.items())[: None if arguments.all else QUICK]:
        scenario = rb.load_scenario(name)
        result = rb.run(scenario, save=False)
        # What is seen follows from the recording and the simulated model alone, so stored runs can be drawn as well.
        seen = SeenRun(
            name=name,
            recording=result.recording,
            model=robot_to_sdf(scenario.simulated_robot),
            summary=result.summary,
        )
        started = time.perf_counter()
        picture = preview(scene_of([seen], forces=True, slip=True), width=640, height=360)
        file = arguments.output / robot / "preview.png"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(picture)
        print(f"{file}: {name}, {len(picture) / 1000:.0f} kB, drawn in {time.perf_counter() - started:.1f} s")


if __name__ == "__main__":
    main()
