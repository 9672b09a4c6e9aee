"""What a reproduction of a paper consists of."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from rollerbench.simulation import RunResult, Scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """One number: as printed, from the equations, from the simulation.

    Attributes:
        item: Figure, table or equation of the paper: "Figure 10".
        quantity: What it is, in words.
        unit: Its unit; "-" if it has none.
        printed: The paper's value; None if it prints none.
        theory: The value of our equations; None if there is none.
        simulated: Drake's value; None if nothing was simulated.
    """

    item: str
    quantity: str
    unit: str
    printed: float | None = None
    theory: float | None = None
    simulated: float | None = None

    @property
    def difference(self) -> float | None:
        """Simulated minus theory; where one of them is missing, the other one minus the printed value."""
        if self.simulated is not None and self.theory is not None:
            return self.simulated - self.theory
        value = self.simulated if self.theory is None else self.theory
        return None if value is None or self.printed is None else value - self.printed

    def to_dict(self) -> dict[str, Any]:
        """The entry of results.json."""
        names = ("item", "quantity", "unit", "printed", "theory", "simulated", "difference")
        return {name: getattr(self, name) for name in names}


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """A figure, named by the paper's number.

    Attributes:
        name: Name of its file: "figure_10".
        title: Its heading: "Figure 10."
        caption: What it shows.
        svg: The SVG text.
    """

    name: str
    title: str
    caption: str
    svg: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Mistake:
    """A mistake of a paper, with its proof.

    Attributes:
        where: The equation or sentence.
        claim: What it says.
        correction: What is right.
        proof: Numbers computed on the spot that decide between the two, by label: value and unit.
    """

    where: str
    claim: str
    correction: str
    proof: Mapping[str, tuple[float, str]]

    def to_dict(self) -> dict[str, Any]:
        """The entry of results.json."""
        proof = [{"quantity": label, "value": value, "unit": unit} for label, (value, unit) in self.proof.items()]
        return {"where": self.where, "claim": self.claim, "correction": self.correction, "proof": proof}


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings:
    """What the runs of a paper show."""

    results: tuple[Result, ...]
    pictures: tuple[Picture, ...]
    mistakes: tuple[Mistake, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Paper:
    """A source paper and how it is reproduced.

    Attributes:
        name: Its name on the command line.
        title: Heading of the report.
        citation: Authors, year, title, journal.
        introduction: Paragraphs: what was simulated, and what had to be assumed.
        scenarios: Makes the scenarios to run, by name.
        evaluate: Makes findings of the runs, by name.
    """

    name: str
    title: str
    citation: str
    introduction: tuple[str, ...]
    scenarios: Callable[[], dict[str, Scenario]]
    evaluate: Callable[[Mapping[str, RunResult]], Findings]
