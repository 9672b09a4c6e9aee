"""Where to put four omni wheels: speed forward against speed aside and traction, for three azimuths of the wheels.

Run it with: python examples/omni_anisotropy.py
It prints a table, simulates one run for each azimuth, and takes about ten seconds.
"""

import math

import rollerbench as rb


def base(azimuth_deg: float) -> rb.Robot:
    """The shipped platform with its wheels at +-azimuth from ahead and from behind."""
    description = rb.load_robot("omni_platform").model_dump(mode="json", exclude_none=True)
    azimuths = (azimuth_deg, 180 - azimuth_deg, 180 + azimuth_deg, -azimuth_deg)
    for wheel, azimuth in zip(description["wheels"], azimuths, strict=True):
        for field in ("position", "heading_deg"):
            wheel.pop(field, None)
        wheel |= {"distance": 0.4, "azimuth_deg": azimuth}
    return rb.load_robot(description)


def simulated_speed(robot: rb.Robot, speed: float) -> float:
    """Mean speed in Drake with the wheels at their limit, straight ahead, after a gentle start."""
    scenario = rb.load_scenario(
        {
            "name": "ahead",
            "robot": robot,
            "duration": 2 * speed + 1.0,
            "command": {"type": "twist", "v_xyw_B": [0.999 * speed, 0.0, 0.0], "ramp": speed},
            "plant": {"time_step": 0.002},
        }
    )
    recording = rb.run(scenario, save=False).recording
    steady = (recording.time > speed + 0.1) & (recording.time < speed + 0.9)
    return float(recording.v_xyw_B[steady, 0].mean()) / 0.999


def main() -> None:
    """Compares azimuths of 45, 30 and 15 deg."""
    print("azimuth   speed ahead, aside [m/s]   in Drake   acceleration ahead, aside [m/s2]   yaw [rad/s]")
    for azimuth_deg in (45.0, 30.0, 15.0):
        robot = base(azimuth_deg)
        ahead, aside = rb.limits.max_speed(robot, [0.0, math.pi / 2]).value
        push_ahead, push_aside = rb.limits.max_acceleration(robot, [0.0, math.pi / 2]).value
        turn = float(rb.limits.max_yaw_rate(robot))
        found = simulated_speed(robot, ahead)
        print(f"{azimuth_deg:4.0f} deg {ahead:13.2f} {aside:9.2f} {found:14.2f}", end=" ")
        print(f"{push_ahead:15.2f} {push_aside:9.2f} {turn:22.2f}")
    print("\nClose to the axis of travel wheels turn slowly, so the base is fast ahead: 1 / sin(azimuth). For the same")
    print(
        "reason they push weakly: what the base gains in speed it loses in traction. Aside it is the other way round."
    )


if __name__ == "__main__":
    main()
