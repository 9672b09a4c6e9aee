import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# Helpers shared by the tests (robots.py, browser.py) are found whichever way rollerbench is installed.
sys.path.insert(0, str(Path(__file__).parent))

# The same examples on every machine, however slow.
settings.register_profile(
    "steady", deadline=None, derandomize=True, max_examples=60, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("steady")


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run folders without figures, which take longer than most runs; test_run.py and test_leg_runs.py look at them."""
    monkeypatch.setattr("rollerbench.simulation.folder.run_figures", lambda recording: {})
