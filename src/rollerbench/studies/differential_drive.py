"""Xu et al.: a cart of two geared tyres and a castor. Arcs, the smallest radius, and what gear errors do to a path."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rollerbench.analysis import error_budget
from rollerbench.description import Robot, load_robot
from rollerbench.kinematics import WheelKinematics
from rollerbench.kinematics.odometry import rotate
from rollerbench.report.drawing import Curve, curves
from rollerbench.simulation import RunResult, Scenario, load_scenario
from rollerbench.studies.paper import Findings, Mistake, Paper, Picture, Result

Array = NDArray[np.float64]

RADII = (0.15, 0.3, 0.6, 1.2)
"""Radii of the arcs of C [m]."""

GAMMAS_DEG = (0, 10, 20, 30)
"""Angles gamma at which turns about Bo are simulated [deg]; at 0 they are turns about C."""

GEARS = ("ripple", "drift", "phase", "common")


def scenarios() -> dict[str, Scenario]:
    """Straight run, arcs, turns with the mass at several places, and imperfections one by one."""
    robot = load_robot("differential_cart")
    chosen = [load_scenario("cart_straight")]
    for radius in RADII:
        path = math.sqrt(radius**2 - offset(robot) ** 2)
        overrides = {
            "name": f"arc_{round(1000 * radius)}_mm",
            "summary": f"Arc of 120 deg on which C travels at radius {radius:g} m",
            "command": {"type": "path", "name": "arc", "radius": path, "angle_deg": 120.0},
        }
        chosen.append(load_scenario("cart_arc", overrides=overrides))
    for gamma in GAMMAS_DEG:
        overrides = {"name": f"turn_gamma_{gamma}_deg", "summary": f"Full turn about Bo with gamma = {gamma} deg"}
        chosen.append(load_scenario("cart_turn", overrides=overrides, robot=with_gamma(robot, math.radians(gamma))))
    names = [*(f"cart_gear_{gear}" for gear in GEARS), "cart_radius_inequality", "cart_backlash", "cart_slip"]
    chosen += [load_scenario(name) for name in names]
    return {scenario.name: scenario for scenario in chosen}


def offset(robot: Robot) -> float:
    """How far the mass centre C lies ahead of the axle: l sin(gamma) [m]."""
    return float(robot.inertia.com[0])


def half_track(robot: Robot) -> float:
    """Half of the distance between the tyres: l cos(gamma) [m]."""
    return float(robot.wheels[0].p_BoHo_B[1])


def with_gamma(robot: Robot, gamma: float) -> Robot:
    """The cart with its body's mass moved so that C lies l sin(gamma) ahead of the axle [rad].

    With C over the axle it would stand on the brink of tipping over, so that it gets a second castor behind.
    """
    data = robot.model_dump(mode="json", exclude_none=True)
    data["body"]["center"] = list(robot.body.box_center)
    if gamma == 0.0:
        castor = dict(data["wheels"][-1])
        x, y, z = castor["position"]
        data["wheels"].append({**castor, "name": "rear_castor", "position": [-x, y, z]})
        robot = load_robot(data)
    shift = half_track(robot) * math.tan(gamma) - offset(robot)
    data["body"]["center_of_mass"][0] += shift * robot.mass / robot.body.mass
    return load_robot(data)


def gear_path(x: Array, *, constant: float, amplitude: float, wave_number: float, phase: float, track: float) -> Array:
    """Lateral deviation y(x) of a straight run, right gear minus left gear eps(x) = constant + amplitude sin(k x + p).

    y = constant x^2 / 2B + (A cos p / B k) x - (A / B k^2) (sin(k x + p) - sin p), left positive, for small yaw: the
    yaw is the integral of eps / B.

    Args:
        x: Distances travelled (n,) [m].
        constant: Mean difference of the gear errors [-].
        amplitude: A [-].
        wave_number: k: cycles a wheel turn over the wheel radius [1/m].
        phase: p [rad].
        track: B [m].
    """
    k = wave_number
    wave = np.sin(k * x + phase) - math.sin(phase)
    drift = constant * x**2 / (2 * track) + amplitude * math.cos(phase) / (track * k) * x
    deviation: Array = drift - amplitude / (track * k**2) * wave
    return deviation


def evaluate(runs: Mapping[str, RunResult]) -> Findings:
    """Figures 6 to 8, the smallest radius, other causes, and the mistakes."""
    robot = runs["cart_straight"].scenario.robot
    parts = [_equations(robot), _straight(runs["cart_straight"]), _arcs(robot, runs), _smallest_radius(robot, runs),
             _gears(robot, runs), _other_causes(robot, runs)]  # fmt: skip
    return Findings(
        results=tuple(result for results, _ in parts for result in results),
        pictures=tuple(picture for _, pictures in parts for picture in pictures),
        mistakes=_mistakes(robot, runs),
    )


Part = tuple[list[Result], list[Picture]]


def _equations(robot: Robot) -> Part:
    """The paper's matrices against the general wheel equations, about C."""
    h, b, r = offset(robot), half_track(robot), robot.wheels[0].radius
    length, gamma = math.hypot(h, b), math.atan2(h, b)
    kinematics = WheelKinematics(robot).at([h, 0.0])
    worst_8 = worst_9 = 0.0
    for theta in np.radians(np.arange(0, 360, 15)):
        to_world = np.eye(3)
        to_world[:2, :2] = rotate(theta, np.eye(2)).T
        j1 = _j1(theta, length, gamma)
        worst_8 = max(worst_8, np.abs(r / 2 * j1 - to_world @ kinematics.forward_matrix).max())
        j2 = np.array([[math.cos(theta), math.sin(theta), s * length * math.cos(gamma)] for s in (-1, 1)])
        worst_9 = max(worst_9, np.abs(j2 / r - kinematics.drive_matrix @ to_world.T).max())
    return [
        Result(item="Equation (8)", quantity="largest difference from the general wheel equation", unit="-",
               theory=float(worst_8)),
        Result(item="Equation (9)", quantity="largest difference from the general wheel equation", unit="-",
               theory=float(worst_9)),
    ], []  # fmt: skip


