"""Names of links and joints in a robot's model."""

BODY = "body"


def hub(wheel: str) -> str:
    """Link that turns about the axle."""
    return f"{wheel}_hub"


def fork(wheel: str) -> str:
    """Link between the body and the hub of a castor or steered wheel."""
    return f"{wheel}_fork"


def roller(wheel: str, index: int) -> str:
    """Link of one roller."""
    return f"{wheel}_roller_{index:02d}"


def drive_joint(wheel: str) -> str:
    """Joint about the axle."""
    return f"{wheel}_drive"


def swivel_joint(wheel: str) -> str:
    """Joint about the vertical axis of a castor or steered wheel."""
    return f"{wheel}_swivel"


def roller_joint(wheel: str, index: int) -> str:
    """Joint about a roller's axis."""
    return f"{wheel}_roller_{index:02d}_axis"


def leg_link(leg: str, number: int) -> str:
    """Link that turns with a leg's joint, numbered from 1 at the hip."""
    return f"{leg}_link_{number}"


def leg_joint(leg: str, number: int) -> str:
    """Joint of a leg, numbered from 1 at the hip."""
    return f"{leg}_joint_{number}"


def leg_joints(leg: str, count: int) -> list[str]:
    """All joints of a leg, from the hip on."""
    return [leg_joint(leg, number) for number in range(1, count + 1)]


def foot(leg: str) -> str:
    """Wheel at a leg's foot; its joint is `drive_joint(leg)`."""
    return f"{leg}_wheel"
