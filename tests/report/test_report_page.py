"""The reports of one and of several runs: what they say, and how a real browser shows them."""

import base64
import dataclasses
import gzip
import html
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import rollerbench as rb
from browser import opened
from rollerbench.cli import main
from rollerbench.report import StoredRun, report_page
from rollerbench.report.page import labels
from rollerbench.report.parameters import differences

WIDTHS = (360, 820, 1400)

OVERFLOW = "document.documentElement.scrollWidth - window.innerWidth"

FIGURES = 6

PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)


@pytest.fixture(scope="module")
def comparison(youbot: Path, large_wheel: Path) -> str:
    """The page of two runs."""
    return report_page([StoredRun.read(youbot), StoredRun.read(large_wheel)])


def figures_of(folder: Path) -> dict[str, str]:
    """The figures that a run folder holds, which are not drawn again for most tests."""
    return {file.stem: file.read_text() for file in (folder / "figures").iterdir()}


def text_of(page: str) -> str:
    """What a page says, without its tags and scripts."""
    bare = re.sub(r"<(script|style)\b.*?</\1>", " ", page, flags=re.DOTALL)
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", bare)).split())


def test_a_report_tells_everything_about_its_run(large_wheel: Path) -> None:
    page = (large_wheel / "report.html").read_text()
    text = text_of(page)
    summary = json.loads((large_wheel / "summary.json").read_text())
    for each in ("Key numbers", "radius_scale.front_left * 1.03", "duration * 0.5", "friction 0.8", "Max effort [N m]"):
        assert each in text
    assert "ramp * 0.1" in text
    assert "seed *" not in text
    assert f"Drake {summary['versions']['drake']}, Python {summary['versions']['python']}, seed 0" in text
    assert page.count("<figure") == FIGURES
    assert page.count("<svg role=") == FIGURES
    # The run folder was written before it could be read; both ways give the same page.
    assert report_page([StoredRun.read(large_wheel)]) == page


def test_identifiers_are_unique_on_a_page_and_point_to_something(comparison: str) -> None:
    page = re.sub(r"<script\b.*?</script>", "", comparison, flags=re.DOTALL)
    found = re.findall(r'\bid="([^"]+)"', page)
    assert len(found) == len(set(found))
    assert set(re.findall(r'(?:url\(|href=")#([\w-]+)', page)) <= set(found)


def test_the_recording_inside_is_the_one_beside(youbot: Path) -> None:
    page = (youbot / "report.html").read_text()
    packed = re.search(r'<script type="application/gzip;base64">([^<]+)</script>', page)
    assert packed
    assert gzip.decompress(base64.b64decode(packed[1])) == (youbot / "recording.html").read_bytes()


def test_runs_of_one_scenario_are_told_apart_by_their_folders(youbot: Path, large_wheel: Path, hexapod: Path) -> None:
    runs = [StoredRun.read(path) for path in (youbot, large_wheel, hexapod, youbot)]
    assert labels(runs) == [
        "youbot_plus_y (straight)", "youbot_plus_y (large)", "hexapod_stand", "youbot_plus_y (straight) 2",
    ]  # fmt: skip


def test_a_comparison_shows_what_differs(comparison: str, youbot: Path) -> None:
    text = text_of(comparison)
    start, end = text.index("Parameters that differ Parameter"), text.index("Key numbers youbot_plus_y")
    assert text[start:end].split()[3:] == [
        *("Parameter", "youbot_plus_y", "(straight)", "youbot_plus_y", "(large)"),
        *("errors.radius_scale.front_left", "-", "1.03", "recording.html", "yes", "no"),
    ]
    run = StoredRun.read(youbot)
    heavier = run.robot.body.model_copy(update={"mass": 30.0})
    changed = dataclasses.replace(run, robot=run.robot.model_copy(update={"body": heavier}), name="heavy")
    assert differences([run, changed]) == [("robot.body.mass", [f"{run.robot.body.mass:g}", "30"])]


def test_wheels_and_legs_failures_and_second_engines_side_by_side(youbot: Path, hexapod: Path) -> None:
    good, legs = StoredRun.read(youbot), StoredRun.read(hexapod)
    second = {
        "engine": "mujoco",
        "failure": None,
        "apart": [0.001, 0.0, 0.0],
        **{key: good.summary[key] for key in ("simulated_final_pose", "pose_error", "error_budget")},
    }
    both = dataclasses.replace(good, name="both", summary={**good.summary, "cross_check": second})
    failure = {"status": "failed", "failure": "the robot tipped over at t = 0.3 s & <fell>"}
    failed = dataclasses.replace(good, name="failed", summary={**good.summary, **failure})
    figures = [figures_of(youbot), figures_of(youbot), figures_of(hexapod)]
    text = text_of(report_page([both, failed, legs], figures=figures))
    assert "Failed: the robot tipped over at t = 0.3 s & <fell>." in text
    assert "youbot_plus_y (both), mujoco" in text
    assert "Robots on legs have none." in text
    assert "Which feet are on the ground" in text
    assert "the robot tipped over" in report_page([failed], figures=[{}])


