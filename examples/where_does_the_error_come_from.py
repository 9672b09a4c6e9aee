"""A youBot base drives to its left and falls 1.2 % short: where that comes from, and equations that do not fall short.

Run it with: python examples/where_does_the_error_come_from.py
"""

import rollerbench as rb


def main() -> None:
    """Simulates a sideways run with the textbook's equations, then with those that count the rollers."""
    for rollers in ("textbook", "finite"):
        scenario = rb.load_scenario("youbot_plus_y", overrides={"controller.rollers": rollers})
        result = rb.run(scenario, save=False)
        budget = rb.error_budget(result.recording)
        error = rb.pose_error(result.recording)
        print(f"Controller with {rollers} rollers: {1e3 * error.along_track:+.2f} mm of", end=" ")
        print(f"{1e3 * result.summary['path_length']:.0f} mm ({error.percent_of_path:.2f} %)")
        for name, part in budget.to_dict().items():
            print(f"  {name:10} {1e3 * part['along_track']:+8.3f} mm  {100 * part['position_share']:+6.1f} %")

    textbook, finite = (
        rb.WheelKinematics("youbot_base", rollers=rollers).inverse([0.0, 0.3, 0.0])[0]
        for rollers in ("textbook", "finite")
    )
    print("\nNothing slips and the wheels turn as told: it is the geometry. A wheel with 12 rollers touches the ground")
    print("beside its middle, and on average moves the base by sin(pi/12)/(pi/12) of what the textbook says. So the")
    print(f"wheels must turn at {abs(finite):.4f} instead of {abs(textbook):.4f} rad/s for 0.3 m/s to the left.")


if __name__ == "__main__":
    main()
