"""Colours and sizes of everything that is drawn: models, scenes, pictures.

Orange is what was simulated, blue what the equations say: apart with colour-blindness too (Okabe and Ito 2008).
"""

Color = tuple[float, float, float]
"""Red, green and blue, from 0 to 1."""

SIMULATED: Color = (0.84, 0.37, 0.0)
REFERENCE: Color = (0.0, 0.45, 0.70)
RUNS: tuple[Color, ...] = (
    SIMULATED,
    (0.0, 0.62, 0.45),
    (0.80, 0.47, 0.65),
    (0.90, 0.62, 0.0),
    (0.34, 0.71, 0.91),
    (0.35, 0.35, 0.35),
)
"""Of several runs in one scene, in turn."""

HEADING: Color = (0.10, 0.10, 0.12)
"""Of the heading arrow on a body that has the colour of its run."""

BODY: Color = (0.30, 0.34, 0.40)
HUB: Color = (0.42, 0.43, 0.46)
TYRE: Color = (0.12, 0.12, 0.13)
ROLLERS: tuple[Color, Color] = ((0.12, 0.12, 0.13), (0.62, 0.62, 0.65))
"""In turn round a wheel, so that one sees them turn with it."""
MARK: Color = (0.95, 0.60, 0.10)
"""Spokes, and the mark at the front of a body."""
LEG_LINKS: tuple[Color, ...] = ((0.42, 0.43, 0.46), (0.55, 0.58, 0.63), (0.42, 0.43, 0.46), (0.72, 0.74, 0.78))
"""Of the links from the hip on, in turn: hip, femur, knee, tibia of a leg of four joints."""

GROUND: Color = (0.93, 0.935, 0.94)
GRID: Color = (0.62, 0.66, 0.71)
FINE_GRID: Color = (0.82, 0.84, 0.87)
BUMP: Color = (0.72, 0.66, 0.58)
STEP: Color = (0.62, 0.66, 0.70)
SKY: tuple[Color, Color] = ((0.99, 0.99, 1.0), (0.86, 0.89, 0.93))
"""Background, at the top and at the bottom."""

FORCE: Color = (0.0, 0.50, 0.36)
SLIP_COLORS: tuple[Color, ...] = ((0.85, 0.70, 0.0), (0.78, 0.22, 0.45), (0.25, 0.0, 0.20))
"""Of wheels that slide faster than `SLIP_SPEEDS`."""
SLIP_SPEEDS = (0.01, 0.05, 0.2)
"""Speeds over the ground from which a wheel counts as sliding a little, much, and altogether [m/s]."""
SUPPORT: Color = (0.50, 0.72, 0.25)
FOOTHOLD: Color = (0.35, 0.55, 0.48)

GHOST_OPACITY = 0.28
SUPPORT_OPACITY = 0.35

# Lengths over the size of the robot, its largest horizontal extent.
GHOST_MARGIN = 0.008
"""How far the ghost stands out of a robot that is where it should be."""
TRAIL_WIDTH = 0.02
REFERENCE_TRAIL_WIDTH = 0.04
"""Wider, so that it shows on both sides where the simulated trail covers it."""
SKID_WIDTH = 0.035
ARROW_LENGTH = 0.30
ARROW_WIDTH = 0.10
FORCE_LENGTH = 0.25
"""Of the arrow of a wheel that carries its share of the weight; at least `FORCE_REACH` wheels high."""
FORCE_REACH = 1.6
FORCE_WIDTH = 0.018
GROUND_MARGIN = 2.5
"""How far the ground reaches beyond the path."""
LIFT = 0.002
"""Between marks on the ground that lie over each other, so that they do not flicker."""
GROUND_THICKNESS = 0.05


def css(color: Color) -> str:
    """A colour as style sheets and figures have it, such as #0072b2."""
    return "#" + "".join(f"{round(255 * value):02x}" for value in color)
