"""Reproduces a paper: runs its scenarios, then writes figures, numbers and a page."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from rollerbench.description.files import write_atomically
from rollerbench.errors import ResourceError
from rollerbench.report.reproduction import reproduction_page
from rollerbench.simulation import RunResult, run
from rollerbench.simulation.log import versions
from rollerbench.studies import differential_drive, mecanum, omni_anisotropy, six_wheel, wheel_leg
from rollerbench.studies.folder import claim, write_figures
from rollerbench.studies.paper import Findings, Paper

PAPERS = {
    paper.name: paper
    for paper in (six_wheel.PAPER, differential_drive.PAPER, mecanum.PAPER, omni_anisotropy.PAPER, wheel_leg.PAPER)
}

FILES, FOLDERS = {"results.json", "report.html"}, {"figures", "runs"}
"""Everything that a reproduction writes, and so may replace."""

Progress = Callable[[float, str, float], None]
"""Called with the simulated time so far [s], the name of the run, and the time of all runs together [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reproduction:
    """A reproduced paper.

    Attributes:
        paper: The paper.
        findings: Results, pictures and mistakes.
        runs: The runs by name.
        folder: Where everything was written.
    """

    paper: Paper
    findings: Findings
    runs: Mapping[str, RunResult]
    folder: Path


def paper_names() -> list[str]:
    """Papers that can be reproduced."""
    return list(PAPERS)


def reproduce(
    paper: str, *, output: str | Path, recordings: bool = True, progress: Progress | None = None
) -> Reproduction:
    """Regenerates the figures and tables of a source paper from theory and from Drake.

    Args:
        paper: One of `paper_names()`.
        output: Folder to write: figures/*.svg, results.json, report.html, and runs/NAME, a run folder each.
        recordings: Whether the runs keep their Meshcat pages.
        progress: Called now and then.

    Raises:
        ResourceError: there is no such paper, or the folder cannot be written or holds something else.
        SimulationError: a run failed; the runs before it are kept.
    """
    if paper not in PAPERS:
        raise ResourceError(f"no paper '{paper}'; accepted: {', '.join(PAPERS)}")
    folder, chosen = Path(output), PAPERS[paper]
    earlier = claim(folder, files=FILES, folders=FOLDERS, index="results.json", what="reproduction")
    # The page of an earlier reproduction does not belong to the runs that are about to replace its runs.
    for name in ("report.html", "results.json"):
        (folder / name).unlink(missing_ok=True)
    scenarios = chosen.scenarios()
    total, before = sum(scenario.duration for scenario in scenarios.values()), 0.0
    runs = {}
    for name, scenario in scenarios.items():
        if not recordings:
            scenario = scenario.model_copy(update={"recording": scenario.recording.model_copy(update={"html": False})})
        shown = None if progress is None else _shifted(progress, name, before, total)
        runs[name] = run(scenario, output=folder / "runs" / name, progress=shown)
        before += scenario.duration
    findings = chosen.evaluate(runs)
    try:
        _write(folder, chosen, findings, runs, earlier)
    except OSError as error:
        raise ResourceError(f"{folder}: cannot be written: {error}") from error
    return Reproduction(paper=chosen, findings=findings, runs=runs, folder=folder)


def _shifted(progress: Progress, name: str, before: float, total: float) -> Callable[[float], None]:
    return lambda now: progress(before + now, name, total)


def _write(folder: Path, paper: Paper, findings: Findings, runs: Mapping[str, RunResult], earlier: set[str]) -> None:
    drawn = write_figures(folder, {picture.name: picture.svg for picture in findings.pictures}, earlier)
    results = {
        "paper": paper.name,
        "citation": paper.citation,
        "versions": versions(),
        "figures": drawn,
        "results": [result.to_dict() for result in findings.results],
        "mistakes": [mistake.to_dict() for mistake in findings.mistakes],
        "runs": {name: result.summary for name, result in runs.items()},
    }
    write_atomically(folder / "results.json", json.dumps(results, indent=2, allow_nan=False) + "\n")
    write_atomically(folder / "report.html", _page(folder, paper, findings, runs))


def _page(folder: Path, paper: Paper, findings: Findings, runs: Mapping[str, RunResult]) -> str:
    return reproduction_page(
        paper={
            "name": paper.name,
            "title": paper.title,
            "citation": paper.citation,
            "introduction": paper.introduction,
        },
        results=[result.to_dict() for result in findings.results],
        pictures=findings.pictures,
        mistakes=[mistake.to_dict() for mistake in findings.mistakes],
        runs=[
            {
                "name": name,
                "summary": result.scenario.summary,
                "page": (folder / "runs" / name / "recording.html").exists(),
            }
            for name, result in runs.items()
        ],
        versions=versions(),
    )
