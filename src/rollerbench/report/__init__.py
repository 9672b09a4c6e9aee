"""Figures, pages and tables of runs."""
