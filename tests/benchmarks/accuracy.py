"""Real-time factor against error of each engine, and the ratio at equal accuracy."""

from collections.abc import Callable, Sequence
from typing import Any

import rollerbench as rb

from .engine import Engine, Setting
from .machine import Yardstick
from .motions import Motion
from .rounds import Spread, ratio, timed_rounds
from .search import TARGET, Reference, Search, Trial, front, reference

WINDOWED = "rollerbench windowed"

Progress = Callable[[str], None]


def measure(
    engines: Sequence[Engine],
    robot: rb.Robot,
    motions: Sequence[Motion],
    *,
    effort: str,
    rounds: int,
    progress: Progress,
) -> dict[str, Any]:
    """Searches each engine's settings, then times the best ones in rounds.

    Returns:
        references: What each engine converges to, by its name.
        trials: All settings tried once.
        timed: Those of the fronts, with their real-time factors.
        ratios: Real-time factors of windowed rollers over those of others at equal accuracy.
    """
    yardstick = Yardstick()
    references: dict[str, Reference] = {}
    trials: dict[str, list[Trial]] = {}
    for engine in engines:
        progress(f"{engine.name}: converged reference")
        references[engine.name] = reference(engine, robot, motions, effort)
        search = Search(engine, robot, motions, references[engine.name], yardstick, progress)
        trials[engine.name] = search.run(effort)
    chosen = _chosen(engines, trials)
    timed = _timed(chosen, robot, motions, rounds, progress)
    return {
        "target_percent": TARGET,
        "motions": {motion.name: list(motion.twist(0.5 * motion.duration)) for motion in motions},
        "references": {name: _reference_row(of, references, motions) for name, of in references.items()},
        "trials": [_trial_row(trial) for each in trials.values() for trial in each],
        "timed": timed,
        "ratios": ratios(timed),
    }


def best_settings(result: dict[str, Any]) -> dict[str, Setting]:
    """The fastest setting within the target of each family, or else its most accurate one."""
    return {
        family: Setting(family=family, time_step=row["time_step"], options=row["options"])
        for family, row in _best_rows(result["timed"]).items()
    }


def ratios(timed: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """How much faster windowed rollers are than the best of every other family within the target."""
    best = {family: row for family, row in _best_rows(timed).items() if row["worst_percent"] <= TARGET}
    if WINDOWED not in best:
        return []
    rows = []
    for family, row in best.items():
        if family != WINDOWED:
            spread = ratio(best[WINDOWED]["speeds"], row["speeds"])
            rows.append({"against": family, "setting": row["label"], **_spread(spread, "ratio")})
    return sorted(rows, key=lambda row: row["ratio"])


def _best_rows(timed: Sequence[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    best: dict[str, dict[str, Any]] = {}
    for row in timed:
        key = (row["worst_percent"] > TARGET, row["worst_percent"] if row["worst_percent"] > TARGET else -row["speed"])
        if row["family"] not in best or key < best[row["family"]]["key"]:
            best[row["family"]] = {**row, "key": key}
    return best


def _chosen(engines: Sequence[Engine], trials: dict[str, list[Trial]]) -> list[tuple[Engine, Trial]]:
    chosen = []
    for engine in engines:
        for family in dict.fromkeys(trial.setting.family for trial in trials[engine.name]):
            of_family = [trial for trial in trials[engine.name] if trial.setting.family == family]
            chosen += [(engine, trial) for trial in front(of_family)]
    return chosen


def _timed(
    chosen: Sequence[tuple[Engine, Trial]],
    robot: rb.Robot,
    motions: Sequence[Motion],
    rounds: int,
    progress: Progress,
) -> list[dict[str, Any]]:
    runners = {}
    for engine, trial in chosen:
        progress(f"building {trial.setting.family}, {trial.setting.label}")
        runners[f"{trial.setting.family}, {trial.setting.label}"] = engine.prepare(robot, motions, trial.setting)
    simulated = sum(motion.duration for motion in motions)

    def work(runner: Any) -> Callable[[], float]:
        return lambda: simulated / sum(runner.run(index).wall_time for index in range(len(motions)))

    speeds = timed_rounds({name: work(runner) for name, runner in runners.items()}, rounds, progress)
    for runner in runners.values():
        runner.close()
    rows = []
    for _, trial in chosen:
        values = speeds[f"{trial.setting.family}, {trial.setting.label}"]
        rows.append({**_trial_row(trial), **_spread(Spread.of(values), "speed"), "speeds": values})
    return rows


def _trial_row(trial: Trial) -> dict[str, Any]:
    setting = trial.setting
    return {
        "family": setting.family,
        "label": setting.label,
        "time_step": setting.time_step,
        "options": dict(setting.options),
        "errors_percent": trial.errors,
        "worst_percent": trial.worst,
        "speed_once": trial.speed,
        "failure": trial.failure,
    }


def _reference_row(of: Reference, references: dict[str, Reference], motions: Sequence[Motion]) -> dict[str, Any]:
    others = {
        name: {m.name: m.error_percent(other.poses[m.name], of.poses[m.name]) for m in motions}
        for name, other in references.items()
        if other is not of
    }
    return {
        "setting": f"{of.setting.family}, {of.setting.label}",
        "final_poses": {name: pose.tolist() for name, pose in of.poses.items()},
        "change_at_twice_the_step_percent": of.remaining,
        "other_engines_percent": others,
    }


def _spread(spread: Spread, name: str) -> dict[str, float]:
    return {name: spread.median, f"{name}_low": spread.low, f"{name}_high": spread.high}
