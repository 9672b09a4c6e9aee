"""Figures have units on every axis, keep what is extreme, stay small, and of several runs have the same scales."""

import dataclasses
import itertools
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes

from rollerbench.recording import Recording
from rollerbench.report.figures import (
    drawn_alike,
    drawn_run,
    pose_error,
    run_figures,
    trajectory,
    wheel_efforts,
    wheel_slip,
    wheel_speeds,
)
from rollerbench.report.panels import kept, looks, panels_text

UNIT = re.compile(r"\[(m|mm|s|deg|rad/s|mm/s|N|N m|-)\]$")


@pytest.fixture(scope="module")
def recordings(youbot: Path, large_wheel: Path, hexapod: Path) -> dict[str, Recording]:
    return {path.name: Recording.read(path) for path in (youbot, large_wheel, hexapod)}


def stretched(recording: Recording, samples: int) -> Recording:
    """The same run with as many samples, each column with noise that no smoothing thins out."""
    noise = np.random.default_rng(0).normal(size=samples)
    at = np.linspace(0, len(recording.time) - 1, samples)
    columns = {
        name: np.interp(at, np.arange(len(column)), column) + 0.1 * np.nanmax(np.abs(column), initial=0.0) * noise
        for name, column in recording.columns.items()
    }
    columns["time"] = np.arange(samples) * 0.005
    return dataclasses.replace(recording, columns=columns)


def with_wheels(recording: Recording, count: int) -> Recording:
    """The same run as if it had as many wheels."""
    columns = dict(recording.columns)
    for index in range(count):
        first = recording.wheel_names[index % len(recording.wheel_names)]
        of_first = {name: column for name, column in recording.columns.items() if name.startswith(f"{first}.")}
        columns |= {name.replace(first, f"wheel_{index}"): column for name, column in of_first.items()}
    return dataclasses.replace(
        recording, columns=columns, wheel_names=tuple(f"wheel_{index}" for index in range(count)), metadata={}
    )


def all_panels(recordings: dict[str, Recording]) -> Iterator[tuple[str, Axes]]:
    drawn = [(name, figure) for each in recordings.values() for name, figure in drawn_run(each).items()]
    drawn += [("together", trajectory(recordings)), ("together", pose_error(recordings))]
    for name, (_, panels) in drawn:
        yield from ((name, axes) for axes in panels)


def test_every_axis_says_what_it_is_and_its_unit(recordings: dict[str, Recording]) -> None:
    for name, axes in all_panels(recordings):
        assert UNIT.search(axes.get_ylabel()), (name, axes.get_ylabel())
        # The panels above the lowest of a column share its abscissa.
        if axes.xaxis.get_tick_params()["labelbottom"]:
            assert UNIT.search(axes.get_xlabel()), name


def test_lines_that_share_a_panel_differ_in_colour_and_style() -> None:
    first = [(look.color, look.style) for look in itertools.islice(looks(), 20)]
    assert len(set(first)) == 20
    assert all(a[0] != b[0] and a[1] != b[1] for a, b in itertools.pairwise(first))


@given(st.integers(1, 4000), st.integers(20, 300), st.integers(1, 3), st.integers(0, 99))
def test_thinning_keeps_ends_and_extremes(samples: int, most: int, columns: int, seed: int) -> None:
    values = np.random.default_rng(seed).normal(size=(samples, columns))
    chosen = kept(values, most)
    assert len(chosen) <= most
    assert (np.diff(chosen) > 0).all()
    assert (chosen[0], chosen[-1]) == (0, samples - 1)
    assert np.array_equal(values[chosen].max(axis=0), values.max(axis=0))
    assert np.array_equal(values[chosen].min(axis=0), values.min(axis=0))


@given(st.integers(0, 1800), st.integers(0, 99))
def test_thinning_keeps_gaps(start: int, seed: int) -> None:
    values = np.random.default_rng(seed).normal(size=2000)
    values[start : start + 60] = np.nan
    chosen = kept(values, 200)
    assert len(chosen) <= 200
    assert np.isnan(values[chosen]).any()
    assert np.nanmax(values[chosen]) == np.nanmax(values)
    assert np.nanmin(values[chosen]) == np.nanmin(values)


def test_the_same_figure_of_two_runs_has_the_same_scales(recordings: dict[str, Recording]) -> None:
    runs = drawn_alike(list(recordings.values()))
    for name in dict.fromkeys(name for run in runs for name in run):
        same = [run[name] for run in runs if name in run]
        for figure, panels in same:
            panels_text(figure, panels)
        for panels in zip(*(panels for _, panels in same), strict=True):
            limits = np.array([[*axes.get_xlim(), *axes.get_ylim()] for axes in panels])
            assert np.ptp(limits, axis=0) == pytest.approx(0.0, abs=1e-12), name


def test_a_limit_that_is_not_reached_does_not_flatten_the_curves(recordings: dict[str, Recording]) -> None:
    """In this run torques come nowhere near the 6 N m of the robot.yaml; the legend names them all the same."""
    figure, (axes,) = wheel_efforts(recordings["straight"])
    efforts = np.abs(recordings["straight"].wheels("effort")).max()
    assert efforts < 0.4 * 6.0
    assert max(map(abs, axes.get_ylim())) < 2 * efforts
    assert "limit 6 N m" in panels_text(figure, [axes])


@pytest.mark.parametrize("name", ["straight", "legs"])
def test_runs_that_end_at_once_are_drawn(recordings: dict[str, Recording], name: str) -> None:
    recording = recordings[name]
    columns = {key: column[:1] for key, column in recording.columns.items()}
    figures = run_figures(dataclasses.replace(recording, columns=columns))
    assert all("</svg>" in svg for svg in figures.values())


def test_figures_of_long_runs_and_many_wheels_stay_small(recordings: dict[str, Recording]) -> None:
    long = stretched(recordings["straight"], 24001)
    many = with_wheels(long, 10)
    figures = run_figures(long)
    figures |= {
        draw.__name__ + "_of_ten": panels_text(*draw(many)) for draw in (wheel_speeds, wheel_efforts, wheel_slip)
    }
    assert {name: len(svg) for name, svg in figures.items() if len(svg) > 155e3} == {}
    assert "wheel_9, speed [rad/s]" in figures["wheel_speeds_of_ten"]


def test_the_same_run_gives_the_same_figures(recordings: dict[str, Recording]) -> None:
    """Letters are text in them, so that they can be searched."""
    first, again = (panels_text(*pose_error({"": recordings["straight"]})) for _ in range(2))
    assert first == again
    assert ">error in yaw [deg]</text>" in first
