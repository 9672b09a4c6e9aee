"""What the wheels did to the ground, and the ground to the body."""

import numpy as np

from rollerbench.recording import Recording


def wheel_slip(recording: Recording) -> dict[str, float]:
    """Largest and root mean square slip speed over all wheels and samples [m/s], while they touch the ground."""
    slip = np.hypot(recording.wheels("slip_x"), recording.wheels("slip_y"))
    slip = slip[recording.wheels("depth") >= 0]
    if not slip.size:
        return {"max": 0.0, "rms": 0.0}
    return {"max": float(slip.max()), "rms": float(np.sqrt(np.mean(slip**2)))}


def height_ripple(recording: Recording) -> float:
    """Peak to peak height of Bo during the run [m]."""
    return float(np.ptp(recording.columns["z"]))