def _j1(theta: float, length: float, gamma: float) -> Array:
    """J1 (3, 2) of equation (8)."""
    rows = [
        [math.cos(theta - gamma), math.cos(theta + gamma)],
        [math.sin(theta - gamma), math.sin(theta + gamma)],
        [-1 / length, 1 / length],
    ]
    return np.array(rows) / math.cos(gamma)


def _straight(run: RunResult) -> Part:
    length, y = run.recording.q_xyt[-1, 0], run.recording.q_xyt[:, 1]
    return [
        Result(item="Section 3.1", quantity="length of the straight run", unit="m",
               theory=run.summary["path_length"], simulated=float(length)),
        Result(item="Section 3.1", quantity="largest lateral deviation", unit="mm",
               theory=0.0, simulated=float(1e3 * np.abs(y).max())),
    ], []  # fmt: skip


def _arcs(robot: Robot, runs: Mapping[str, RunResult]) -> Part:
    results, lines = [], []
    h, b = offset(robot), half_track(robot)
    for radius in RADII:
        run, item = runs[f"arc_{round(1000 * radius)}_mm"], f"Figure 6, R = {radius:g} m"
        speeds = run.recording.wheels("angle")[-1, :2]
        ahead = radius * math.cos(math.asin(h / radius))
        path, theory = centre_path(run, "q_xyt"), centre_path(run, "reference_q_xyt")
        error = run.summary["pose_error"]
        results += [
            Result(item=item, quantity="radius of the path of C", unit="m",
                   theory=radius, simulated=circle_radius(path)),
            Result(item=item, quantity="turn of the right over the left wheel", unit="-",
                   theory=(ahead + b) / (ahead - b), simulated=float(speeds[1] / speeds[0])),
            Result(item=item, quantity="position error at the end, of the path", unit="%",
                   theory=0.0, simulated=error["percent_of_path"]),
            Result(item=item, quantity="yaw error at the end", unit="deg",
                   theory=0.0, simulated=math.degrees(error["final_yaw"])),
        ]  # fmt: skip
        lines += [
            Curve(label=f"R = {radius:g} m, theory", x=theory[:, 0], y=theory[:, 1]),
            Curve(label=f"R = {radius:g} m, simulated", x=path[:, 0], y=path[:, 1], style="--"),
        ]
    caption = "Paths of the mass centre C on arcs; theory and simulation differ by less than the width of the lines."
    svg = curves("x [m]", {"y [m]": lines}, equal=True)
    return results, [Picture(name="figure_06", title="Figure 6.", caption=caption, svg=svg)]


