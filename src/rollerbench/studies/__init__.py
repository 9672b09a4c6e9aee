"""Whole studies of many runs: the reproductions of the source papers."""

from rollerbench.studies.reproduce import Reproduction, paper_names, reproduce

__all__ = ["Reproduction", "paper_names", "reproduce"]
