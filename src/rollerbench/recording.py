"""What a run recorded: columns over time, in one Parquet file."""

import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from rollerbench.errors import ResourceError

Array = NDArray[np.float64]

ROBOT_COLUMNS: dict[str, str] = {
    "time": "s",
    **dict.fromkeys(("x", "y", "z"), "m"),
    **dict.fromkeys(("roll", "pitch", "yaw"), "rad"),
    **{"vx": "m/s", "vy": "m/s", "wz": "rad/s"},
    **{f"reference_{name}": unit for name, unit in (("x", "m"), ("y", "m"), ("yaw", "rad"))},
    **{f"reference_{name}": unit for name, unit in (("vx", "m/s"), ("vy", "m/s"), ("wz", "rad/s"))},
    **{f"odometry_{name}": unit for name, unit in (("x", "m"), ("y", "m"), ("yaw", "rad"))},
}
"""Columns of the robot and their units. Poses of B in W, twists in B turned upright."""

WHEEL_COLUMNS: dict[str, str] = {
    "angle": "rad",
    "speed": "rad/s",
    "measured": "rad/s",
    "command": "rad/s",
    "effort": "N m",
    "swivel": "rad",
    "contact_x": "m",
    "contact_y": "m",
    "depth": "m",
    "slip_x": "m/s",
    "slip_y": "m/s",
    "drive_x": "-",
    "drive_y": "-",
    "rolling_radius": "m",
    "first_roller": "-",
    **dict.fromkeys(("force_x", "force_y", "force_z"), "N"),
}
"""Columns of each wheel, named wheel.column, and their units.

speed is the wheel's own, measured what its encoder tells; command is the commanded speed, or where torques are
commanded the one that these should lead to; measured, command and effort are NaN for wheels without a
motor. contact_x and contact_y are where the wheel touches the ground, from Bo along the axes of B turned upright;
slip_x and slip_y are the velocity of the wheel's or roller's surface over the ground along them; depth is the
penetration, negative in the air. With the velocity v_C of the body over the contact, drive = (drive_x, drive_y) along
these axes and rolling_radius are those of drive . v_C = rolling_radius speed + drive . slip, the equation that the
wheel really obeys. force is what the ground does to the wheel, along the same axes; it is recorded on request only
(recording.forces). Velocities at the contact are those of the step that starts with the sample, as the engine finds
them.
"""

FORCES = ("force_x", "force_y", "force_z")
"""Columns of wheels that are recorded on request only."""

LEG_COLUMNS: dict[str, str] = {
    **dict.fromkeys(("foot_x", "foot_y", "foot_z"), "m"),
    **dict.fromkeys(("slip_x", "slip_y"), "m/s"),
    "wheel": "rad",
    "wheel_speed": "rad/s",
    "wheel_effort": "N m",
    "stance": "-",
    "load": "N",
    "joint_": "rad",
    "effort_": "N m",
}
"""Columns of each leg, named leg.column, and their units; joint_ and effort_ are followed by the joint's number.

foot is the lowest point of the foot's wheel and slip its velocity over the ground, in W; stance is 1 for a foot that
shall stand and 0 for one in the air, load what it bears.
"""

DESIRED_COLUMNS: dict[str, str] = {"desired_z": "m", "desired_roll": "rad", "desired_pitch": "rad"}
"""The desired height and inclination of a body on legs, and their units."""

