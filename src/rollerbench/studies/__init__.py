"""Whole studies: the reproductions of the source papers, and what a robot can do in each direction."""

from rollerbench.studies.analyze import Analysis, analyze
from rollerbench.studies.reproduce import Reproduction, paper_names, reproduce

__all__ = ["Analysis", "Reproduction", "analyze", "paper_names", "reproduce"]
