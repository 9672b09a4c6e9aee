"""Folders that are not whole are refused with one message that names the file and what is missing."""

import dataclasses
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import rollerbench as rb
from rollerbench.cli import main
from rollerbench.report import StoredRun

CART: dict[str, Any] = {
    **{"name": "short", "robot": "differential_cart", "duration": 0.3, "recording": {"html": False, "preview": False}},
    "command": {"type": "twist", "v_xyw_B": [0.2, 0.0, 0.0], "ramp": 0.1},
}

Break = Callable[[Path], None]


@pytest.fixture(scope="module")
def cart(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A whole run."""
    folder = tmp_path_factory.mktemp("runs") / "cart"
    rb.run(CART, output=folder)
    return folder


def without(*path: str) -> Break:
    """Takes a key out of summary.json."""

    def change(folder: Path) -> None:
        summary = json.loads((folder / "summary.json").read_text())
        place = summary
        for key in path[:-1]:
            place = place[key]
        del place[path[-1]]
        (folder / "summary.json").write_text(json.dumps(summary))

    return change


def summary_with(**values: object) -> Break:
    def change(folder: Path) -> None:
        summary = json.loads((folder / "summary.json").read_text())
        (folder / "summary.json").write_text(json.dumps({**summary, **values}))

    return change


def recording_with(change: Callable[[rb.Recording], rb.Recording]) -> Break:
    """Changes recording.parquet."""

    def rewrite(folder: Path) -> None:
        recording = change(rb.Recording.read(folder))
        (folder / "recording.parquet").write_bytes(recording.to_bytes())

    return rewrite


def lacking(column: str) -> Break:
    def change(recording: rb.Recording) -> rb.Recording:
        kept = {name: values for name, values in recording.columns.items() if name != column}
        return dataclasses.replace(recording, columns=kept)

    return recording_with(change)


def telling(**metadata: object) -> Break:
    """Changes what the recording tells of its run; None takes it out."""

    def change(recording: rb.Recording) -> rb.Recording:
        told = {**recording.metadata, **metadata}
        return dataclasses.replace(recording, metadata={key: value for key, value in told.items() if value is not None})

    return recording_with(change)


def empty(recording: rb.Recording) -> rb.Recording:
    return dataclasses.replace(recording, columns={name: values[:0] for name, values in recording.columns.items()})


def removed(name: str) -> Break:
    return lambda folder: (folder / name).unlink()


def holding(name: str, text: str) -> Break:
    def change(folder: Path) -> None:
        (folder / name).write_text(text)

    return change


def model_with(old: str, new: str) -> Break:
    def change(folder: Path) -> None:
        text = (folder / "model.sdf").read_text()
        assert old in text
        (folder / "model.sdf").write_text(text.replace(old, new, 1))

    return change


OTHER_ROBOT = {"name": "cart", "body": {}, "engines": 2}

BOTH: list[tuple[Break, str]] = [
    (without("pose_error", "percent_of_path"), r"summary\.json: .*lacks pose_error\.percent_of_path"),
    (without("realtime_factor"), r"summary\.json: .*lacks realtime_factor"),
    (without("path_length"), r"summary\.json: .*lacks path_length"),
    (without("wheel_slip", "max"), r"summary\.json: .*lacks wheel_slip\.max"),
    (without("error_budget", "parts", "slip", "yaw"), r"summary\.json: .*lacks error_budget\.parts\.slip\.yaw"),
    (without("cross_check"), r"summary\.json: .*lacks cross_check"),
    (without("versions", "drake"), r"summary\.json: .*lacks versions\.drake"),
    (summary_with(duration="long"), r"summary\.json: .*duration = 'long'"),
    (summary_with(simulated_final_pose=[0.0]), r"summary\.json: .*simulated_final_pose"),
    (removed("summary.json"), r"cart: .*lacks summary\.json"),
    (removed("recording.parquet"), r"cart: .*lacks recording\.parquet"),
    (recording_with(empty), r"recording\.parquet: holds no sample"),
    (lacking("left.slip_x"), r"recording\.parquet: .*lacks left\.slip_x"),
    (lacking("odometry_yaw"), r"recording\.parquet: .*lacks odometry_yaw"),
    (telling(robot_description=None), r"recording\.parquet: .*lacks robot_description"),
    (telling(robot_description=OTHER_ROBOT), r"recording\.parquet: its robot is none of this version"),
    (telling(injected={"mass": OTHER_ROBOT}), r"recording\.parquet: its robot is none of this version"),
    (telling(legs=["front"]), r"recording\.parquet: .*lacks desired_z, .*and \d+ more"),
]

REPLAYED: list[tuple[Break, str]] = [
    (removed("model.sdf"), r"cart: .*lacks model\.sdf"),
    (model_with("<parent>body<", "<parent>nothing<"), r"cart.model\.sdf: .*unknown link 'nothing'"),
    (model_with('relative_to="body"', 'relative_to="none"'), r"cart.model\.sdf: .*unknown link 'none'"),
    (model_with("<geometry>", "<geometry><cone/>"), r"cart.model\.sdf: .*'cone': accepted: box"),
    (model_with("</sdf>", ""), r"cart.model\.sdf: not a model"),
]

REPORTED: list[tuple[Break, str]] = [
    (removed("robot.yaml"), r"cart: .*lacks robot\.yaml"),
    (holding("scenario.yaml", "name: short"), r"scenario\.yaml: .*lacks summary"),
]


def broken(cart: Path, tmp_path: Path, change: Break) -> Path:
    folder = tmp_path / "cart"
    shutil.copytree(cart, folder)
    change(folder)
    return folder


@pytest.mark.parametrize(("change", "message"), BOTH + REPLAYED)
def test_a_broken_folder_is_not_replayed(cart: Path, tmp_path: Path, change: Break, message: str) -> None:
    with pytest.raises(rb.ResourceError, match=message):
        rb.replay(broken(cart, tmp_path, change))


@pytest.mark.parametrize(("change", "message"), BOTH + REPORTED)
def test_a_broken_folder_has_no_report(cart: Path, tmp_path: Path, change: Break, message: str) -> None:
    with pytest.raises(rb.ResourceError, match=message):
        StoredRun.read(broken(cart, tmp_path, change))


@pytest.mark.parametrize("column", ["{leg}.slip_x", "{leg}.joint_2", "desired_z"])
def test_recordings_of_legs_have_all_columns_too(hexapod: Path, tmp_path: Path, column: str) -> None:
    column = column.format(leg=rb.Recording.read(hexapod).metadata["legs"][0])
    folder = tmp_path / "legs"
    shutil.copytree(hexapod, folder)
    lacking(column)(folder)
    for read in (rb.replay, StoredRun.read):
        with pytest.raises(rb.ResourceError, match=rf"recording\.parquet: .*lacks {column}"):
            read(folder)


@pytest.mark.parametrize("arguments", [["replay", "{}", "--html", "page.html"], ["report", "{}"]])
def test_the_commands_end_with_one_message(
    cart: Path, tmp_path: Path, arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    folder = broken(cart, tmp_path, without("pose_error", "percent_of_path"))
    error = ended([each.format(folder) for each in arguments], 2, capsys)
    assert error.count("\n") == 1
    assert str(folder / "summary.json") in error


@pytest.mark.parametrize("target", ["{}/recording.parquet", "{}/summary.json", "{}", "", "{}/page"])
@pytest.mark.parametrize("command", [["replay", "--html"], ["report", "-o"]])
def test_pages_are_written_over_nothing_but_pages(
    cart: Path, command: list[str], target: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = {file: file.read_bytes() for file in cart.rglob("*") if file.is_file()}
    name, option = command
    assert "ends in .html" in ended([name, str(cart), option, target.format(cart)], 2, capsys)
    assert {file: file.read_bytes() for file in cart.rglob("*") if file.is_file()} == before


def test_a_run_is_named_by_its_folder_or_a_file_in_it(
    cart: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pages = [tmp_path / "folder.html", tmp_path / "file.html"]
    for run, page in zip((cart, cart / "recording.parquet"), pages, strict=True):
        ended(["replay", str(run), "--html", str(page)], 0, capsys)
    assert pages[0].read_bytes() == pages[1].read_bytes()


def ended(arguments: list[str], status: int, capsys: pytest.CaptureFixture[str]) -> str:
    """What a command that ends with a status says on standard error."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["rollerbench", *arguments])
        with pytest.raises(SystemExit) as caught:
            main()
    assert caught.value.code == status
    return capsys.readouterr().err
