"""Keeps the simulated rollers of wheels near the ground."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, RigidBody, RotationalInertia, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import BasicVector, Context, Diagram, DiscreteValues, EventStatus, LeafSystem, System

from rollerbench.description.inertia import RigidInertia
from rollerbench.description.mass import axle_inertia, roller_poses_H
from rollerbench.errors import SimulationError
from rollerbench.sdf.window import HYSTERESIS, Window

Array = NDArray[np.float64]

FARTHEST = 0.5 + HYSTERESIS
"""How far the bottom of a wheel may be from the middle of its window [pitches]."""

CHECK_STEPS = 10
"""Steps of the plant after which it is noticed that nothing follows the wheels."""


@dataclass(frozen=True, kw_only=True)
class WindowedWheel:
    """A wheel in a plant, of whose rollers only some are simulated.

    Attributes:
        window: The window.
        body: The chassis.
        drive: The joint about the axle.
        slots: The joints of the simulated rollers.
    """

    window: Window
    body: RigidBody
    drive: RevoluteJoint
    slots: Sequence[RevoluteJoint]


class RollerWindow(LeafSystem):
    """Follows the wheels of one robot with the rollers that are simulated, and remembers the others.

    When a wheel has turned on by a roller's pitch, the roller that is now farthest from the ground gives its link to
    the next one: the place of its joint on the hub and the hub's inertia, which are parameters of the plant, and the
    speed of the joint change. The wheel's angle counts on. Out of the window rollers spin freely, so that they keep
    their angular velocity along their axis u, w_R . u, but for the damping of their joints; the hub gets that momentum.

    This happens after each of the plant's steps, in the monitor of a simulator: `follow_rollers(simulator)`. A
    simulation without it stops with an error. Restored states are followed from the simulator's Initialize on.

    Output ports:
        rollers (1 + sum of 1 + 2 count over the windowed wheels): the system's state. The time up to which the wheels
            were followed [s]; then for each windowed wheel its first simulated roller (see `Window`), the w_R . u with
            which each roller left the window [rad/s], and the time when it did [s].

    Attributes:
        windows: The windows by wheel name.
        offsets: Where the part of each windowed wheel starts in the state, by wheel name.
    """

    windows: dict[str, Window]
    offsets: dict[str, int]

    def __init__(self, plant: MultibodyPlant, wheels: Sequence[WindowedWheel], robot: str) -> None:
        """Makes the system.

        Args:
            plant: The plant, finalized or not.
            wheels: The wheels, at least one.
            robot: Name of the robot, for messages.
        """
        super().__init__()
        self.windows = {wheel.window.wheel.name: wheel.window for wheel in wheels}
        self._plant, self._robot, self._wheels = plant, robot, tuple(wheels)
        ends = 1 + np.cumsum([0, *(1 + 2 * wheel.window.wheel.ring.count for wheel in wheels)])
        self.offsets = {name: int(end) for name, end in zip(self.windows, ends, strict=False)}
        state = np.zeros(ends[-1])
        for wheel, offset in zip(wheels, self.offsets.values(), strict=True):
            state[offset] = wheel.window.first_at(0.0)
        self.DeclareStateOutputPort("rollers", self.DeclareDiscreteState(state))
        self.DeclareInitializationDiscreteUpdateEvent(self._start)
        self._period = CHECK_STEPS * plant.time_step()
        self.DeclarePeriodicPublishEvent(self._period, 0.0, self._require_follower)
        self._starts = 0

    def follower(self) -> Callable[[Context], None]:
        """A function that follows the wheels in a root context, to call after each step."""
        plant, step = self._plant, self._plant.time_step()
        wheels = [_Follower(wheel, offset) for wheel, offset in zip(self._wheels, self.offsets.values(), strict=True)]
        starts, steps = -1, 0

        def follow(root: Context) -> None:
            # Called after every step: what happens seldom is behind the return.
            nonlocal starts, steps
            started, now = starts != self._starts, root.get_time()
            if not started and now != round(now / step) * step:
                return  # A step that another System's event made: the plant has nothing new.
            context = plant.GetMyMutableContextFromRoot(root)
            angle = plant.GetPositions(context).item
            behind = [w for w in wheels if abs(angle(w.position) * w.per_pitch + w.middle) > FARTHEST]
            steps += 1
            if not (behind or started or steps >= CHECK_STEPS // 2):
                return
            velocities = plant.GetVelocities(context)
            state = self.GetMyMutableContextFromRoot(root).get_mutable_discrete_state_vector()
            for wheel in wheels if started else behind:
                wheel.restore(context, state, everything=started)
                away = abs(angle(wheel.position) * wheel.per_pitch + wheel.middle)
                if away > FARTHEST:
                    if away > wheel.within and not started:
                        self._report_leap(wheel, now)
                    wheel.follow(context, state, now, angle(wheel.position), velocities)
            starts, steps = self._starts, 0
            state.SetAtIndex(0, now)

        return follow

    def roller_speeds(self, wheel: str, speeds: Array, state: Array, time: Array, motion: Array) -> Array:
        """Speeds (n, count) of all rollers of a windowed wheel about their axes, relative to the hub [rad/s].

        Args:
            wheel: Name of the wheel.
            speeds: Speeds (n, size) of the simulated rollers, by slot [rad/s].
            state: States (n, ...) of this system.
            time: Their times (n,) [s].
            motion: Wheel angles [rad], wheel speeds [rad/s] and yaw rates of the body [rad/s] (3, n).
        """
        window, offset = self.windows[wheel], self.offsets[wheel]
        count, rows = window.wheel.ring.count, np.arange(len(state))
        result = np.empty((len(state), count))
        for k in range(count):
            elapsed = time - state[:, offset + 1 + count + k]
            spin = window.remembered(state[:, offset + 1 + k], elapsed, motion[1])
            result[:, k] = spin - window.hub_spin(k, *motion)
        first = np.round(state[:, offset]).astype(int)
        for m in first + np.arange(window.size)[:, np.newaxis]:
            result[rows, m % count] = speeds[rows, m % window.size]
        return result

    def _start(self, context: Context, state: DiscreteValues) -> EventStatus:
        self._starts += 1
        state.get_mutable_vector(0).SetAtIndex(0, context.get_time())
        return EventStatus.Succeeded()

    def _require_follower(self, context: Context) -> EventStatus:
        # Before the plant's first step, which is at time 0, there is nothing to follow.
        now = context.get_time()
        if now > 0 and now - max(0.0, context.get_discrete_state_vector().GetAtIndex(0)) > 0.99 * self._period:
            raise SimulationError(
                f"{self._robot}: only the rollers near the ground are simulated, and nothing changes them as the "
                "wheels turn: call rollerbench.follow_rollers(simulator) before the simulation, or use "
                "roller_model full"
            )
        return EventStatus.Succeeded()

    def _report_leap(self, wheel: "_Follower", now: float) -> None:
        raise SimulationError(
            f"{self._robot}: at t = {now:.4g} s wheel {wheel.name} turned past its simulated rollers in one step; "
            "accepted: a smaller time step of the plant (a wheel may turn by a sixth of its roller pitch in a step), "
            "or roller_model full"
        )


class _Follower:
    """What follows one wheel in one simulation.

    With the plant's positions q, the bottom of the wheel is q per_pitch + middle pitches from the window's middle.
    """

    def __init__(self, wheel: WindowedWheel, offset: int) -> None:
        self._window, self._offset = wheel.window, offset
        description, ring = wheel.window.wheel, wheel.window.wheel.ring
        self.name, self.position = description.name, int(wheel.drive.position_start())
        self.per_pitch, self.middle, self.within = 1 / ring.pitch, 0.0, 0.5 * wheel.window.size
        self._count, self._first = ring.count, 0
        self._drive, self._wheel_speed = wheel.drive, int(wheel.drive.velocity_start())
        # A body on a test stand does not turn.
        floats = wheel.body.is_floating_base_body()
        self._yaw_rate = int(wheel.body.floating_velocities_start_in_v()) + 2 if floats else None
        self._hub: RigidBody = wheel.drive.child_body()
        self._slots, self._slot_speeds = wheel.slots, [int(joint.velocity_start()) for joint in wheel.slots]
        self._frames: list[FixedOffsetFrame] = [joint.frame_on_parent() for joint in wheel.slots]
        self._places = [RigidTransform(RotationMatrix(rotation), p) for rotation, p in roller_poses_H(description)]
        self._inertias = [_spatial(wheel.window.hub_inertia(first)) for first in range(ring.count)]
        self._share = math.cos(ring.roller_angle) * wheel.window.roller_inertia / axle_inertia(description)

    def restore(self, context: Context, state: BasicVector, *, everything: bool) -> None:
        """Puts the rollers where a state says; unless everything is to be set anew, if they are not there yet."""
        first = round(state.GetAtIndex(self._offset))
        if everything or first != self._first:
            self._set_first(first)
            self._place(context, range(first, first + self._window.size))

    def follow(self, context: Context, state: BasicVector, now: float, angle: float, velocities: Array) -> None:
        """Moves the window to the bottom; the state (see `RollerWindow`) is changed."""
        window, size, count = self._window, self._window.size, self._count
        before, first = self._first, window.first_at(angle)
        yaw_rate = 0.0 if self._yaw_rate is None else velocities.item(self._yaw_rate)
        motion = angle, velocities.item(self._wheel_speed), yaw_rate
        spins, times = self._offset + 1, self._offset + 1 + count
        for m in range(before, before + size):
            if not first <= m < first + size:
                speed = velocities.item(self._slot_speeds[m % size])
                state.SetAtIndex(spins + m % count, speed + window.hub_spin(m, *motion))
                state.SetAtIndex(times + m % count, now)
                if motion[1]:
                    # What its damping will pass on to the hub until it comes back, the hub gets at once.
                    absence = (count - size) / self.per_pitch / abs(motion[1])
                    lost = speed * -math.expm1(-window.decay_rate * absence)
                    self._drive.set_angular_rate(context, motion[1] + self._share * lost)
        entering = [m for m in range(first, first + size) if not before <= m < before + size]
        for m in entering:
            elapsed = now - state.GetAtIndex(times + m % count)
            spin = window.remembered(state.GetAtIndex(spins + m % count), elapsed, motion[1])
            self._slots[m % size].set_angular_rate(context, spin - window.hub_spin(m, *motion))
        self._set_first(first)
        self._place(context, entering)
        state.SetAtIndex(self._offset, first)

    def _set_first(self, first: int) -> None:
        self._first, self.middle = first, first + 0.5 * (self._window.size - 1)

    def _place(self, context: Context, rollers: Sequence[int]) -> None:
        for m in rollers:
            self._frames[m % self._window.size].SetPoseInParentFrame(context, self._places[m % self._count])
        self._hub.SetSpatialInertiaInBodyFrame(context, self._inertias[self._first % self._count])


def follow_rollers(simulator: Simulator) -> None:
    """Lets a simulator follow the wheels of all robots with windowed rollers in its diagram, after each step.

    To be called once for each Simulator. A monitor that the simulator has already is called too; one that is set later
    replaces this, and the simulation then stops with an error.

    Args:
        simulator: The simulator.
    """
    windows = list(_windows(simulator.get_system()))
    if not windows:
        return
    followers = [window.follower() for window in windows]
    before = simulator.get_monitor()

    def monitor(root: Context) -> EventStatus:
        for follow in followers:
            follow(root)
        return EventStatus.DidNothing() if before is None else before(root)

    simulator.set_monitor(monitor)


def _windows(system: System) -> Iterator[RollerWindow]:
    if isinstance(system, RollerWindow):
        yield system
    elif isinstance(system, Diagram):
        for part in system.GetSystems():
            yield from _windows(part)


def _spatial(inertia: RigidInertia) -> SpatialInertia:
    moment = inertia.moment
    central = RotationalInertia(*np.diag(moment), moment[0, 1], moment[0, 2], moment[1, 2])
    return SpatialInertia.MakeFromCentralInertia(inertia.mass, inertia.com, central)
