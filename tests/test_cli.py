"""The command as users meet it: its output and its exit status, as a process or, sooner, in this one."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from ruamel.yaml import YAML

import robots
from rollerbench.cli import main
from rollerbench.resources import robot_names, scenario_files

Command = Callable[..., subprocess.CompletedProcess[str]]


def process(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """The command as a process of its own."""
    code = "from rollerbench.cli import main; main()"
    return subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, cwd=cwd, check=False
    )


@pytest.fixture
def rollerbench(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Command:
    """The command in this process, which has loaded all that a process must load first."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        monkeypatch.setattr("sys.argv", ["rollerbench", *arguments])
        with pytest.raises(SystemExit) as end:
            main()
        assert isinstance(end.value.code, int)
        return subprocess.CompletedProcess(arguments, end.value.code, *capsys.readouterr())

    return run


def test_help_has_an_example_for_every_command(rollerbench: Command) -> None:
    top = process("--help")
    assert top.returncode == 0
    for command in ("robots", "scenarios", "run", "teleop", "replay", "report", "analyze", "build", "schema"):
        assert command in top.stdout
        shown = rollerbench(command, "--help")
        assert shown.returncode == 0
        assert f"Example: rollerbench {command}" in shown.stdout


def test_robots_and_scenarios_are_listed(rollerbench: Command) -> None:
    listed = rollerbench("robots").stdout
    assert all(name in listed for name in robot_names())
    listed = rollerbench("scenarios").stdout
    assert all(name in listed for name in scenario_files())


def test_one_robot_is_shown_in_full(rollerbench: Command) -> None:
    out = rollerbench("robots", "youbot_base").stdout
    for words in ("Drive matrix J", "[rad/s]", "21.0526", "Roller matrix G", "Degree of mobility", "1.3810", "30"):
        assert words in out


def test_a_robot_with_legs_is_shown_in_full(rollerbench: Command) -> None:
    out = rollerbench("robots", "wheel_leg_hexapod").stdout
    for words in ("6 legs of 4 joints", "Denavit-Hartenberg", "q3 +90", "-0.22", "insect", "0.2116", "0.311", "30 kg"):
        assert words in out


def test_run_prints_a_table_and_writes_the_folder(tmp_path: Path) -> None:
    done = process("run", "youbot_plus_y", "-o", "out", "--no-recording", "--set", "duration=1.2", cwd=tmp_path)
    assert done.returncode == 0
    assert done.stderr == ""
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert f"{1e3 * summary['pose_error']['final_position']:.3f} mm" in done.stdout
    assert "Real-time factor" in done.stdout
    assert not (tmp_path / "out" / "recording.html").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["analyze", "wheel_leg_hexapod"], "wheel_leg_hexapod stands on legs; accepted: robots with wheels"),
        (["run", "no_such"], "no scenario 'no_such'"),
        (["run", "youbot_plus_x", "--robot", "no_such"], "no robot 'no_such'"),
        (["run", "youbot_plus_x", "--set", "plant.time_step=fast"], "plant.time_step = 'fast'"),
        (["run", "youbot_plus_x", "--set", "oops"], "--set 'oops'"),
        (["robots", "no_such"], "no robot 'no_such'"),
        (["robots", "~no_such_user/x"], "no robot '~no_such_user/x'"),
        (["robots", "a" * 300], "no robot 'aaa"),
        (["run", "youbot_plus_x", "--set", "seed=2024-13-45"], "--set 'seed=2024-13-45'"),
        (["build", "no_such"], "no robot 'no_such'"),
        (["analyze", "no_such"], "no robot 'no_such'"),
        (["analyze", "kiwi", "-o", "/dev/null/kiwi"], "/dev/null/kiwi"),
        (["fly"], "No such command 'fly'"),
        (["run", "youbot_plus_x", "-o", "/dev/null/run"], "/dev/null/run"),
    ],
)
def test_bad_input_ends_with_one_message_and_status_2(
    rollerbench: Command, arguments: list[str], words: str, tmp_path: Path
) -> None:
    done = rollerbench(*arguments)
    assert done.returncode == 2
    assert words in done.stderr
    assert done.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_a_process_shows_no_traceback_either(tmp_path: Path) -> None:
    done = process("run", "youbot_plus_x", "--set", "plant.time_step=fast", cwd=tmp_path)
    assert done.returncode == 2
    assert "plant.time_step = 'fast'" in done.stderr
    assert "Traceback" not in done.stderr


