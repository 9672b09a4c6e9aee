"""The wheels' kinematics as Drake Systems.

Each is a Diagram of Drake's gains and of formulas that Drake evaluates (`symbolic_block`), behind named ports;
convertible to AutoDiffXd and Expression with ToAutoDiffXd() and ToSymbolic().
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake import symbolic
from pydrake.symbolic import Expression, Variable, atan2, cos, sin, sqrt
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, System
from pydrake.systems.primitives import MatrixGain, Multiplexer

from rollerbench.errors import KinematicsError
from rollerbench.kinematics import WheelKinematics
from rollerbench.kinematics.given import AnyRobot, held_kinematics, kinematics_of, planar_pose, positive_time
from rollerbench.kinematics.uncertainty import UPPER, OdometryNoise, StepTerms, checked_covariance, spread, step_terms
from rollerbench.systems.symbolic_block import symbolic_block


class InverseKinematics(Diagram):
    """Wheel speeds that move the body at a twist: wheel_speeds = J @ v_xyw_B.

    Input ports:
        v_xyw_B (3): body twist [m/s, m/s, rad/s].
    Output ports:
        wheel_speeds (n_driven): in the order of robot.yaml [rad/s].

    Twists at which a tyre would skid are not refused here (a System cannot): see `WheelKinematics.require_feasible`.
    Steered wheels are those of the angles of the WheelKinematics, 0 by default; `SteeringKinematics` turns them.
    """

    def __init__(self, robot: AnyRobot) -> None:
        super().__init__()
        _wrap_gain(self, kinematics_of(robot).drive_matrix, "v_xyw_B", "wheel_speeds")


class ForwardKinematics(Diagram):
    """Body twist of the wheel speeds, by least squares: `WheelKinematics.forward`.

    Input ports:
        wheel_speeds (n_driven): in the order of robot.yaml [rad/s].
    Output ports:
        v_xyw_B (3): body twist [m/s, m/s, rad/s].
    """

    def __init__(self, robot: AnyRobot) -> None:
        super().__init__()
        _wrap_gain(self, held_kinematics(robot).forward_matrix, "wheel_speeds", "v_xyw_B")


class Odometry(Diagram):
    """Pose from wheel speeds, advanced every time step by the exponential of SE(2) as `odometry.integrate` does.

    With the noise of its wheels it also tells how far the pose can be trusted, as `uncertainty.propagate` does.

    Input ports:
        wheel_speeds (n_driven): in the order of robot.yaml [rad/s].
    Output ports:
        q_xyt (3): pose of B in W; the yaw counts full turns [m, m, rad].
        covariance (9): of x, y, yaw in W, row by row [m, m, rad]^2; only if a noise was given.
    """

    _INTEGRATOR = "integrator"
    _COVARIANCE = "covariance"

    def __init__(self, robot: AnyRobot, time_step: float, *, noise: OdometryNoise | None = None) -> None:
        """Builds the diagram; the pose starts at the origin, without doubt (see `set_pose`).

        Args:
            robot: The robot, or its kinematics.
            time_step: Period of the updates [s].
            noise: Noise of the measured wheel speeds, for the covariance.

        Raises:
            KinematicsError: time_step is not positive, or the noise does not fit the robot.
        """
        super().__init__()
        positive_time("time_step", time_step)
        kinematics = held_kinematics(robot)
        builder = DiagramBuilder()
        twist = builder.AddNamedSystem("forward_kinematics", MatrixGain(kinematics.forward_matrix))
        pose = builder.AddNamedSystem(self._INTEGRATOR, se2_integrator(time_step))
        builder.Connect(twist.get_output_port(), pose.get_input_port())
        wheel_speeds = builder.ExportInput(twist.get_input_port(), "wheel_speeds")
        builder.ExportOutput(pose.get_output_port(), "q_xyt")
        if noise is not None:
            steps = builder.AddNamedSystem("step_covariance", _step_covariance(kinematics, noise, time_step))
            terms = builder.AddNamedSystem("step_terms", _step_terms(time_step))
            spreading = builder.AddNamedSystem(self._COVARIANCE, _se2_covariance(time_step))
            builder.ConnectInput(wheel_speeds, steps.get_input_port())
            _connect(builder, (pose, twist), terms)
            _connect(builder, (terms, steps), spreading)
            builder.ExportOutput(spreading.get_output_port(), "covariance")
        builder.BuildInto(self)

    def set_pose(self, context: Context, q_xyt: ArrayLike, covariance: ArrayLike | None = None) -> None:
        """Sets the pose (3,), and its covariance (3, 3) if there is one, in a context of this system.

        Raises:
            KinematicsError: q_xyt is not finite or not of shape (3,), or the covariance does not fit.
        """
        integrator = self.GetSubsystemByName(self._INTEGRATOR)
        self.GetMutableSubsystemContext(integrator, context).SetDiscreteState(planar_pose("q_xyt", q_xyt))
        if covariance is not None:
            if not self.HasSubsystemNamed(self._COVARIANCE):
                raise KinematicsError("covariance: this Odometry was made without a noise; accepted: None")
            spreading = self.GetMutableSubsystemContext(self.GetSubsystemByName(self._COVARIANCE), context)
            spreading.SetDiscreteState(checked_covariance(covariance)[UPPER])


class PlanarState(Diagram):
    """Planar pose and twist of a free body from its state in a MultibodyPlant.

    Input ports:
        state (13): [quaternion w x y z, p_WB, w_WB_W, v_WB_W], as plants order a floating body's.
    Output ports:
        q_xyt (3): pose of B in W, yaw in (-pi, pi] [m, m, rad].
        v_xyw_B (3): twist in B turned upright [m/s, m/s, rad/s].
    """

    def __init__(self) -> None:
        super().__init__()
        builder = DiagramBuilder()
        names = "w x y z px py pz wx wy wz vx vy vz"
        state = [Variable(name) for name in names.split()]
        w, x, y, z, px, py, _, _, _, wz, vx, vy, _ = state
        # First column of the rotation, without its height; the norm of an imperfect quaternion drops out.
        c, s = w * w + x * x - y * y - z * z, 2 * (x * y + w * z)
        norm = sqrt(c * c + s * s)
        outputs = {
            "q_xyt": [Expression(px), Expression(py), atan2(s, c)],
            "v_xyw_B": [(c * vx + s * vy) / norm, (c * vy - s * vx) / norm, Expression(wz)],
        }
        first = None
        for name, expressions in outputs.items():
            system = builder.AddNamedSystem(name, symbolic_block(input=state, output=expressions))
            if first is None:
                first = builder.ExportInput(system.get_input_port(), "state")
            else:
                builder.ConnectInput(first, system.get_input_port())
            builder.ExportOutput(system.get_output_port(), name)
        builder.BuildInto(self)


def _wrap_gain(diagram: Diagram, matrix: NDArray[np.float64], input_name: str, output_name: str) -> None:
    builder = DiagramBuilder()
    gain = builder.AddNamedSystem("gain", MatrixGain(matrix))
    builder.ExportInput(gain.get_input_port(), input_name)
    builder.ExportOutput(gain.get_output_port(), output_name)
    builder.BuildInto(diagram)


def se2_integrator(time_step: float) -> System:
    """From a twist (3) to the pose (3), its state, advanced every time step by the exponential of SE(2)."""
    x, y, yaw = pose = [Variable(name) for name in ("x", "y", "yaw")]
    vx, vy, wz = twist = [Variable(name) for name in ("vx", "vy", "wz")]
    # sin(half)/half without a branch: the tiny summand keeps it exact to the last bit, at half = 0 too.
    half = 0.5 * time_step * wz
    away = sqrt(half * half + 1e-24)
    chord = time_step * sin(away) / away
    heading = yaw + half
    return symbolic_block(
        state=pose,
        input=twist,
        dynamics=[
            x + chord * (cos(heading) * vx - sin(heading) * vy),
            y + chord * (sin(heading) * vx + cos(heading) * vy),
            yaw + time_step * wz,
        ],
        output=[Expression(variable) for variable in pose],
        time_period=time_step,
    )


def _step_covariance(kinematics: WheelKinematics, noise: OdometryNoise, time_step: float) -> Diagram:
    """From wheel speeds to the entries (6) of the covariance of a step; see `uncertainty.step_covariance`."""
    speeds = [Variable(f"speed_{index}") for index in range(len(kinematics.drive_matrix))]
    coefficients = zip(*noise.coefficients(kinematics), speeds, strict=True)
    # The tiny summand gives |speed| a derivative at rest.
    variances = [time_step * (slope * sqrt(speed * speed + 1e-24) + rest) for slope, rest, speed in coefficients]
    forward = kinematics.forward_matrix
    builder = DiagramBuilder()
    angles = builder.AddNamedSystem("angle_variances", symbolic_block(input=speeds, output=variances))
    gain = builder.AddNamedSystem("gain", MatrixGain(forward[UPPER[0]] * forward[UPPER[1]]))
    builder.Connect(angles.get_output_port(), gain.get_input_port())
    builder.ExportInput(angles.get_input_port(), "wheel_speeds")
    builder.ExportOutput(gain.get_output_port(), "step_covariance")
    return builder.Build()


def _step_terms(time_step: float) -> System:
    """From [pose; twist] to the `StepTerms`."""
    pose = [Variable(name) for name in ("x", "y", "yaw")]
    twist = [Variable(name) for name in ("vx", "vy", "wz")]
    terms = step_terms(pose[2], [time_step * rate for rate in twist], symbolic)
    return symbolic_block(input=[*pose, *twist], output=list(terms))


def _se2_covariance(time_step: float) -> System:
    """From [step terms; covariance of the step] to the covariance of the pose."""
    xx, xy, xt, yy, yt, tt = state = [Variable(name) for name in ("xx", "xy", "xt", "yy", "yt", "tt")]
    terms = [Variable(name) for name in StepTerms._fields]
    xx_q, xy_q, xt_q, yy_q, yt_q, tt_q = added = [Variable(f"{entry}_step") for entry in state]
    dynamics = spread((xx, xy, xt, yy, yt, tt), StepTerms(*terms), (xx_q, xy_q, xt_q, yy_q, yt_q, tt_q))
    return symbolic_block(
        state=state,
        input=[*terms, *added],
        dynamics=list(dynamics),
        output=[Expression(entry) for entry in (xx, xy, xt, xy, yy, yt, xt, yt, tt)],
        time_period=time_step,
    )


def _connect(builder: DiagramBuilder, sources: tuple[System, ...], target: System) -> None:
    """Joins the outputs of systems to the one input of another."""
    sizes = [source.get_output_port().size() for source in sources]
    joined = builder.AddNamedSystem(f"{target.get_name()}_inputs", Multiplexer(sizes))
    for index, source in enumerate(sources):
        builder.Connect(source.get_output_port(), joined.get_input_port(index))
    builder.Connect(joined.get_output_port(), target.get_input_port())
