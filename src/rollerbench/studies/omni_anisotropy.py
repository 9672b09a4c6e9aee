"""Leng and Cao (2007): speed, acceleration and efforts of four omni wheels by direction."""

from rollerbench.description import OmniWheel, Robot, load_robot
from rollerbench.description.mass import axle_inertia, roller_inertia

WEIGHT, WHEEL_INERTIA, ROLLER_INERTIA = 196.0, 3.669e-3, 5.235e-7
"""Weight [N], and rotational inertias of wheel and roller [kg m2], as printed."""


def paper_robot(delta_deg: float) -> Robot:
    """The paper's robot: omni_platform with the printed inertias and adhesion, and the wheels in other places.

    Args:
        delta_deg: Angle between the azimuths of wheels 1 and 4 [deg].
    """
    robot = load_robot("omni_platform")
    azimuths = (0.5 * delta_deg, 180 - 0.5 * delta_deg, 180 + 0.5 * delta_deg, 360 - 0.5 * delta_deg)
    template = _with_inertias(robot.wheels[0])
    wheels = tuple(
        # Far enough from Bo for wheels 30 deg apart; translations do not depend on it.
        template.model_copy(
            update={"name": wheel.name, "azimuth_deg": azimuth, "distance": 0.28 if delta_deg >= 60 else 0.4}
        )
        for wheel, azimuth in zip(robot.wheels, azimuths, strict=True)
    )
    body = robot.body.model_copy(update={"mass": WEIGHT / 9.8 - 4 * template.mass})
    return Robot.model_validate(robot.model_copy(update={"wheels": wheels, "body": body}))


def _with_inertias(wheel: object) -> OmniWheel:
    """The wheel with the printed inertias, adhesion 1 and no limit of effort."""
    assert isinstance(wheel, OmniWheel)
    roller = roller_inertia(wheel)
    mass = ROLLER_INERTIA * roller.mass / roller.moment[0, 0]
    light = wheel.model_copy(
        update={"rollers": wheel.rollers.model_copy(update={"mass": float(mass)}), "friction": 1.0, "max_effort": None}
    )
    heavy = light.model_copy(update={"mass": light.mass + 1.0})
    more = (WHEEL_INERTIA - axle_inertia(light)) / (axle_inertia(heavy) - axle_inertia(light))
    return light.model_copy(update={"mass": light.mass + more})
