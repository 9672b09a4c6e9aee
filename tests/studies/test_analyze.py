"""What analyze writes, for every shipped robot."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robots
import rollerbench as rb
from rollerbench.analysis.limits import capability, sectors, travel_directions
from rollerbench.report.analysis import FIGURES, analysis_page
from rollerbench.report.limits import Points, limit_figures
from rollerbench.resources import robot_names
from rollerbench.studies import analyze

STRAIGHT = {"differential_cart", "six_wheel"}
VERSIONS = {"rollerbench": "1", "drake": "1", "python": "3"}


@pytest.mark.parametrize("name", [name for name in robot_names() if rb.load_robot(name).wheels])
def test_every_shipped_robot(name: str, tmp_path: Path) -> None:
    seen: list[tuple[float, float]] = []
    done = analyze(name, output=tmp_path, roll_resistance=0.02, progress=lambda now, total: seen.append((now, total)))
    assert seen[-1][0] == seen[-1][1]
    written = json.loads((tmp_path / "analysis.json").read_text())
    page = (tmp_path / "report.html").read_text()
    expected = set(FIGURES) - ({"limiting_wheels", "effort_map"} if name in STRAIGHT else set())
    assert {path.stem for path in (tmp_path / "figures").iterdir()} == expected
    assert all(f'id="{figure}"' in page for figure in expected)
    assert "http://" not in page.replace("http://www.w3.org", "").replace("http://purl.org", "").replace(
        "http://creativecommons.org", ""
    )
    degrees = np.degrees(written["directions"])
    speed = np.array(written["max_speed"]["value"], dtype=np.float64)
    assert len(degrees) == len(speed) == len(written["efforts"]["values"])
    feasible = np.isfinite(speed)
    assert degrees[feasible].tolist() == ([0, 180, 360] if name in STRAIGHT else degrees.tolist())
    assert all(bool(names) for names in written["max_speed"]["wheels"])
    found = done.capability
    assert written["max_acceleration"]["best"]["value"][0] == pytest.approx(
        float(rb.limits.max_acceleration(name, 0.0, roll_resistance=0.02)), rel=1e-6
    )
    i, j = int(np.flatnonzero(feasible)[1]), 3
    assert written["efforts"]["values"][i][j] == pytest.approx(
        rb.limits.wheel_efforts(name, found.directions[i], found.map_accelerations[j], roll_resistance=0.02), rel=1e-6
    )


def test_a_base_without_limits_and_without_motion(tmp_path: Path) -> None:
    """No max_speed: the speeds are said to be unlimited, and their figures left out. No drive: nothing is left."""
    done = analyze(rb.load_robot(robots.kiwi()), output=tmp_path / "free")
    page = (tmp_path / "free" / "report.html").read_text()
    assert "none: no wheel that turns has a max_speed" in page
    assert not (tmp_path / "free" / "figures" / "speed.svg").exists()
    assert done.capability.polygon is None
    data = robots.kiwi()
    idle = {**data, "wheels": [{**wheel, "driven": False} for wheel in data["wheels"]]}
    analyze(rb.load_robot(idle), output=tmp_path / "idle")
    assert "none: the driven wheels cannot push this way" in (tmp_path / "idle" / "report.html").read_text()
    assert list((tmp_path / "idle" / "figures").iterdir()) == []


def test_measured_points_are_laid_over(tmp_path: Path) -> None:
    points = Points(directions=np.array([0.0, 1.0]), values=np.array([1.0, 1.1]))
    efforts = Points(directions=np.array([0.0, 1.0]), values=np.array([[0.1] * 3, [0.2] * 3]))

    def measure(found: Any, progress: Any) -> dict[str, Points]:
        assert found.robot.name == "kiwi"
        progress(1.0, 1.0)
        return {"speed": points, "acceleration": points, "efforts": efforts}

    analyze("kiwi", output=tmp_path, measure=measure)
    written = json.loads((tmp_path / "analysis.json").read_text())
    assert written["measured"]["speed"] == {"directions": [0.0, 1.0], "values": [1.0, 1.1]}
    plain = limit_figures(capability(rb.load_robot("kiwi")))
    for name in ("speed", "acceleration", "efforts"):
        assert (tmp_path / "figures" / f"{name}.svg").read_text() != plain[name]


def test_directions_that_tyres_allow_are_among_those_shown() -> None:
    data = robots.cart()
    turned = [{**wheel, "heading_deg": 0.37} for wheel in data["wheels"]]
    robot = rb.load_robot({**data, "wheels": turned})
    degrees = np.degrees(travel_directions(robot))
    assert np.abs(degrees - 0.37).min() < 1e-9
    assert np.abs(degrees - 180.37).min() < 1e-9
    found = capability(robot)
    assert found.few
    assert np.degrees(found.directions[found.goes]) == pytest.approx([0.37, 180.37])
    assert "0.37 deg" in analysis_page(found, limit_figures(found), VERSIONS)


def test_ranges_of_directions() -> None:
    found = capability(rb.load_robot("kiwi"))
    ranges = list(sectors(found.directions, found.speed))
    assert [(round(math.degrees(a)), round(math.degrees(b))) for a, b, *_ in ranges] == [
        (60 * k, 60 * k + 60) for k in range(6)
    ]
    assert ranges[0][2:] == ("speed", ("rear_left",))


def test_other_folders_are_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(rb.ResourceError, match=r"holds something else \(thesis.tex\); accepted: .* earlier analysis"):
        analyze("kiwi", output=tmp_path)
    with pytest.raises(rb.KinematicsError, match="ground_friction"):
        analyze("kiwi", output=tmp_path / "new", ground_friction=-1.0)
