"""Records a run without a browser: one HTML file that anyone can open, rotate and replay.

Run it with: python examples/headless_recording.py
"""

import argparse
from pathlib import Path

import rollerbench as rb


def main() -> None:
    """Drives the youBot's base round a quarter circle, sideways, and says where the recording lies."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/quarter_circle"), help="run folder to write")
    folder = parser.parse_args().output

    scenario = rb.load_scenario(
        {
            "name": "quarter_circle",
            "robot": "youbot_base",
            "duration": 5.0,
            # Constant vy and wz: the base keeps its right side to the centre of a circle of radius vy / wz.
            "command": {"type": "twist", "v_xyw_B": [0.0, 0.25, 0.349], "ramp": 0.5},
        }
    )
    result = rb.run(scenario, output=folder)
    error = result.summary["pose_error"]
    print(f"The equations and the simulation end {1e3 * error['final_position']:.1f} mm apart.")
    print(f"Open {folder / 'recording.html'} in a browser; it needs no network.")


if __name__ == "__main__":
    main()