def _smallest_radius(robot: Robot, runs: Mapping[str, RunResult]) -> Part:
    results, simulated = [], []
    b = half_track(robot)
    for gamma in GAMMAS_DEG:
        run = runs[f"turn_gamma_{gamma}_deg"]
        radius = circle_radius(centre_path(run, "q_xyt"))
        simulated.append(radius)
        about = ", a turn about C" if gamma == 0 else ""
        # The general equations, about C: the speed of C over the yaw rate while the wheels turn against each other.
        twist = WheelKinematics(run.scenario.robot).at([offset(run.scenario.robot), 0.0]).forward([-1.0, 1.0])
        results += [
            Result(item="Section 3.3", quantity=f"R_min at gamma = {gamma} deg{about}", unit="m",
                   theory=float(np.hypot(*twist[:2]) / abs(twist[2])),
                   simulated=radius),
        ]  # fmt: skip
    fine = np.linspace(0.0, 35.0, 71)
    lines = [
        Curve(label="l sin(gamma)", x=fine, y=b * np.tan(np.radians(fine))),
        Curve(label="simulated", x=np.array(GAMMAS_DEG, dtype=float), y=np.array(simulated), style="o"),
    ]
    caption = (
        "Smallest radius of C over gamma, with l cos(gamma) = 0.2 m: a full turn about the middle of the axle. At "
        "gamma = 0, and only there, it is a turn about C itself; the cart then has a second castor, so as not to tip."
    )
    svg = curves("gamma [deg]", {"R_min [m]": lines})
    return results, [Picture(name="smallest_radius", title="Section 3.3.", caption=caption, svg=svg)]


def _gears(robot: Robot, runs: Mapping[str, RunResult]) -> Part:
    results, pictures = [], []
    for number, gear, caption in (
        (
            7,
            "ripple",
            "Lateral deviation with a gear ripple of 3 % on the right, one wave a wheel turn: the path waves.",
        ),
        (8, "drift", "The same ripple and a ratio that differs by 0.5 %: the path waves and drifts."),
    ):
        run = runs[f"cart_gear_{gear}"]
        x, y = run.recording.q_xyt[:, 0], run.recording.q_xyt[:, 1]
        theory = formula(robot, run, x)
        item = f"Figure {number}"
        if gear == "ripple":
            results.append(Result(item=item, quantity="height of the wave", unit="mm",
                                  theory=float(1e3 * np.ptp(theory)), simulated=float(1e3 * np.ptp(y))))  # fmt: skip
        else:
            results += [
                Result(item=item, quantity="drift after 3 m", unit="mm",
                       theory=float(1e3 * theory[-1]), simulated=float(1e3 * y[-1])),
                Result(item=item, quantity="height of the wave on it", unit="mm",
                       theory=_wave(robot, run, x, theory), simulated=_wave(robot, run, x, y)),
            ]  # fmt: skip
        lines = [
            Curve(label="formula", x=x, y=1e3 * theory),
            Curve(label="simulated", x=x, y=1e3 * y, style="--"),
            Curve(label="odometry", x=x, y=1e3 * run.recording.odometry_q_xyt[:, 1], style=":"),
        ]
        svg = curves("x [m]", {"lateral deviation [mm]": lines})
        pictures.append(Picture(name=f"figure_{number:02d}", title=f"{item}.", caption=caption, svg=svg))
    return results, pictures


