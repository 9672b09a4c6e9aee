"""A wheel-leg hexapod crawls like an insect, stands up, walks like a mammal, and drives off on its wheels.

Run it with: python examples/hexapod_postures.py
"""

import argparse
from pathlib import Path

import numpy as np

import rollerbench as rb

PIECES = [
    {"duration": 5.0, "v_xyw_B": [0.2, 0.0, 0.0], "posture": "insect", "gait": "tripod"},
    {"duration": 7.0, "posture": "mammal", "change": "stepping"},
    {"duration": 5.0, "v_xyw_B": [0.15, 0.0, 0.0], "gait": "tripod"},
    {"duration": 5.5, "v_xyw_B": [0.4, 0.0, 0.3], "motion": "drive"},
    {"duration": 1.5, "motion": "drive"},
]
"""What the robot does, one after the other; what a piece leaves out, it keeps from the one before or by default."""

TITLES = ("crawls", "stands up", "walks", "drives", "stands")


def main() -> None:
    """Simulates the pieces in one recording, and says how far the body is from where it should be after each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/hexapod_postures"), help="run folder to write")
    folder = parser.parse_args().output

    scenario = rb.load_scenario(
        {
            "name": "hexapod_postures",
            "robot": "wheel_leg_hexapod",
            "duration": sum(piece["duration"] for piece in PIECES),
            "command": {"type": "gait", "pieces": PIECES},
            "controller": {"type": "legs", "closed_loop": True},
        }
    )
    margin = 1e3 * scenario.rehearsal.margins.min()
    print(f"Rehearsed with ideal legs: all feet reach, and the stability margin is {margin:.0f} mm at least.")

    result = rb.run(scenario, output=folder)
    time, error = result.recording.time, result.recording.q_xyt - result.recording.reference_q_xyt
    end = 0.0
    for title, piece in zip(TITLES, PIECES, strict=True):
        end += piece["duration"]
        row = min(int(np.searchsorted(time, end)), len(time) - 1)
        x, y, yaw = error[row]
        height = 1e3 * result.recording.columns["z"][row]
        print(
            f"{title:9s} until {end:4.1f} s: body {height:.0f} mm high, "
            f"{1e3 * np.hypot(x, y):.1f} mm and {np.degrees(yaw):+.2f} deg from where it should be"
        )
    print(f"Open {folder / 'recording.html'} in a browser; it needs no network.")


if __name__ == "__main__":
    main()
