"""The mistakes of Leng and Cao (2007), each with numbers that decide."""

import numpy as np

from rollerbench.description import Robot
from rollerbench.kinematics import WheelKinematics, limits
from rollerbench.studies import leng_cao
from rollerbench.studies.leng_cao import PRINTED
from rollerbench.studies.paper import Mistake

SIXTY = np.pi / 3


def mistakes(robot: Robot) -> tuple[Mistake, ...]:
    """The mistakes, proven with the robot whose wheels are 60 deg apart."""
    return (*_kinematics(robot), *_dynamics(robot), *_efforts())


def _kinematics(robot: Robot) -> tuple[Mistake, ...]:
    beta, azimuth = np.radians(80.0), np.radians(30.0)
    by_9 = -np.array([-np.sin(azimuth), np.cos(azimuth)]) @ [np.cos(beta), np.sin(beta)]
    azimuths = np.array([0.5 * SIXTY, np.pi - 0.5 * SIXTY, np.pi + 0.5 * SIXTY, -0.5 * SIXTY])
    pace = np.abs(np.sin(beta - azimuths))[leng_cao.candidates(float(beta), SIXTY)]
    fastest = WheelKinematics(robot).inverse([np.cos(beta), np.sin(beta), 0.0]) * PRINTED.wheel_radius
    return (
        Mistake(
            where="Equation (10)",
            claim="R times the wheel speed is the speed of the wheel's place along its rim.",
            correction="It is minus that, by (7) to (9), from which (10) is to follow; sizes are not affected.",
            proof={
                "R theta' of wheel 1 at 80 deg and 1 m/s by (9)": (float(by_9), "m/s"),
                "by (10)": (float(np.sin(beta - azimuth)), "m/s"),
            },
        ),
        Mistake(
            where="Equation (11)",
            claim="The wheel that meets the condition is the one that limits.",
            correction="The condition is necessary, not sufficient: that with the largest |sin(beta - gamma)| limits.",
            proof={
                "wheels that meet it at 80 deg, wheels 60 deg apart": (float(len(pace)), "-"),
                "speed that the slowest of them would allow": (float(1 / pace.min()), "m/s"),
                "speed that the fastest of them allows": (float(1 / pace.max()), "m/s"),
                "largest wheel speed at the former": (float(np.abs(fastest).max() / pace.min()), "m/s"),
                "largest wheel speed at the latter": (float(np.abs(fastest).max() / pace.max()), "m/s"),
            },
        ),
    )


def _dynamics(robot: Robot) -> tuple[Mistake, ...]:
    force, wheel_speed = 40.0, 1.0 / PRINTED.wheel_radius
    right_angle = 0.5 * np.pi
    options = {"roll_resistance": PRINTED.roll_resistance, "loads": [PRINTED.weight / 4] * 4}
    truth = float(limits.max_acceleration(robot, right_angle, adhesion="independent", **options))  # type: ignore[arg-type]
    printed = float(leng_cao.max_acceleration(right_angle))
    ahead = [float(limits.max_acceleration(robot, 0.0, adhesion=kind, **options)) for kind in ("independent", "circle")]  # type: ignore[arg-type]
    second, fourth = limits.wheel_loads(robot, 0.0, ahead[0])[[1, 3]] * PRINTED.adhesion
    return (
        Mistake(
            where="Equation (12)",
            claim="The ground's force on a driven wheel has the lever r, the roller's radius.",
            correction="Its lever is R, the wheel's radius, as (21), (24) and (25) have it.",
            proof={
                "power that a force of 40 N takes at 1 m/s": (force, "W"),
                "power of the torque with the lever r at that wheel speed": (
                    force * PRINTED.roller_radius * wheel_speed, "W"),
                "with the lever R": (force * PRINTED.wheel_radius * wheel_speed, "W"),
            },
        ),
        Mistake(
            where="Equation (18), rollers",
            claim="In the formula, which is printed for directions below delta/2, the drag of the rollers of wheels "
            "2 and 4 holds the robot back whatever the direction.",
            correction="Beyond 90 deg - delta/2 these rollers turn the other way, and so does their drag.",
            proof={
                "speed of roller 2 over that of the robot, at 90 deg": (float(np.cos(np.pi / 6 + right_angle)), "-"),
                "largest acceleration at 90 deg, as printed": (printed, "m/s²"),
                "with the sign of the rollers' speed": (
                    float(leng_cao.max_acceleration(right_angle, mended=True)), "m/s²"),
                "of the rigid body": (truth, "m/s²"),
                "printed value too low by": (100 * (1 - printed / truth), "%"),
            },
        ),
        Mistake(
            where="Equation (18), forces",
            claim="The driving force is twice that on wheel 2.",
            correction="It is that on wheels 2 and 4, as in (15); they are equal only as long as the loads are.",
            proof={
                "largest force on wheel 2 at 0 deg, doubled, with weight transfer": (float(2 * second), "N"),
                "largest forces on wheels 2 and 4": (float(second + fourth), "N"),
            },
        ),
        Mistake(
            where="Section 3.3",
            claim="A wheel slips when its driving force or its rollers' drag reaches the adhesion.",
            correction="Both act in one contact: their resultant must stay within the friction circle.",
            proof={
                "largest acceleration at 0 deg, each bounded apart": (ahead[0], "m/s²"),
                "resultant on a wheel then, over its adhesion": (
                    float(np.hypot(PRINTED.grip, leng_cao.roller_forces(0.0, ahead[0])[0]) / PRINTED.grip), "-"),
                "largest acceleration with the friction circle": (ahead[1], "m/s²"),
            },
        ),
    )  # fmt: skip


def _efforts() -> tuple[Mistake, ...]:
    beta, acceleration = np.radians(15.0), 1.0
    p = PRINTED
    first, second = leng_cao.roller_forces(beta, acceleration)
    double, inertial = 2 * p.alpha, p.mass * acceleration * np.cos(p.alpha + beta)
    residuals = []
    for pair in (1.0, 2.0):
        push = (pair * (second + first * np.cos(double)) + inertial) / np.sin(double)
        # Equation (16), wheels 1 and 3 together, less what it must be.
        residuals.append(float(push * np.sin(double) - 2 * second - 2 * first * np.cos(double) - inertial))
    printed, mended = (leng_cao.efforts(beta, acceleration, mended=mended)[0] for mended in (False, True))
    spin = p.wheel_inertia * acceleration * np.sin(p.alpha - beta) / p.wheel_radius
    lever = printed - p.drag - spin
    # In millimetres: forces stay, torques are a thousand times as large.
    in_millimetres = 1e3 * (spin + lever) + p.drag
    return (
        Mistake(
            where="Equations (22) and (23)",
            claim="Half of the drag of two rollers balances the push of two wheels.",
            correction="(15) and (16) hold two rollers of each pair: the drag counts twice.",
            proof={
                "what (16) lacks with (22) as printed, at 15 deg and 1 m/s²": (residuals[0], "N"),
                "with the drag of both rollers": (residuals[1], "N"),
            },
        ),
        Mistake(
            where="Equations (24) and (25)",
            claim="The drag F_f [N] is added to torques [N m].",
            correction="Its torque F_f R is to be added.",
            proof={
                "effort of wheel 1 at 15 deg and 1 m/s² as printed, in metres": (float(printed), "N m"),
                "the same, computed in millimetres": (float(1e-3 * in_millimetres), "N m"),
                "with both corrections": (float(mended), "N m"),
            },
        ),
    )
