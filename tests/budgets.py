"""What every error budget must satisfy."""

import pytest

import rollerbench as rb


def assert_parts_add_up(recording: rb.Recording) -> None:
    """The parts sum to the pose error at every moment, and the shares to all of it: but for rounding."""
    budget = rb.error_budget(recording)
    assert budget.total == pytest.approx(recording.q_xyt - recording.reference_q_xyt, abs=1e-9)
    final = budget.to_dict()
    for index, key in enumerate(("x", "y", "yaw")):
        assert sum(part[key] for part in final.values()) == pytest.approx(budget.total[-1, index], abs=1e-9)
    for key in ("position_share", "yaw_share"):
        known = [part[key] for part in final.values() if part[key] is not None]
        assert not known or sum(known) == pytest.approx(1.0, abs=1e-6)
