"""The benchmark runs; what it measures is no matter of tests."""

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_benchmark_runs(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.benchmarks", "--smoke", "-o", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "benchmark.json").read_text())
    timed = {row["family"]: row for row in result["accuracy"]["timed"]}
    assert timed["rollerbench full"]["worst_percent"] < 5.0
    assert {row["family"] for row in result["memory"]} >= {"rollerbench full", "MuJoCo elliptic"}
    assert "# Benchmark" in (tmp_path / "benchmark.md").read_text()
    assert (tmp_path / "accuracy.svg").stat().st_size > 1000
