"""Measures rollerbench beside other simulators, and its kinematics beside WPILib: python -m tests.benchmarks --help.

No part of the tests' pass or fail; `test_benchmarks.py` only shows that the code runs.
"""