@pytest.mark.parametrize(
    ("engines", "named"),
    [(["drake"], "Drake 1"), (["mujoco"], "MuJoCo 2"), (["drake", "mujoco"], "Drake 1, MuJoCo 2")],
)
def test_the_footer_names_the_engines_that_simulated(youbot: Path, engines: list[str], named: str) -> None:
    run = StoredRun.read(youbot)
    outcome = {key: run.summary[key] for key in ("simulated_final_pose", "pose_error", "error_budget")}
    second = {"engine": engines[-1], "failure": None, "apart": [0.0] * 3, **outcome} if len(engines) > 1 else None
    versions = {"rollerbench": "0", "drake": "1", "mujoco": "2", "python": "3"}
    summary = {**run.summary, "engine": engines[0], "cross_check": second, "versions": versions}
    page = report_page([dataclasses.replace(run, summary=summary)], figures=[{}])
    (footer,) = re.findall(r"<footer>(.*?)</footer>", page, flags=re.DOTALL)
    assert " ".join(footer.split()) == f"rollerbench 0, {named}, Python 3, seed 0"


def test_what_is_not_a_run_is_refused(youbot: Path, tmp_path: Path) -> None:
    with pytest.raises(rb.ResourceError, match="no such folder"):
        StoredRun.read(tmp_path / "none")
    with pytest.raises(rb.ResourceError, match=r"not the folder of a run: it lacks scenario\.yaml"):
        StoredRun.read(tmp_path)
    with pytest.raises(rb.ResourceError, match="at least one run"):
        report_page([])
    for name, content, message in (
        ("summary.json", "{", "not valid JSON"),
        ("summary.json", "{}", "lacks robot, scenario"),
        ("summary.json", "[1]", "expected keys, found list"),
        ("scenario.yaml", "a: [", "not valid YAML"),
        ("scenario.yaml", "- 1", "expected a mapping"),
        ("robot.yaml", "name: no body", "body"),
        ("recording.parquet", "PAR", "cannot be read as a recording"),
    ):
        broken = tmp_path / "broken"
        shutil.copytree(youbot, broken, dirs_exist_ok=True)
        (broken / name).write_text(content)
        with pytest.raises(rb.ResourceError, match=message) as caught:
            StoredRun.read(broken)
        assert name in str(caught.value)


def test_the_command_writes_reports_without_drake(large_wheel: Path, tmp_path: Path) -> None:
    code = "import sys; sys.modules['pydrake'] = None; from rollerbench.cli import main; main()"
    arguments = ["report", str(large_wheel), str(large_wheel / "recording.parquet")]
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "Written: comparison.html\n", "")
    assert "2 runs side by side" in (tmp_path / "comparison.html").read_text()


def test_the_command_writes_a_single_report_again(
    youbot: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "run"
    shutil.copytree(youbot, folder)
    (folder / "report.html").write_text("old")
    monkeypatch.setattr("sys.argv", ["rollerbench", "report", str(folder)])
    with pytest.raises(SystemExit, match="0"):
        main()
    assert "Written:" in capsys.readouterr().out
    assert (folder / "report.html").read_text() == (youbot / "report.html").read_text().replace("straight", "run")
    for bad in ([str(tmp_path)], [str(folder), "-o", str(tmp_path)]):
        monkeypatch.setattr("sys.argv", ["rollerbench", "report", *bad])
        with pytest.raises(SystemExit, match="2"):
            main()


def test_a_browser_shows_a_report_on_every_width_and_plays_its_recording(youbot: Path, tmp_path: Path) -> None:
    """Offline; printed, a picture takes the place of the button."""
    page = tmp_path / "report.html"
    run = dataclasses.replace(StoredRun.read(youbot), preview=PIXEL)
    page.write_text(report_page([run], figures=[figures_of(youbot)]))
    with opened(page) as watched:
        shown = watched.page
        for width in WIDTHS:
            shown.set_viewport_size({"width": width, "height": 800})
            assert shown.evaluate(OVERFLOW) <= 0, width
        assert shown.locator("figure svg").count() == FIGURES
        sizes = shown.locator("figure svg").evaluate_all("all => all.map(each => each.getBoundingClientRect().height)")
        assert min(sizes) > 100
        assert "Position error" in shown.inner_text("body")
        assert shown.locator("iframe").count() == 0
        shown.emulate_media(media="print")
        assert not shown.locator(".recording button").is_visible()
        assert shown.locator(".recording img").is_visible()
        shown.emulate_media(media="screen")
        shown.set_viewport_size({"width": WIDTHS[0], "height": 600})
        shown.locator(".recording button").click()
        shown.frame_locator("iframe").locator("#meshcat-pane canvas").wait_for()
        scene = next(frame for frame in shown.frames if frame != shown.main_frame)
        scene.wait_for_function("viewer.animator.duration > 0")
        with shown.expect_download() as saved:
            shown.get_by_text("Save the recording").click()
        assert saved.value.suggested_filename == "youbot_plus_y.html"
        assert watched.requests == []
        assert watched.errors == []


def test_a_browser_shows_runs_side_by_side_or_below_each_other(comparison: str, tmp_path: Path) -> None:
    page = tmp_path / "comparison.html"
    page.write_text(comparison)
    with opened(page) as watched:
        for width, columns in zip(WIDTHS, (1, 1, 2), strict=True):
            watched.page.set_viewport_size({"width": width, "height": 800})
            assert watched.page.evaluate(OVERFLOW) <= 0, width
            lefts = watched.page.locator("#figure-wheel_speeds + .grid svg").evaluate_all(
                "all => all.map(each => Math.round(each.getBoundingClientRect().left))"
            )
            assert len(lefts) == 2
            assert len(set(lefts)) == columns
        assert watched.page.locator("figure svg").count() == 2 * FIGURES + 2
        assert watched.requests == []
        assert watched.errors == []
