"""Tables of robots with legs."""

from rich.markup import escape
from rich.table import Table

from rollerbench.description import Leg, Link, Posture, Robot
from rollerbench.description.layout import support_margin


def legs_summary(robot: Robot) -> str:
    """Number of legs, joints and driven wheels in a line."""
    joints = sorted({len(leg.links) for leg in robot.legs})
    driven = sum(leg.wheel.driven for leg in robot.legs)
    return f"{len(robot.legs)} legs of {' or '.join(map(str, joints))} joints, {driven} driven wheels"


def leg_details(robot: Robot) -> list[Table]:
    """Measures, legs, Denavit-Hartenberg rows and postures of a robot."""
    return [_measures(robot), _legs(robot), *_rows(robot), _postures(robot), _feet(robot)]


def _measures(robot: Robot) -> Table:
    table = Table(
        title=escape(f"{robot.name}: {robot.summary}"), show_header=False, title_justify="left", title_style="bold"
    )
    table.add_column(style="cyan")
    table.add_column()
    table.add_row("Source", escape(robot.source))
    table.add_row("Legs", legs_summary(robot))
    table.add_row("Mass", f"{robot.mass:.6g} kg, {robot.body.mass:.6g} kg of it the body")
    table.add_row("Radius over all feet", f"{robot.reach:.4g} m")
    return table


def _legs(robot: Robot) -> Table:
    columns = ("Leg", "Hip x, y, z [m]", "Mounting [deg]", "Length [m]", "Mass [kg]", "Wheel radius [m]", "Driven",
               "Max speed [rad/s]", "Max effort [N m]", "Friction")  # fmt: skip
    table = _table("Legs", columns)
    for leg in robot.legs:
        wheel, hip = leg.wheel, ", ".join(f"{value:g}" for value in leg.hip)
        numbers = map(_cell, (leg.mounting_deg, leg.length, leg.mass, wheel.radius))
        limits = map(_cell, (wheel.max_speed, wheel.max_effort, wheel.friction))
        table.add_row(leg.name, hip, *numbers, "yes" if wheel.driven else "locked", *limits)
    return table


def _rows(robot: Robot) -> list[Table]:
    """One table for all legs with the same links."""
    kinds: dict[tuple[Link, ...], list[Leg]] = {}
    for leg in robot.legs:
        kinds.setdefault(leg.links, []).append(leg)
    columns = ("Joint", "a [m]", "alpha [deg]", "d [m]", "theta [deg]", "From [deg]", "To [deg]", "Mass [kg]",
               "Max speed [rad/s]", "Max effort [N m]")  # fmt: skip
    tables = []
    for links, legs in kinds.items():
        table = _table(f"Denavit-Hartenberg rows of {', '.join(leg.name for leg in legs)}", columns)
        for number, link in enumerate(links, start=1):
            theta = f"q{number}" + (f" {link.theta_offset_deg:+g}" if link.theta_offset_deg else "")
            limits = (link.min_deg, link.max_deg, link.mass, link.max_speed, link.max_effort)
            row = map(_cell, (link.a, link.alpha_deg, link.d))
            table.add_row(str(number), *row, theta, *map(_cell, limits))
        tables.append(table)
    return tables


def _postures(robot: Robot) -> Table:
    table = _table("Postures", ("Posture", "Height of Bo [m]", "Static margin [m]", "Holds", "Angles [deg]"))
    for posture in robot.standing:
        angles: dict[tuple[float, ...], list[str]] = {}
        for leg in robot.legs:
            angles.setdefault(leg.postures[posture.name], []).append(leg.name)
        texts = [
            ", ".join(f"{value:g}" for value in values) + (f" ({', '.join(legs)})" if len(angles) > 1 else "")
            for values, legs in angles.items()
        ]
        standing = _in_posture(robot, posture)
        margin = support_margin(standing.contact_points_B[:, :2], standing.inertia.com[:2])
        table.add_row(posture.name, f"{-standing.ground_height:.4g}", f"{margin:.3g}", posture.hold, "\n".join(texts))
    return table


def _feet(robot: Robot) -> Table:
    table = _table("Feet: x, y, z of the wheels' centres [m]", ("Leg", *(posture.name for posture in robot.standing)))
    places = [robot.feet_B(posture.name).round(4) + 0.0 for posture in robot.standing]
    for index, leg in enumerate(robot.legs):
        table.add_row(leg.name, *(", ".join(f"{value:g}" for value in feet[index]) for feet in places))
    return table


def _in_posture(robot: Robot, posture: Posture) -> Robot:
    """The same robot, starting in another of its postures; not validated, as nothing asks it to start there."""
    others = (other for other in robot.standing if other != posture)
    return Robot.model_construct(**{**dict(robot), "postures": (posture, *others)})


def _table(title: str, columns: tuple[str, ...]) -> Table:
    return Table(*map(escape, columns), title=escape(title), title_justify="left", title_style="bold")


def _cell(value: float | None) -> str:
    return "-" if value is None else f"{value:g}"