def _other_causes(robot: Robot, runs: Mapping[str, RunResult]) -> Part:
    results, lines = [], []
    run = runs["cart_radius_inequality"]
    radii = [wheel.radius for wheel in run.scenario.simulated_robot.wheels[:2]]
    bend = half_track(robot) * (radii[1] + radii[0]) / (radii[1] - radii[0])
    results.append(Result(item="Section 4", quantity="radius of the path, right tyre 0.5 % larger", unit="m",
                          theory=bend, simulated=circle_radius(run.recording.q_xyt[:, :2])))  # fmt: skip
    run = runs["cart_slip"]
    results.append(Result(item="Section 4", quantity="yaw on a wet patch, hard start and stop; theory: by its slip",
                          unit="deg", theory=math.degrees(error_budget(run.recording).parts["slip"][-1, 2]),
                          simulated=math.degrees(run.recording.q_xyt[-1, 2])))  # fmt: skip
    run = runs["cart_backlash"]
    play = math.radians(run.scenario.errors.backlash_deg["right"])
    radius, track = robot.wheels[1].radius, 2 * half_track(robot)
    # Half of the play is lost at the start; at the reversal, all of it.
    results.append(Result(item="Section 4", quantity="yaw after 0.5 m ahead and back, 3 deg of play on the right",
                          unit="deg", theory=math.degrees((-0.5 * play + play) * radius / track),
                          simulated=math.degrees(run.recording.q_xyt[-1, 2])))  # fmt: skip
    for name, label in (("cart_radius_inequality", "radii differ by 0.5 %"), ("cart_slip", "right tyre slips"),
                        ("cart_gear_phase", "ripple without mean, phase 0"),
                        ("cart_gear_common", "the same gear error on both sides")):  # fmt: skip
        q = runs[name].recording.q_xyt
        lines.append(Curve(label=label, x=q[:, 0], y=1e3 * q[:, 1]))
    caption = "What else makes the cart stray from a straight line, and what does not."
    svg = curves("x [m]", {"lateral deviation [mm]": lines})
    return results, [Picture(name="other_causes", title="Section 4.", caption=caption, svg=svg)]


def _mistakes(robot: Robot, runs: Mapping[str, RunResult]) -> tuple[Mistake, ...]:
    h, b, r = offset(robot), half_track(robot), robot.wheels[0].radius
    kinematics = WheelKinematics(robot).at([h, 0.0])
    radius, speed, theta = 0.6, 0.3, math.radians(45)
    alpha, gamma, length = math.asin(h / radius), math.atan2(h, b), math.hypot(h, b)
    # To the right, as in figure 6.

    def speeds(direction: float) -> Array:
        in_body = rotate(-theta, speed * np.array([math.cos(direction), math.sin(direction)]))
        return kinematics.inverse([*in_body, -speed / radius], strict=False)

    def skid(direction: float) -> float:
        in_body = rotate(-theta, speed * np.array([math.cos(direction), math.sin(direction)]))
        return float(np.abs(kinematics.skid_speeds([*in_body, -speed / radius])[:2]).max())

    right = speeds(theta - alpha)
    ratio, motors, j1 = robot.wheels[0].gear_ratio, np.full(2, 20.0), _j1(theta, length, gamma)
    ahead = radius * math.cos(theta + alpha)
    printed_14 = (ahead + length * math.cos(theta + gamma)) / (ahead - length * math.cos(theta - gamma))
    common, phase = runs["cart_gear_common"], runs["cart_gear_phase"]
    x = phase.recording.q_xyt[:, 0]
    return (
        Mistake(
            where="Equation (12)",
            claim="C moves in the direction theta + alpha.",
            correction="It is theta - alpha, as in (11): the other direction makes the tyres skid.",
            proof={
                "skid of the tyres at 0.3 m/s, R = 0.6 m, theta = 45 deg, with theta + alpha": (
                    skid(theta + alpha), "m/s"),
                "with theta - alpha": (skid(theta - alpha), "m/s"),
            },
        ),
        Mistake(
            where="Equation (14)",
            claim="The ratio of the wheel speeds on an arc depends on the heading theta.",
            correction="It inherits the sign of (12); it is (R cos alpha + l cos gamma) / (R cos alpha - l cos gamma).",
            proof={
                "left over right wheel at R = 0.6 m, theta = 45 deg, as printed": (printed_14, "-"),
                "corrected": ((radius * math.cos(alpha) + b) / (radius * math.cos(alpha) - b), "-"),
                "by the wheel equations": (float(right[0] / right[1]), "-"),
            },
        ),
        Mistake(
            where="Equation (17)",
            claim="The second term is (di / 2) J1 phi'.",
            correction="It lacks the wheel radius r: (di r / 2) J1 phi'.",
            proof={
                "first entry of the second term, di = 1 % of i, motors at 20 rad/s, as printed": (
                    float(0.5 * 0.01 * ratio * j1[0] @ motors), "rad/s"),
                "what that di adds to x' in (8), the difference of two evaluations": (
                    float(0.5 * r * (1.01 * ratio - ratio) * j1[0] @ motors), "m/s"),
                "the printed term times r": (float(0.5 * r * 0.01 * ratio * j1[0] @ motors), "m/s"),
            },
        ),
        Mistake(
            where="Equation (17), figure 7",
            claim="An error of the gear ratio i makes the path wave.",
            correction="Not if it is the i of both sides: the path stays straight and only its length changes. "
            "The difference between left and right makes waves.",
            proof={
                "largest lateral deviation on 3 m with the same error on both sides (simulated)": (
                    float(1e3 * np.abs(common.recording.q_xyt[:, 1]).max()), "mm"),
                "with that ripple on the right alone": (float(1e3 * np.abs(phase.recording.q_xyt[:, 1]).max()), "mm"),
            },
        ),
        Mistake(
            where="Section 4",
            claim="Gear errors alone make a path that waves; that it drifts must come from slip and unequal radii.",
            correction="A ripple without mean drifts too, by A cos(p) / (B k) of the way: its phase p decides.",
            proof={
                "drift on 3 m for the phase 0, by the formula": (float(1e3 * formula(robot, phase, x)[-1]), "mm"),
                "simulated": (float(1e3 * phase.recording.q_xyt[-1, 1]), "mm"),
            },
        ),
    )  # fmt: skip


