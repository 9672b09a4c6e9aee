"""Tables of robots and scenarios."""

import math
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from rich.markup import escape
from rich.table import Table

from rollerbench.description import Robot
from rollerbench.description.files import read_yaml
from rollerbench.errors import KinematicsError
from rollerbench.kinematics import WheelKinematics
from rollerbench.report.legs import leg_details, legs_summary
from rollerbench.report.terminal import matrix_table

TWIST = ("vx [m/s]", "vy [m/s]", "wz [rad/s]")


def robot_list(robots: Iterable[Robot]) -> Table:
    """One row a robot."""
    table = Table("Robot", "Wheels or legs", escape("Mass [kg]"), "Mobility", "Summary")
    for robot in robots:
        kinds = [wheel.type for wheel in robot.wheels]
        wheels = ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds))
        degrees = "-"
        if robot.legs:
            wheels = legs_summary(robot)
        else:
            mobility = WheelKinematics(robot).mobility()
            degrees = f"({mobility.degree_of_mobility}, {mobility.degree_of_steerability})"
        table.add_row(robot.name, wheels, f"{robot.mass:.4g}", degrees, escape(robot.summary))
    return table


def robot_details(robot: Robot) -> list[Table]:
    """Matrices, measures and limits of a robot; of one with legs, its legs and postures."""
    if robot.legs:
        return leg_details(robot)
    kinematics = WheelKinematics(robot)
    driven = [wheel.name for wheel in robot.driven_wheels]
    tyres = [f"tyre {index}" for index in range(len(kinematics.constraint_matrix))]
    rollers = [wheel.name for wheel in robot.wheels if wheel.ring]
    tables = [_measures(robot, kinematics), _limits(robot)]
    for title, names, matrix in (
        ("Drive matrix J: wheel speeds [rad/s] = J v_xyw_B", driven, kinematics.drive_matrix),
        (
            "Constraint matrix C: sideways speeds of the tyres [m/s] = C v_xyw_B = 0",
            tyres,
            kinematics.constraint_matrix,
        ),
        ("Roller matrix G: roller surface speeds [m/s] = G v_xyw_B", rollers, kinematics.roller_matrix),
    ):
        if len(matrix):
            tables.append(matrix_table(title, zip(names, matrix, strict=True), TWIST))
    return tables


def scenario_list(files: Mapping[str, Path]) -> Table:
    """One row a scenario."""
    table = Table("Scenario", "Robot", escape("Duration [s]"), "Summary")
    for name, file in files.items():
        data = read_yaml(file)
        table.add_row(
            name, escape(str(data.get("robot"))), f"{data.get('duration')}", escape(str(data.get("summary", "")))
        )
    return table


def _measures(robot: Robot, kinematics: WheelKinematics) -> Table:
    mobility, inertia = kinematics.mobility(), robot.inertia
    com = np.round(inertia.com, 9) + 0.0
    table = Table(
        title=escape(f"{robot.name}: {robot.summary}"), show_header=False, title_justify="left", title_style="bold"
    )
    table.add_column(style="cyan")
    table.add_column()
    try:
        kinematics.forward_matrix  # noqa: B018  # the property raises where the twist is undetermined
        forward = "determined by the wheel speeds"
    except KinematicsError:
        forward = "not determined by the wheel speeds"
    condition = kinematics.condition_number()
    table.add_row("Source", escape(robot.source))
    table.add_row("Mass", f"{inertia.mass:.6g} kg")
    table.add_row("Centre of mass", "x {:.4g} m, y {:.4g} m, z {:.4g} m".format(*com))
    table.add_row("Yaw inertia", f"{inertia.moment[2, 2]:.4g} kg m2")
    table.add_row("Degree of mobility", str(mobility.degree_of_mobility))
    table.add_row("Degree of steerability", str(mobility.degree_of_steerability))
    table.add_row("Degree of manoeuvrability", str(mobility.degree_of_manoeuvrability))
    table.add_row("Condition number", "infinite" if math.isinf(condition) else f"{condition:.4f} (1 is isotropic)")
    table.add_row("Twist", forward)
    return table


def _limits(robot: Robot) -> Table:
    columns = ("Wheel", "Type", "x [m]", "y [m]", "Heading [deg]", "Radius [m]", "Roller angle [deg]", "Rollers",
               "Driven", "Max speed [rad/s]", "Max effort [N m]", "Friction")  # fmt: skip
    table = Table(*map(escape, columns), title="Wheels", title_justify="left", title_style="bold")
    for wheel in robot.wheels:
        x, y, _ = wheel.p_BoHo_B
        angle = getattr(wheel, "roller_angle_deg", None)
        cells = (x, y, wheel.heading_degrees, wheel.radius, angle, wheel.ring.count if wheel.ring else None)
        limits = (wheel.max_speed, wheel.max_effort, wheel.friction)
        driven = "yes" if wheel.driven else "no"
        table.add_row(wheel.name, wheel.type, *map(_cell, cells), driven, *map(_cell, limits))
    return table


def _cell(value: float | None) -> str:
    return "-" if value is None else f"{value:g}"
