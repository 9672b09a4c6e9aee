"""Robots for tests, as the content of a robot.yaml."""

from typing import Any

Data = dict[str, Any]

TYRE: Data = {"type": "fixed", "radius": 0.1, "width": 0.04, "mass": 1.0}
OMNI: Data = {
    "type": "omni",
    "radius": 0.06,
    "width": 0.05,
    "mass": 0.6,
    "rollers": {"count": 16, "radius": 0.008, "rows": 2},
}
MECANUM: Data = {
    "type": "mecanum",
    "radius": 0.05,
    "width": 0.05,
    "mass": 0.8,
    "roller_angle_deg": 45.0,
    "rollers": {"count": 12, "radius": 0.007},
}
BODY: Data = {"size": [0.4, 0.2, 0.08], "mass": 10.0, "center_of_mass": [0.0, 0.0, 0.03]}


def mecanum(half_base: float = 0.2, half_track: float = 0.2, count: int = 12, radius: float = 0.007) -> Data:
    """Four Mecanum wheels in the standard layout."""
    wheels = []
    for name, x, y, angle in (("fl", 1, 1, 45), ("fr", 1, -1, -45), ("rl", -1, 1, -45), ("rr", -1, -1, 45)):
        rollers = {"count": count, "radius": radius}
        place = [x * half_base, y * half_track]
        wheels.append({**MECANUM, "name": name, "position": place, "roller_angle_deg": angle, "rollers": rollers})
    return {"name": "test_mecanum", "body": BODY, "wheels": wheels}


def cart() -> Data:
    """Two driven tyres and a castor behind."""
    castor = {**TYRE, "type": "castor", "radius": 0.04, "width": 0.02, "mass": 0.3, "trail": 0.03}
    return {
        "name": "test_cart",
        "body": {**BODY, "center_of_mass": [-0.05, 0.0, 0.03]},
        "wheels": [
            {**TYRE, "name": "left", "position": [0.0, 0.2]},
            {**TYRE, "name": "right", "position": [0.0, -0.2]},
            {**castor, "name": "castor", "position": [-0.2, 0.0, -0.06]},
        ],
    }


def car() -> Data:
    """Two driven tyres behind, two steered ones in front that roll freely."""
    return {
        "name": "test_car",
        "body": {**BODY, "size": [0.6, 0.3, 0.1], "center_of_mass": [0.2, 0.0, 0.03]},
        "wheels": [
            {**TYRE, "name": "rear_left", "position": [0.0, 0.2]},
            {**TYRE, "name": "rear_right", "position": [0.0, -0.2]},
            {**TYRE, "type": "steered", "name": "front_left", "position": [0.45, 0.2], "driven": False},
            {**TYRE, "type": "steered", "name": "front_right", "position": [0.45, -0.2], "driven": False},
        ],
    }


def kiwi(distance: float = 0.2) -> Data:
    """Three omni wheels 120 deg apart, axles through the centre."""
    places = {"front": (1.0, 0.0, 90.0), "left": (-0.5, 0.75**0.5, 210.0), "right": (-0.5, -(0.75**0.5), 330.0)}
    return {
        "name": "test_kiwi",
        "body": {**BODY, "size": [0.2, 0.2, 0.08]},
        "wheels": [
            {**OMNI, "name": name, "position": [distance * x, distance * y], "heading_deg": heading}
            for name, (x, y, heading) in places.items()
        ],
    }


def swerve(half_base: float = 0.25, half_track: float = 0.2) -> Data:
    """Four driven, steered tyres."""
    corners = {"fl": (1, 1), "fr": (1, -1), "rl": (-1, 1), "rr": (-1, -1)}
    return {
        "name": "test_swerve",
        "body": BODY,
        "wheels": [
            {**TYRE, "type": "steered", "name": name, "position": [x * half_base, y * half_track]}
            for name, (x, y) in corners.items()
        ],
    }