def formula(robot: Robot, run: RunResult, x: Array) -> Array:
    """`gear_path` for the gear error of the right wheel of a run [m]."""
    error = run.scenario.errors.gear_error["right"]
    return gear_path(
        x,
        constant=error.constant,
        amplitude=error.amplitude,
        wave_number=error.cycles / robot.wheels[1].radius,
        phase=math.radians(error.phase_deg),
        track=2 * half_track(robot),
    )


def centre_path(run: RunResult, poses: str) -> Array:
    """Path (n, 2) of the mass centre C for a pose column of the recording [m]."""
    q_xyt: Array = getattr(run.recording, poses)
    return q_xyt[:, :2] + rotate(q_xyt[:, 2], np.array([offset(run.scenario.robot), 0.0]))


def circle_radius(path: Array) -> float:
    """Radius of the circle closest to points (n, 2), by linear least squares [m]; 0 for a point."""
    centred = path - path.mean(axis=0)
    matrix = np.column_stack([2 * centred, np.ones(len(path))])
    (a, b, c), *_ = np.linalg.lstsq(matrix, np.sum(centred**2, axis=1), rcond=None)
    return math.sqrt(max(0.0, c + a**2 + b**2))


def _wave(robot: Robot, run: RunResult, x: Array, y: Array) -> float:
    """Height of the gear's wave on a path y(x), apart from a parabola [mm]."""
    phase = run.scenario.errors.gear_error["right"].cycles / robot.wheels[1].radius * x
    matrix = np.column_stack([np.ones_like(x), x, x**2, np.sin(phase), np.cos(phase)])
    *_, sine, cosine = np.linalg.lstsq(matrix, y, rcond=None)[0]
    return float(2e3 * np.hypot(sine, cosine))


PAPER = Paper(
    name="differential_drive",
    title="Two geared tyres and a castor",
    citation="Xu S., Wu H., Yang X. (Fuzhou University): A study on kinematics of two driving wheel robot.",
    introduction=(
        "The paper prints no dimensions; differential_cart/README.md tells those of the cart here. Its mass centre C "
        "lies l sin(gamma) ahead of the axle, with gamma = 20 deg.",
        "Gear errors are relative errors of the ratio of the right gear: a constant part, and a wave over the motor's "
        "angle. On level ground the motors turn as commanded, and they carry the encoders: the odometry sees nothing.",
    ),
    scenarios=scenarios,
    evaluate=evaluate,
)
