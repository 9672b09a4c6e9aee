"""Reference motions, and the feedback that keeps a base on them, as Drake Systems."""

import math

import numpy as np
from numpy.typing import ArrayLike
from pydrake.symbolic import Expression, Variable, cos, sin
from pydrake.systems.framework import Diagram, DiagramBuilder, System
from pydrake.systems.primitives import Demultiplexer, Multiplexer, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial, Trajectory

from rollerbench.errors import KinematicsError
from rollerbench.kinematics import odometry
from rollerbench.kinematics.given import AnyRobot, kinematics_of, planar_pose
from rollerbench.kinematics.profile import Profile, reference_poses
from rollerbench.kinematics.tracking import DEFAULT_GAINS, TrackingGains, tracking_law
from rollerbench.systems.symbolic_block import symbolic_block

SAMPLE_TIME = 0.01
"""Largest spacing of the samples between which reference poses are cubics [s]."""


class ReferenceSource(Diagram):
    """Where a robot should be over time, and how it should move there.

    Output ports:
        q_xyt (3): pose of B in W; the yaw counts full turns [m, m, rad].
        v_xyw_B (3): twist in B [m/s, m/s, rad/s].

    Before its start and after its end both keep their values, so let a reference start and end at rest.
    """

    def __init__(self, reference: Profile | Trajectory, start: ArrayLike = (0.0, 0.0, 0.0)) -> None:
        """Builds the diagram.

        Args:
            reference: A body twist over time, such as `rollerbench.paths` make them; or a Drake trajectory of poses
                (3 rows: x, y, yaw [m, m, rad]) that can be differentiated.
            start: Pose (3,) at the start of a body twist [m, m, rad].

        Raises:
            KinematicsError: the reference is neither of these or has not 3 components, or start is malformed.
        """
        super().__init__()
        if not isinstance(reference, Profile | Trajectory):
            raise KinematicsError(
                f"reference is a {type(reference).__name__}: accepted: a twist over time (Profile, such as that of "
                "rollerbench.paths.time_optimal), or a Drake Trajectory of poses"
            )
        size = reference.values.shape[1] if isinstance(reference, Profile) else reference.rows() * reference.cols()
        if size != 3:
            raise KinematicsError(
                f"reference has {size} components: accepted: 3 (a twist over time, or poses x, y, yaw)"
            )
        builder = DiagramBuilder()
        if isinstance(reference, Profile):
            source = builder.AddNamedSystem("trajectory", _twist_source(reference, start))
            values = source.get_output_port()
        else:
            source = TrajectorySource(reference, output_derivative_order=1, zero_derivatives_beyond_limits=True)
            builder.AddNamedSystem("trajectory", source)
            turned = builder.AddNamedSystem("into_the_body", _into_the_body())
            builder.Connect(source.get_output_port(), turned.get_input_port())
            values = turned.get_output_port()
        parts = builder.AddNamedSystem("parts", Demultiplexer([3, 3]))
        builder.Connect(values, parts.get_input_port())
        builder.ExportOutput(parts.get_output_port(0), "q_xyt")
        builder.ExportOutput(parts.get_output_port(1), "v_xyw_B")
        builder.BuildInto(self)


class PoseTracker(Diagram):
    """Twist that brings a base to a moving reference: feed-forward, and feedback by what its tyres allow.

    Bases without fixed tyres are driven straight to the reference; bases with tyres on an axle, for which there is no
    sideways, by a nonlinear law that is proven for them (`rollerbench.kinematics.tracking` has both, and sources).

    Input ports:
        q_xyt (3): pose of B in W, measured or estimated [m, m, rad].
        reference_q_xyt (3): where B should be [m, m, rad].
        reference_v_xyw_B (3): twist of the reference in its own axes [m/s, m/s, rad/s].
    Output ports:
        v_xyw_B (3): twist to command [m/s, m/s, rad/s]; limit it with a `TwistLimiter`.
    """

    def __init__(self, robot: AnyRobot, gains: TrackingGains = DEFAULT_GAINS) -> None:
        """Builds the diagram.

        Args:
            robot: The robot, or its kinematics, with twists of Bo.
            gains: Gains.

        Raises:
            KinematicsError: the robot's tyres allow no motion, or the kinematics' twists are not those of Bo.
        """
        super().__init__()
        law = tracking_law(kinematics_of(robot), gains)
        names = ("q_xyt", "reference_q_xyt", "reference_v_xyw_B")
        variables = [[Variable(f"{name}_{index}") for index in range(3)] for name in names]
        with np.errstate(invalid="ignore"):  # numpy takes flags that Expressions raise for errors of its own
            twist = law(*(np.array([Expression(each) for each in vector]) for vector in variables))
        builder = DiagramBuilder()
        inputs = builder.AddNamedSystem("inputs", Multiplexer([3, 3, 3]))
        system = symbolic_block(input=[each for vector in variables for each in vector], output=list(twist))
        builder.AddNamedSystem("law", system)
        builder.Connect(inputs.get_output_port(), system.get_input_port())
        for index, name in enumerate(names):
            builder.ExportInput(inputs.get_input_port(index), name)
        builder.ExportOutput(system.get_output_port(), "v_xyw_B")
        builder.BuildInto(self)


def _twist_source(twist: Profile, start: ArrayLike) -> TrajectorySource:
    """[q_xyt; v_xyw_B] of a twist over time."""
    first = planar_pose("start", start)
    pieces = max(1, math.ceil(np.ptp(twist.breaks) / SAMPLE_TIME))
    even = np.linspace(twist.breaks[0], twist.breaks[-1], pieces + 1)
    # Close to a break no even sample is needed; nearly equal times make no pieces.
    apart = np.abs(even[:, np.newaxis] - twist.breaks).min(axis=1) > 1e-3 * SAMPLE_TIME
    times = np.sort(np.concatenate([twist.breaks, even[apart]]))
    poses, twists = reference_poses(twist, times, start=first), twist(times)
    rates = np.column_stack([odometry.rotate(poses[:, 2], twists[:, :2]), twists[:, 2]])
    trajectory = PiecewisePolynomial.CubicHermite(
        times, np.column_stack([poses, twists]).T, np.column_stack([rates, twist.rate(times)]).T
    )
    return TrajectorySource(trajectory, zero_derivatives_beyond_limits=True)


def _into_the_body() -> System:
    """From [q_xyt; its rates in W] to [q_xyt; v_xyw_B]."""
    q = [Variable(name) for name in ("x", "y", "yaw")]
    vx, vy, w = (Variable(name) for name in ("vx", "vy", "w"))
    c, s = cos(q[2]), sin(q[2])
    return symbolic_block(
        input=[*q, vx, vy, w],
        output=[*map(Expression, q), c * vx + s * vy, c * vy - s * vx, Expression(w)],
    )