def test_analyze_prints_a_table_and_writes_the_folder(rollerbench: Command, tmp_path: Path) -> None:
    done = rollerbench("analyze", "kiwi")
    assert done.returncode == 0
    assert done.stderr == ""
    assert "1.386 m/s at 0 deg, 1.2 m/s at 30 deg" in done.stdout
    assert {path.name for path in (tmp_path / "analyses" / "kiwi").iterdir()} == {
        *("analysis.json", "figures", "report.html"),
    }
    bad = rollerbench("analyze", "kiwi", "--roll-resistance", "-1")
    assert bad.returncode == 2
    assert "roll_resistance = -1.0: accepted: a number of 0 or more" in bad.stderr


def test_an_infeasible_command_is_bad_input(rollerbench: Command, tmp_path: Path) -> None:
    with (tmp_path / "cart.yaml").open("w") as stream:
        YAML().dump(robots.cart(), stream)
    done = rollerbench("run", "youbot_plus_y", "--robot", "cart.yaml")
    assert done.returncode == 2
    assert "left at +0.3 m/s" in done.stderr


def test_a_failed_simulation_has_status_3_and_keeps_its_recording(tmp_path: Path) -> None:
    data = robots.mecanum()
    data["body"] = {"size": [0.3, 0.2, 1.5], "mass": 10.0, "center_of_mass": [0.0, 0.0, 1.0], "center": [0, 0, 0.8]}
    with (tmp_path / "tall.yaml").open("w") as stream:
        YAML().dump(data, stream)
    overrides = ("--set", "command.v_xyw_B=[2, 0, 0]", "--set", "command.ramp=0.1", "--no-recording")
    done = process("run", "youbot_plus_x", "--robot", "tall.yaml", "-o", "out", *overrides, cwd=tmp_path)
    assert done.returncode == 3
    assert "warning: " in done.stderr
    assert "failed: youbot_plus_x: at t = " in done.stderr
    assert "Traceback" not in done.stderr
    assert "Failed" in done.stdout
    assert (tmp_path / "out" / "recording.parquet").is_file()
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["status"] == "failed"


def test_build_writes_the_model_beside_the_description(rollerbench: Command, tmp_path: Path) -> None:
    with (tmp_path / "robot.yaml").open("w") as stream:
        YAML().dump(robots.kiwi(), stream)
    done = rollerbench("build", str(tmp_path / "robot.yaml"))
    assert done.returncode == 0
    assert (tmp_path / "test_kiwi.sdf").read_text().startswith("<?xml")


def test_the_schema_accepts_what_is_shipped(rollerbench: Command) -> None:
    schema = json.loads(rollerbench("schema").stdout)
    assert schema["title"] == "Robot"
    assert {"name", "body"} == set(schema["required"])
    assert {"wheels", "legs"} <= set(schema["properties"])
    assert "command" in json.loads(rollerbench("schema", "--scenario").stdout)["required"]


@pytest.mark.parametrize("what", ["load_robot('youbot_base')", "WheelKinematics('youbot_base').drive_matrix"])
def test_descriptions_and_kinematics_do_not_load_drake(what: str) -> None:
    code = f"import sys, rollerbench as rb; rb.{what}; assert 'pydrake' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_help_loads_nothing_heavy() -> None:
    code = (
        "import sys, rollerbench.cli\n"
        "heavy = {'pydrake', 'numpy', 'scipy', 'matplotlib', 'pydantic', 'pyarrow'} & sys.modules.keys()\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
