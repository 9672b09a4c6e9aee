"""Adds robots to a MultibodyPlant."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import DiagramBuilder

from rollerbench.description import Robot, load_robot
from rollerbench.errors import SimulationError
from rollerbench.plant.robot_model import RobotModel, standing_height
from rollerbench.plant.servos import set_gains
from rollerbench.plant.window import RollerWindow, WindowedWheel
from rollerbench.sdf import names, robot_to_sdf
from rollerbench.sdf.servo import ServoGains, servo_gains
from rollerbench.sdf.window import DEFAULT_SIZE, Window, windows


def add_robot(
    plant: MultibodyPlant,
    robot: Robot | str | Path | Mapping[str, Any],
    *,
    gains: ServoGains | None = None,
    roller_model: Literal["full", "windowed"] = "full",
    builder: DiagramBuilder | None = None,
    window_size: int = DEFAULT_SIZE,
    visuals: bool = True,
) -> RobotModel:
    """Adds a robot to a plant that is not finalized, standing on z = 0, servo gains set.

    With `roller_model="windowed"` only the rollers near the ground are simulated, which is faster, the more so the more
    rollers the wheels have. Then call `follow_rollers(simulator)` before the simulation. The ground must touch the
    wheels at the bottom, as it does on planes and low bumps; beside walls, where wheels of two robots may touch, and on
    robots that tip, use "full".

    The plant may hold other models and robots; of two with the same name the second is renamed. An arm or a payload is
    welded onto the body as the parent: `plant.WeldFrames(model.body.body_frame(), base, model.X_BT)`, before the plant
    is finalized. The stiffness of the wheels' contacts and the servo gains come from the robot's own mass m, so with
    dm on top the wheels sink, and the servos lag, by 1 + dm / m times as much; `rollerbench.limits` does not know dm.
    For a heavy load, take the gains and limits of a second description of the robot, whose body has the mass and the
    centre of mass of both. (Where the load need not be a body of its own, add that description to the plant instead.)

    Args:
        plant: The plant.
        robot: Robot, name of a shipped one, or path to a robot.yaml.
        gains: Gains of the servos; by default those of `servo_gains(robot)`. A driven wheel that is missing in
            `drive_damping` has no servo: its torque comes from the plant's actuation port.
        roller_model: Which rollers are simulated.
        builder: The builder of the plant's diagram; needed for windowed rollers, for the system that remembers them.
        window_size: Number of simulated rollers a wheel, from 2; wheels with as many or fewer are simulated in full.
        visuals: Whether the robot shall be seen; a step is a little faster without.

    Raises:
        SimulationError: windowed rollers without a builder, or in a plant with continuous time.
    """
    robot = load_robot(robot)
    if roller_model not in ("full", "windowed"):
        raise SimulationError(f"add_robot: roller_model = {roller_model!r}: accepted: 'full', 'windowed'")
    windows = _windows(robot, plant, builder, window_size) if roller_model == "windowed" and robot.wheels else {}
    parser = Parser(plant)
    parser.SetAutoRenaming(True)
    (instance,) = parser.AddModelsFromString(robot_to_sdf(robot, windows, visuals=visuals), "sdf")
    body = plant.GetBodyByName(names.BODY, instance)
    roller_window = None
    if windows and builder is not None:
        wheels = [_windowed_wheel(plant, instance, window) for window in windows.values()]
        roller_window = builder.AddSystem(RollerWindow(plant, wheels, robot.name))
        roller_window.set_name(f"{plant.GetModelInstanceName(instance)}_rollers")
    model = RobotModel(robot=robot, plant=plant, model_instance=instance, body=body, roller_window=roller_window)
    if robot.legs:
        model.start_in(robot.standing[0].name)
    else:
        plant.SetDefaultFloatingBaseBodyPose(body, RigidTransform([0.0, 0.0, standing_height(robot)]))
    set_gains(plant, instance, robot, gains or servo_gains(robot))
    return model


def _windows(
    robot: Robot, plant: MultibodyPlant, builder: DiagramBuilder | None, window_size: int
) -> dict[str, Window]:
    if builder is None:
        raise SimulationError(
            "add_robot: windowed rollers need a system that remembers the others; accepted: builder=, the "
            "DiagramBuilder of the plant, or roller_model='full'"
        )
    if plant.time_step() <= 0:
        raise SimulationError(
            "add_robot: windowed rollers are for discrete plants; accepted: a positive time step, or "
            "roller_model='full'"
        )
    if not isinstance(window_size, int) or window_size < 2:
        raise SimulationError(f"add_robot: window_size = {window_size}: accepted: a whole number, 2 or more")
    return windows(robot, window_size)


def _windowed_wheel(plant: MultibodyPlant, instance: ModelInstanceIndex, window: Window) -> WindowedWheel:
    name = window.wheel.name
    slots = [plant.GetJointByName(names.roller_joint(name, slot), instance) for slot in range(window.size)]
    return WindowedWheel(
        window=window,
        body=plant.GetBodyByName(names.BODY, instance),
        drive=plant.GetJointByName(names.drive_joint(name), instance),
        slots=slots,
    )
