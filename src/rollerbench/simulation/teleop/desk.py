"""Who drives, and what was last asked for: the desk at which pages and the loop of the simulation meet."""

import threading
from dataclasses import dataclass, field
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

Action = Literal["reset", "top", "follow", "iso"]


class Message(BaseModel):
    """What a page sends, 20 times a second while it drives: a command, and that it is still there.

    Attributes:
        touch: Counts what its user did; a page whose count grows takes over.
        lapses: How often pages that drove had fallen silent, as far as the page was told.
        mode: Whether the "twist" or the "wheels" count.
        twist: vx, vy, wz [m/s, m/s, rad/s].
        wheels: Speeds of driven wheels by name [rad/s]; 0 for those left out.
        steering: Angles of steered wheels from heading_deg by name [deg]; as they are for those left out.
        posture: Of a robot on legs: name of its posture.
        motion: Of a robot on legs: whether it walks or drives on the feet's wheels.
        gait: Of a robot on legs: name of its gait.
        change: Of a robot on legs: how it gets to another posture.
        body: Of a robot on legs: height, roll and pitch of the body from where its posture has it [mm, deg, deg].
        action: What to do once.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    touch: int
    lapses: int = 0
    mode: Literal["twist", "wheels"] = "twist"
    twist: tuple[FiniteFloat, FiniteFloat, FiniteFloat] = (0.0, 0.0, 0.0)
    wheels: dict[str, FiniteFloat] = Field(default_factory=dict)
    steering: dict[str, FiniteFloat] = Field(default_factory=dict)
    posture: str | None = None
    motion: Literal["walk", "drive"] = "walk"
    gait: str = "tripod"
    change: Literal["stepping", "rolling"] = "stepping"
    body: tuple[FiniteFloat, FiniteFloat, FiniteFloat] = (0.0, 0.0, 0.0)
    action: Action | None = None

    @property
    def moves(self) -> bool:
        """Whether it asks for any motion over the ground."""
        return any(self.twist if self.mode == "twist" else self.wheels.values())


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """What counts in a period of control.

    Attributes:
        message: The last command of the page that drives; None if there is none.
        driver: Number of that page, None if nobody drives.
        age: How old the last command is [s], infinite if there never was one.
        late: Whether the last page that drove fell silent, and nobody drives since.
        lapses: How often that happened.
        actions: What to do once.
    """

    message: Message | None
    driver: int | None
    age: float
    late: bool
    lapses: int
    actions: tuple[Action, ...]


@dataclass
class Desk:
    """Takes messages in one thread, and gives orders in another.

    A page whose command became too old no longer drives. Its user must do something anew, after the page was told:
    neither a page that goes on by itself nor commands that were held back on the way move the robot again. A robot on
    legs ends a change of posture that is under way before it rests.

    Attributes:
        timeout: Age from which on a command no longer counts [s].
    """

    timeout: float
    _lock: threading.Lock = field(default_factory=threading.Lock, repr=False)
    _touches: dict[int, int] = field(default_factory=dict)
    _driver: int | None = None
    _last: Message | None = None
    _heard: float = float("-inf")
    _actions: list[Action] = field(default_factory=list)
    _late: bool = False
    _lapses: int = 0

    def receive(self, client: int, message: Message, now: float) -> None:
        """Takes a message of a page that arrived at a time [s]; only that of the page that drives commands."""
        with self._lock:
            self._check(now)
            if message.action is not None:
                self._actions.append(message.action)
            if message.touch > self._touches.get(client, 0):
                self._touches[client] = message.touch
                if message.lapses == self._lapses:
                    self._driver, self._late = client, False
            if client == self._driver:
                self._last, self._heard = message, now

    def leave(self, client: int) -> None:
        """A page went away: if it drove, nobody does."""
        with self._lock:
            self._touches.pop(client, None)
            if client == self._driver:
                self._driver = self._last = None

    def order(self, now: float) -> Order:
        """What counts at a time [s]."""
        with self._lock:
            actions, self._actions = tuple(self._actions), []
            self._check(now)
            return Order(
                message=self._last,
                driver=self._driver,
                age=now - self._heard,
                late=self._late,
                lapses=self._lapses,
                actions=actions,
            )

    def _check(self, now: float) -> None:
        if self._driver is not None and now - self._heard > self.timeout:
            self._driver = self._last = None
            self._late, self._lapses = True, self._lapses + 1
