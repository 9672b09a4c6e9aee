"""The page of a run: one HTML file without any request to a server."""

from collections.abc import Mapping
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from rollerbench.report.budget import COLUMNS, budgets
from rollerbench.report.rows import summary_rows

TITLES = {
    "trajectory": "Path of the body: what the equations say, and what was simulated",
    "pose_error": "Simulated minus reference pose",
    "wheel_speeds": "Wheel speeds",
    "wheel_slip": "Slip of the wheels over the ground",
    "error_budget": "Parts of the pose error",
    "body": "Height and inclination of the body",
    "gait": "Which feet are on the ground, and what they bear",
    "feet": "Feet over the ground",
    "joint_efforts": "Torques of the joints' motors",
}


def run_page(summary: Mapping[str, Any], figures: Mapping[str, str], *, has_recording: bool) -> str:
    """The report.html of a run.

    Args:
        summary: The content of summary.json.
        figures: SVG texts by name.
        has_recording: Whether recording.html lies beside the page.
    """
    environment = Environment(loader=PackageLoader("rollerbench.report"), autoescape=True, undefined=StrictUndefined)
    drawn = [(TITLES[name], Markup(svg[svg.index("<svg") :])) for name, svg in figures.items()]
    return environment.get_template("run.html.j2").render(
        summary=summary,
        rows=summary_rows(summary),
        budgets=budgets(summary),
        budget_columns=COLUMNS,
        figures=drawn,
        has_recording=has_recording,
    )
