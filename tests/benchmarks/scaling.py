"""Cost of a step against rollers a wheel, and against robots in one plant."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rollerbench.sdf import robot_to_mjcf

from .engine import Engine, Setting
from .motions import COUNT, Motion, motions, robot_with_rollers
from .mujoco_engine import MujocoRunner, copies_of, model_of
from .rollerbench_engine import CrowdRunner
from .rounds import Spread, timed_rounds

ROLLER_COUNTS = (6, 8, 12, 16, 24, 32)
ROBOT_COUNTS = (1, 2, 4, 8)
STEP = 0.003
"""Step of these comparisons [s]: within the step rule for 32 rollers at 0.4 m/s."""

SPACING = 1.0
"""Distance of robots in one plant [m]."""

SETTINGS = (
    Setting(family="rollerbench windowed", time_step=STEP, options={"contact_approximation": "fast"}),
    Setting(family="rollerbench windowed", time_step=STEP, options={"contact_approximation": "lagged"}),
    Setting(family="rollerbench full", time_step=STEP, options={"contact_approximation": "lagged"}),
    Setting(family="MuJoCo elliptic", time_step=STEP, options={"impratio": 100.0, "jacobian": "sparse"}),
    Setting(family="MuJoCo elliptic", time_step=STEP, options={"impratio": 100.0, "jacobian": "dense"}),
    Setting(family="MuJoCo pyramidal", time_step=STEP, options={"impratio": 100.0, "jacobian": "sparse"}),
    Setting(family="MuJoCo pyramidal", time_step=STEP, options={"impratio": 100.0, "jacobian": "dense"}),
)
"""Each engine's common settings; MuJoCo with both kinds of matrices, as its own choice depends on the size."""

Progress = Callable[[str], None]


def against_rollers(
    engines: Mapping[str, Engine],
    counts: Sequence[int],
    *,
    settings: Sequence[Setting],
    duration: float,
    rounds: int,
    progress: Progress,
) -> list[dict[str, Any]]:
    """Time of a step [us] for each number of rollers a wheel, moving sideways.

    Args:
        engines: Engines by the first word of the families that they run.
        counts: Rollers a wheel.
        settings: How they are simulated.
        duration: Simulated time [s].
        rounds: Rounds of interleaved runs.
        progress: Called with what is being done.
    """

    def runner(engine: Engine, setting: Setting, count: int) -> Any:
        robot = robot_with_rollers(count)
        return engine.prepare(robot, motions(robot, duration=duration, ramp=0.3 * duration, names=("y",)), setting)

    cases = [(engine, setting, count) for engine, setting in _of(engines, settings) for count in counts]
    return _measured(cases, runner, "rollers", duration, rounds, progress)


def against_robots(
    engines: Mapping[str, Engine],
    counts: Sequence[int],
    *,
    settings: Sequence[Setting],
    duration: float,
    rounds: int,
    progress: Progress,
) -> list[dict[str, Any]]:
    """Time of a step [us] for each number of robots in one plant, all moving diagonally."""

    def runner(_: Engine, setting: Setting, count: int) -> Any:
        robot = robot_with_rollers(COUNT)
        (motion,) = motions(robot, duration=duration, ramp=0.3 * duration, names=("diagonal",))
        if setting.family.startswith("MuJoCo"):
            return _mujoco_crowd(motion, setting, count)
        return CrowdRunner(motion, setting, count, SPACING)

    cases = [
        (engine, setting, count)
        for engine, setting in _of(engines, settings)
        for count in counts
        if engine.name in ("MuJoCo", "rollerbench")
    ]
    return _measured(cases, runner, "robots", duration, rounds, progress)


def _mujoco_crowd(motion: Motion, setting: Setting, count: int) -> MujocoRunner:
    robot = motion.scenario.robot
    if count == 1:
        model = model_of(robot_to_mjcf(robot, time_step=setting.time_step), setting)
    else:
        model = copies_of(robot, setting, count, SPACING)
    return MujocoRunner(model, [motion], copies=count)


def _of(engines: Mapping[str, Engine], settings: Sequence[Setting]) -> list[tuple[Engine, Setting]]:
    found = []
    for setting in settings:
        engine = engines.get(setting.family.split()[0])
        if engine is not None:
            found.append((engine, setting))
    return found


def _measured(
    cases: Sequence[tuple[Engine, Setting, int]],
    make: Callable[[Engine, Setting, int], Any],
    unit: str,
    duration: float,
    rounds: int,
    progress: Progress,
) -> list[dict[str, Any]]:
    runners, rows, failures = {}, [], []
    for engine, setting, count in cases:
        name = f"{setting.family}, {setting.label}, {count} {unit}"
        progress(f"building {name}")
        head = {"family": setting.family, "label": setting.label, unit: count}
        try:
            runners[name] = make(engine, setting, count)
            runners[name].run(0)
            rows.append((name, head))
        except Exception as error:  # Engines refuse settings in their own ways.
            failures.append({**head, "failure": f"{type(error).__name__}: {error}".splitlines()[0][:200]})
            runners.pop(name, None)
    steps = duration / STEP
    times = timed_rounds(
        {name: lambda runner=runner: 1e6 * runner.run(0).wall_time / steps for name, runner in runners.items()},
        rounds,
        progress,
    )
    for runner in runners.values():
        runner.close()
    result = []
    for name, head in rows:
        spread = Spread.of(times[name])
        result.append({**head, "us": spread.median, "us_low": spread.low, "us_high": spread.high, "all": times[name]})
    return result + failures