def mixed() -> Data:
    """One wheel of every type, at unequal poses."""
    return {
        "name": "test_mixed",
        "body": {**BODY, "size": [0.5, 0.3, 0.08], "center_of_mass": [0.02, -0.01, 0.04], "inertia": [0.1, 0.3, 0.35]},
        "wheels": [
            {**MECANUM, "name": "m", "position": [0.4, 0.3, -0.05], "heading_deg": 10.0},
            {**OMNI, "name": "o", "position": [0.4, -0.3, -0.04], "heading_deg": 80.0, "driven": False},
            {**TYRE, "name": "f", "position": [-0.1, 0.3]},
            {**TYRE, "type": "steered", "name": "s", "position": [-0.3, -0.3], "heading_deg": 20.0},
            {
                **TYRE,
                **{"type": "castor", "name": "c", "position": [-0.5, 0.1, -0.05]},
                **{"radius": 0.05, "width": 0.02, "trail": 0.03},
            },
        ],
    }


def quadruped() -> Data:
    """Four legs of three joints, as most walkers have, on feet that do not roll."""
    links = [
        {"a": 0.05, "alpha_deg": 90, "min_deg": -60, "max_deg": 60, "mass": 0.4, "rotor_inertia": 0.005},
        {"a": 0.2, "min_deg": -90, "max_deg": 90, "mass": 0.5, "max_effort": 40},
        {"a": 0.25, "theta_offset_deg": -100, "min_deg": -60, "max_deg": 90, "mass": 0.3, "max_speed": 8},
    ]
    corners = {"fl": (1, 1, 45.0), "fr": (1, -1, -45.0), "rl": (-1, 1, 135.0), "rr": (-1, -1, -135.0)}
    foot = {"radius": 0.03, "width": 0.03, "mass": 0.1, "driven": False}
    return {
        "name": "test_quadruped",
        "body": {**BODY, "center_of_mass": [0.01, 0.0, 0.0]},
        "legs": [
            {
                **{"name": name, "hip": [0.2 * x, 0.1 * y, 0.02], "mounting_deg": mounting, "links": links},
                **{"wheel": {**foot, "friction": 0.6 if name == "fl" else 0.9}},
                **{"postures": {"stand": [0, 30, 0], "low": [10 * x * y, 40, 5]}},
            }
            for name, (x, y, mounting) in corners.items()
        ],
    }


def octopod() -> Data:
    """Eight of the hexapod's legs, in the posture of an insect."""
    links = [
        {"alpha_deg": 90, "mass": 0.5},
        {"a": 0.2, "mass": 0.7},
        {"alpha_deg": -90, "theta_offset_deg": 90, "mass": 0.3},
        {"d": -0.22, "a": 0.09, "alpha_deg": -90, "mass": 0.6},
    ]
    wheel = {"radius": 0.06, "width": 0.04, "mass": 0.4, "max_effort": 20}
    return {
        "name": "test_octopod",
        "body": {"size": [1.2, 0.4, 0.1], "mass": 20.0},
        "postures": [{"name": "insect", "hold": "tibia"}],
        "legs": [
            {
                **{"name": f"{side}_{number}", "hip": [0.45 - 0.3 * number, 0.2 * y, 0.0], "mounting_deg": 90.0 * y},
                **{"links": links, "wheel": wheel, "postures": {"insect": [0, 20, -110, 90 * y]}},
            }
            for side, y in (("left", 1), ("right", -1))
            for number in range(4)
        ],
    }


def mixed_legs() -> Data:
    """Six legs: those in the middle have three joints, and feet that do not roll."""
    data = octopod()
    outer = data["legs"][0]
    middle = {
        "links": [
            {"alpha_deg": 90, "mass": 0.5},
            {"a": 0.2, "mass": 0.7},
            {"a": 0.22, "theta_offset_deg": -90, "mass": 0.6},
        ],
        "wheel": {**outer["wheel"], "driven": False},
    }
    legs = []
    for side, y in (("left", 1), ("right", -1)):
        for place, x in (("front", 0.33), ("middle", 0.0), ("rear", -0.33)):
            leg = {**outer, "name": f"{side}_{place}", "hip": [x, 0.2 * y, 0.0], "mounting_deg": 90.0 * y}
            leg["postures"] = {"insect": [0, 20, -110, 90 * y]}
            legs.append({**leg, **middle, "postures": {"insect": [0, 20, -20]}} if place == "middle" else leg)
    return {**data, "name": "test_mixed_legs", "postures": [{"name": "insect", "hold": "least"}], "legs": legs}


ALL = {"mecanum": mecanum, "cart": cart, "kiwi": kiwi, "swerve": swerve, "mixed": mixed}
LEGGED = {"quadruped": quadruped, "octopod": octopod}
