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
