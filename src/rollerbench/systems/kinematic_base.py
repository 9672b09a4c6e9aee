"""The ideal base as a Drake System: what the equations alone would do."""

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.symbolic import Expression, Variable, cos, sin
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from pydrake.systems.primitives import MatrixGain, SymbolicVectorSystem

from rollerbench.description import FixedWheel
from rollerbench.errors import KinematicsError
from rollerbench.kinematics.given import AnyRobot, held_kinematics, kinematics_of, planar_pose
from rollerbench.systems.kinematics import se2_integrator


class KinematicBase(Diagram):
    """A base that moves as its equations say, without mass or slip: the model for planning, estimation and control.

    With the matrix M from the input u to the twist, and the pose [x, y, yaw],

        v_xyw_B = M u,  [x', y', yaw'] = [cos(yaw) vx - sin(yaw) vy, sin(yaw) vx + cos(yaw) vy, wz]    continuous
        q_xyt_next = q_xyt * exp(v_xyw_B time_step)                                                    discrete

    Commanded by wheel speeds, M is the least squares of `WheelKinematics.forward`: wheels and tyres that contradict
    each other share the difference, where those of a real base slip. Whoever plans with wheel speeds rules such out by
    `WheelKinematics.residual` = 0, where no tyre skids. Steered wheels stay at the angles of the WheelKinematics.

    Commanded by a twist, M projects it on the twists at which no fixed tyre skids (`WheelKinematics.project`), and is
    the identity for robots without fixed tyres. Steered wheels are thought to follow at once, as castors do.

    The three numbers of the pose are all its state, so Drake's trajectory optimisation, linearisation and LQR take it.
    Converted by ToAutoDiffXd() or ToSymbolic() it is a plain Diagram_[T]: the named ports stay, `set_pose` does not.

    Input ports:
        wheel_speeds (n_driven): in the order of robot.yaml [rad/s]; if command is "wheel_speeds".
        v_xyw_B (3): body twist [m/s, m/s, rad/s]; if command is "v_xyw_B".
    Output ports:
        q_xyt (3): pose of B, or of the reference point of the kinematics, in W; the yaw counts full turns [m, m, rad].
        v_xyw_B (3): body twist M u [m/s, m/s, rad/s].
    """

    _INTEGRATOR = "integrator"

    def __init__(
        self,
        robot: AnyRobot,
        *,
        command: Literal["wheel_speeds", "v_xyw_B"] = "wheel_speeds",
        time_step: float | None = None,
    ) -> None:
        """Builds the diagram; the pose starts at the origin (see `set_pose`).

        Args:
            robot: The robot, or its kinematics; for wheel speeds of a robot with steered wheels its kinematics.
            command: What the input is.
            time_step: Period of the updates [s]; None makes the pose a continuous state.

        Raises:
            KinematicsError: command or time_step is not one of these, or wheel speeds do not determine the twist.
        """
        super().__init__()
        if time_step is not None and not (np.isfinite(time_step) and time_step > 0):
            raise KinematicsError(f"time_step = {time_step}: accepted: a positive number of seconds, or None")
        builder = DiagramBuilder()
        twist = builder.AddNamedSystem("twist", MatrixGain(_twist_matrix(robot, command)))
        integrator = _rate_integrator() if time_step is None else se2_integrator(time_step)
        pose = builder.AddNamedSystem(self._INTEGRATOR, integrator)
        builder.Connect(twist.get_output_port(), pose.get_input_port())
        builder.ExportInput(twist.get_input_port(), command)
        builder.ExportOutput(pose.get_output_port(), "q_xyt")
        builder.ExportOutput(twist.get_output_port(), "v_xyw_B")
        builder.BuildInto(self)

    def set_pose(self, context: Context, q_xyt: ArrayLike) -> None:
        """Sets the pose (3,) in a context of this system.

        Raises:
            KinematicsError: q_xyt is not finite or not of shape (3,).
        """
        pose = planar_pose("q_xyt", q_xyt)
        mine = self.GetMutableSubsystemContext(self.GetSubsystemByName(self._INTEGRATOR), context)
        if mine.has_only_continuous_state():
            mine.SetContinuousState(pose)
        else:
            mine.SetDiscreteState(pose)


def _twist_matrix(robot: AnyRobot, command: str) -> NDArray[np.float64]:
    """M (3, n_inputs) of `KinematicBase`."""
    if command == "v_xyw_B":
        kinematics = kinematics_of(robot)
        tyres = [i for i, wheel in enumerate(kinematics.robot.wheels) if isinstance(wheel, FixedWheel)]
        return kinematics.project(np.eye(3), tyres).T
    if command != "wheel_speeds":
        raise KinematicsError(f"command = {command!r}: accepted: 'wheel_speeds', 'v_xyw_B'")
    return held_kinematics(robot).forward_matrix


def _rate_integrator() -> SymbolicVectorSystem:
    pose = [Variable(name) for name in ("x", "y", "yaw")]
    yaw = pose[2]
    vx, vy, wz = twist = [Variable(name) for name in ("vx", "vy", "wz")]
    return SymbolicVectorSystem(
        state=pose,
        input=twist,
        dynamics=[cos(yaw) * vx - sin(yaw) * vy, sin(yaw) * vx + cos(yaw) * vy, Expression(wz)],
        output=[Expression(variable) for variable in pose],
    )
