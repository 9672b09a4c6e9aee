"""Meshcat scenes and recordings."""