SHOWN = 5
"""Messages name so many missing columns."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """Samples of a run, one per step of the plant.

    Attributes:
        columns: Arrays (n,) by name: `ROBOT_COLUMNS`, and `WHEEL_COLUMNS` of each wheel as "wheel.column", or
            `LEG_COLUMNS` of each leg.
        wheel_names: Names of the wheels in the order of robot.yaml.
        metadata: Names and versions that tell where the recording comes from.
    """

    columns: Mapping[str, Array]
    wheel_names: tuple[str, ...]
    metadata: Mapping[str, Any] = field(default_factory=dict)

    @property
    def time(self) -> Array:
        """Times (n,) [s]."""
        return self.columns["time"]

    @property
    def q_xyt(self) -> Array:
        """Simulated poses (n, 3); the yaw counts full turns [m, m, rad]."""
        return self._stack("x", "y", "yaw")

    @property
    def v_xyw_B(self) -> Array:
        """Simulated twists (n, 3) [m/s, m/s, rad/s]."""
        return self._stack("vx", "vy", "wz")

    @property
    def reference_q_xyt(self) -> Array:
        """Poses (n, 3) that the equations give for the command [m, m, rad]."""
        return self._stack("reference_x", "reference_y", "reference_yaw")

    @property
    def reference_v_xyw_B(self) -> Array:
        """Twists (n, 3) of the reference [m/s, m/s, rad/s]."""
        return self._stack("reference_vx", "reference_vy", "reference_wz")

    @property
    def odometry_q_xyt(self) -> Array:
        """Poses (n, 3) that the equations give for the measured wheel speeds [m, m, rad]."""
        return self._stack("odometry_x", "odometry_y", "odometry_yaw")

    def wheels(self, column: str) -> Array:
        """One of `WHEEL_COLUMNS` for all wheels, (n, n_wheels)."""
        return self._stack(*(f"{name}.{column}" for name in self.wheel_names))

    def to_bytes(self) -> bytes:
        """The recording as a Parquet file; units are in the columns' metadata."""
        fields = [pa.field(name, pa.float64(), metadata={"unit": _unit(name)}) for name in self.columns]
        metadata = {"wheels": json.dumps(self.wheel_names), **{k: json.dumps(v) for k, v in self.metadata.items()}}
        table = pa.table([pa.array(column) for column in self.columns.values()], schema=pa.schema(fields, metadata))
        sink = io.BytesIO()
        pq.write_table(table, sink, compression="zstd")
        return sink.getvalue()

    @classmethod
    def read(cls, path: str | Path) -> "Recording":
        """Reads recording.parquet, given as the file or as the run folder.

        Raises:
            ResourceError: it is not there, not a recording, or lacks columns.
        """
        file = Path(path) / "recording.parquet" if Path(path).is_dir() else Path(path)
        try:
            table = pq.read_table(file)
            metadata = {key.decode(): json.loads(value) for key, value in (table.schema.metadata or {}).items()}
        except (OSError, pa.ArrowException, ValueError) as error:
            raise ResourceError(f"{file}: cannot be read as a recording: {error}") from error
        if "wheels" not in metadata:
            raise ResourceError(f"{file}: not a recording of rollerbench: it lacks wheels")
        missing = _missing(table.column_names, metadata["wheels"], metadata.get("legs", ()))
        if missing:
            more = f" and {len(missing) - SHOWN} more" if len(missing) > SHOWN else ""
            raise ResourceError(
                f"{file}: not a recording of rollerbench: it lacks {', '.join(missing[:SHOWN])}{more}; "
                "accepted: a recording of this version"
            )
        strange = [field.name for field in table.schema if not pa.types.is_floating(field.type)]
        if strange:
            raise ResourceError(f"{file}: not a recording of rollerbench: {strange[0]} does not hold numbers")
        return cls(
            columns={name: table[name].to_numpy() for name in table.column_names},
            wheel_names=tuple(metadata.pop("wheels")),
            metadata=metadata,
        )

    def _stack(self, *names: str) -> Array:
        return np.column_stack([self.columns[name] for name in names])


def _missing(columns: Iterable[str], wheels: Iterable[str], legs: Sequence[str]) -> list[str]:
    """Columns that a recording of wheels and legs lacks; forces may be missing of all wheels."""
    present = set(columns)
    forces = any(f"{wheel}.{name}" in present for wheel in wheels for name in FORCES)
    of_wheels = [name for name in WHEEL_COLUMNS if forces or name not in FORCES]
    of_legs = [name for name in LEG_COLUMNS if not name.endswith("_")]
    needed = [*ROBOT_COLUMNS, *(DESIRED_COLUMNS if legs else ())]
    needed += [f"{wheel}.{name}" for wheel in wheels for name in of_wheels]
    needed += [f"{leg}.{name}" for leg in legs for name in of_legs]
    return [name for name in needed if name not in present]


def _unit(name: str) -> str:
    column = name.rpartition(".")[2]
    known = ROBOT_COLUMNS | DESIRED_COLUMNS
    of_parts = WHEEL_COLUMNS | LEG_COLUMNS
    return known.get(name) or of_parts.get(column) or of_parts.get(column.rstrip("0123456789"), "rad/s")
