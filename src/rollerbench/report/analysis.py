"""The page and the terminal's table of what a base can do in each direction."""

import math
from collections.abc import Mapping

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from rich.markup import escape
from rich.table import Table

from rollerbench.analysis.limits import Capability, sectors
from rollerbench.kinematics import WheelKinematics
from rollerbench.kinematics.limits import CAUSES, Limit

FIGURES = {
    "speed": (
        "Largest speed.",
        "The speed at which the first driven wheel reaches its largest speed, going straight, and while the base turns "
        "at a third and at two thirds of its largest yaw rate.",
    ),
    "speed_and_yaw": (
        "Speed and yaw rate together.",
        "Under the curves no wheel exceeds its largest speed.",
    ),
    "acceleration": (
        "Largest acceleration.",
        "From rest, or while travelling that way, before a wheel slips, lifts off or runs out of effort. Where more "
        "wheels push than motions are free, they may share the push in many ways: the best of them, or that with "
        "efforts of least norm, which efforts computed without a look at friction have. A wheel's force along and "
        "across its rollers together is bounded by its friction (friction circle); bounds on each of them apart are "
        "shown for comparison.",
    ),
    "limiting_wheels": (
        "Which wheel limits.",
        "Wheels at their limit at the largest speed without turning, and at the largest acceleration (best sharing).",
    ),
    "efforts": (
        "Wheel efforts.",
        "Efforts of least norm that accelerate the base without turning it.",
    ),
    "effort_map": (
        "Efforts over direction and acceleration.",
        "Positive efforts (red) drive towards the wheel's heading. The line is the largest acceleration with these "
        "efforts; hatched, a wheel slips.",
    ),
}


def analysis_page(found: Capability, figures: Mapping[str, str], versions: Mapping[str, str]) -> str:
    """The report.html of an analysis.

    Args:
        found: The numbers.
        figures: SVG texts by name.
        versions: Versions of rollerbench, Drake and Python.
    """
    environment = Environment(loader=PackageLoader("rollerbench.report"), autoescape=True, undefined=StrictUndefined)
    drawn = [
        {
            "name": name,
            "title": FIGURES[name][0],
            "caption": FIGURES[name][1],
            "svg": Markup(svg[svg.index("<svg") :]),
        }
        for name, svg in figures.items()
    ]
    return environment.get_template("analysis.html.j2").render(
        robot=found.robot.name,
        summary=found.robot.summary,
        rows=key_rows(found),
        assumptions=_assumptions(found),
        figures=drawn,
        tables=[
            {"title": "What limits the speed", "columns": _columns("m/s"), "lines": _lines(found, found.speed)},
            {
                "title": "What limits the acceleration",
                "columns": _columns("m/s²"),
                "lines": _lines(found, found.accelerations["best"]),
            },
        ],
        versions=versions,
    )


def analysis_table(found: Capability) -> Table:
    """The key figures for the terminal."""
    table = Table(title=escape(found.robot.name), show_header=False, title_justify="left", title_style="bold")
    table.add_column(style="cyan", no_wrap=True)
    table.add_column()
    for label, value in key_rows(found):
        table.add_row(label, escape(value))
    return table


def key_rows(found: Capability) -> list[tuple[str, str]]:
    """Label and value of each key figure."""
    mobility = WheelKinematics(found.robot).mobility()
    isotropy = found.isotropy
    fastest = "no wheel limits it" if math.isnan(found.max_yaw_rate) else f"{found.max_yaw_rate:.4g} rad/s"
    ratio = isotropy.speed_ratio
    if ratio is None:
        evenness = "-"
    else:
        evenness = "the base cannot go in every direction" if math.isinf(ratio) else f"{ratio:.4f} (1 is isotropic)"
    return [
        ("Degrees of mobility, steerability", f"{mobility.degree_of_mobility}, {mobility.degree_of_steerability}"),
        ("Largest speed", _extremes(found, found.speed, "m/s")),
        ("Fastest over slowest direction", evenness),
        ("Largest yaw rate on the spot", fastest),
        ("Condition number of the drive", _number(isotropy.condition_number, "(1 is isotropic)")),
        ("Manipulability", _number(isotropy.manipulability, f"(yaw rates by {isotropy.characteristic_length:.4g} m)")),
        ("Largest acceleration", _extremes(found, found.accelerations["best"], "m/s²")),
        ("  with efforts of least norm", _extremes(found, found.accelerations["least_norm"], "m/s²")),
        ("  adhesion along and across apart", _extremes(found, found.accelerations["independent"], "m/s²")),
    ]


def _extremes(found: Capability, limit: Limit, unit: str) -> str:
    """Largest and smallest value with their directions, or why there is none."""
    degrees = np.degrees(found.directions)
    if not limit.feasible.any():
        reason = "; ".join(CAUSES[cause] for cause in dict.fromkeys(limit.cause[found.goes].tolist()))
        return f"none: {reason or CAUSES['tyres']}"
    least, most = float(np.nanmin(limit.value)), float(np.nanmax(limit.value))
    # Of equal values, the direction closest to forward.
    at_most = degrees[np.flatnonzero(limit.value >= most * (1 - 1e-6))[0]]
    at_least = degrees[np.flatnonzero(limit.value <= least * (1 + 1e-6))[0]]
    if most - least <= 1e-4 * most and found.all_round:
        return f"{most:.4g} {unit} in every direction"
    if found.few:
        ways = np.flatnonzero(limit.feasible & (degrees < 360.0 - 1e-6))
        return ", ".join(f"{limit.value[i]:.4g} {unit} at {degrees[i]:.4g} deg" for i in ways) + "; no other way"
    return f"{most:.4g} {unit} at {at_most:.4g} deg, {least:.4g} {unit} at {at_least:.4g} deg"


def _assumptions(found: Capability) -> str:
    friction = found.ground_friction
    ground = (
        "each wheel's coefficient" if friction is None else f"the wheels' coefficients and {friction:g} of the ground"
    )
    parts = [f"Friction has {ground}; rolling resistance is {found.roll_resistance:g} of the load."]
    if found.roll_resistance and any(wheel.ring for wheel in found.robot.wheels):
        parts.append("In the single directions in which a wheel or its roller stands still, it resists neither way.")
    if any(wheel.steered for wheel in found.robot.wheels):
        parts.append("Steered wheels are steered to the direction.")
    if any(wheel.swivel_offset for wheel in found.robot.wheels):
        parts.append("Castors trail behind the travel.")
    if not found.all_round:
        parts.append("Tyres forbid all directions but those shown.")
    return " ".join(parts)


def _columns(unit: str) -> tuple[str, ...]:
    return ("From [deg]", "To [deg]", f"Least [{unit}]", f"Most [{unit}]", "Cause", "Wheels at their limit")


def _lines(found: Capability, limit: Limit) -> list[tuple[str, ...]]:
    lines: list[tuple[str, ...]] = []
    for first, last, cause, wheels in sectors(found.directions, limit):
        if cause == "tyres" or (found.few and first > 2 * math.pi - 1e-9):
            continue
        inside = (found.directions >= first) & (found.directions <= last)
        values = limit.value[inside]
        least, most = ("-", "-") if np.isnan(values).all() else (f"{values.min():.4g}", f"{values.max():.4g}")
        ends = (f"{math.degrees(first):.4g}", f"{math.degrees(last):.4g}")
        lines.append((*ends, least, most, cause, ", ".join(wheels) or "-"))
    return lines


def _number(value: float, remark: str) -> str:
    return "infinite: the driven wheels leave a motion open" if math.isinf(value) else f"{value:.4g} {remark}"
