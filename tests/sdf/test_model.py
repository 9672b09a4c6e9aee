"""The SDF model is the description: names, masses, joints, motors, contact."""

import logging

import numpy as np
import pytest
from lxml import etree
from pydrake.geometry import Role, SceneGraph
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

import robots
import rollerbench as rb
from rollerbench.resources import models_dir, robot_names

EVERY = {**{name: (lambda name=name: name) for name in robot_names()}, **robots.ALL, **robots.LEGGED}


def _loaded(robot: rb.Robot, caplog: pytest.LogCaptureFixture) -> tuple[MultibodyPlant, SceneGraph, object]:
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.005)
    parser = Parser(plant)
    parser.SetStrictParsing()
    with caplog.at_level(logging.INFO, logger="drake"):
        parser.AddModelsFromString(rb.sdf.robot_to_sdf(robot), "sdf")
        plant.Finalize()
        diagram = builder.Build()
        diagram.CreateDefaultContext()
    return plant, scene_graph, diagram


@pytest.mark.parametrize("name", robot_names())
def test_committed_models_are_up_to_date(name: str) -> None:
    committed = (models_dir() / name / f"{name}.sdf").read_text(encoding="utf-8")
    assert rb.sdf.robot_to_sdf(rb.load_robot(name)) == committed, f"run `rollerbench build {name}`"


@pytest.mark.parametrize("name", robot_names())
def test_models_are_found_as_a_package(name: str) -> None:
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.005)
    parser = Parser(plant)
    parser.package_map().AddPackageXml(str(models_dir() / "package.xml"))
    (instance,) = parser.AddModels(url=f"package://rollerbench/{name}/{name}.sdf")
    assert plant.GetModelInstanceName(instance) == name


@pytest.mark.parametrize("make", EVERY.values(), ids=EVERY)
def test_drake_loads_the_same_masses_without_a_word(make, caplog: pytest.LogCaptureFixture) -> None:
    robot = rb.load_robot(make())
    plant, _, _ = _loaded(robot, caplog)
    assert caplog.records == []
    context = plant.CreateDefaultContext()
    for leg in robot.legs:
        for number, angle in enumerate(leg.posture(robot.standing[0].name), start=1):
            plant.GetJointByName(f"{leg.name}_joint_{number}").set_angle(context, angle)
    bodies = plant.GetBodyIndices(plant.GetModelInstanceByName(robot.name))
    body = plant.GetBodyByName("body")
    inertia = plant.CalcSpatialInertia(context, body.body_frame(), bodies)
    about_com = inertia.Shift(inertia.get_com()).CalcRotationalInertia().CopyToFullMatrix3()
    # 1e-9: SDF carries twelve digits.
    assert inertia.get_mass() == pytest.approx(robot.inertia.mass, rel=1e-9)
    assert inertia.get_com() == pytest.approx(robot.inertia.com, abs=1e-9)
    assert about_com == pytest.approx(robot.inertia.moment, abs=1e-9 * robot.inertia.moment.max())


@pytest.mark.parametrize("make", EVERY.values(), ids=EVERY)
def test_motors_are_on_driven_and_steered_wheels_and_legs_only(make, caplog: pytest.LogCaptureFixture) -> None:
    robot = rb.load_robot(make())
    plant, _, _ = _loaded(robot, caplog)
    expected = {f"{wheel.name}_drive": wheel.max_effort or np.inf for wheel in robot.driven_wheels}
    expected |= {f"{wheel.name}_swivel": wheel.max_steering_effort or np.inf for wheel in robot.steered_wheels}
    for leg in robot.legs:
        expected |= {f"{leg.name}_joint_{i}": link.max_effort or np.inf for i, link in enumerate(leg.links, start=1)}
        expected |= {f"{leg.name}_drive": leg.wheel.max_effort or np.inf} if leg.wheel.driven else {}
    actuators = [plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices()]
    assert {actuator.joint().name(): actuator.effort_limit() for actuator in actuators} == expected


@pytest.mark.parametrize("make", EVERY.values(), ids=EVERY)
def test_wheels_touch_only_the_ground(make, caplog: pytest.LogCaptureFixture) -> None:
    robot = rb.load_robot(make())
    _, scene_graph, _ = _loaded(robot, caplog)
    inspector = scene_graph.model_inspector()
    assert inspector.GetCollisionCandidates() == set()
    shapes = [
        inspector.GetShape(geometry)
        for frame in inspector.GetAllFrameIds()
        for geometry in inspector.GetGeometries(frame, Role.kProximity)
    ]
    kinds = [type(shape).__name__ for shape in shapes]
    assert kinds.count("Ellipsoid") == sum(wheel.ring.count if wheel.ring else 1 for wheel in robot.wheels)
    assert kinds.count("Sphere") == len(robot.legs)
    assert kinds.count("Box") == 1


def test_a_forward_turn_of_the_hub_moves_its_bottom_backward() -> None:
    """Positive wheel speed drives to +x: the touching point of the turning wheel moves to -x of the hub."""
    robot = rb.load_robot("youbot_base")
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.005)
    model = rb.add_robot(plant, robot)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    wheel = robot.wheels[0]
    bottom = plant.GetBodyByName(f"{wheel.name}_roller_00")
    hub = model.drive_joint(wheel).parent_body()
    before = plant.CalcRelativeTransform(context, hub.body_frame(), bottom.body_frame()).translation()
    model.drive_joint(wheel).set_angle(context, 0.1)
    after = plant.CalcRelativeTransform(context, hub.body_frame(), bottom.body_frame()).translation()
    assert before[2] == min(before[2], after[2])
    assert after[0] < before[0]


def test_visuals_show_the_rotation() -> None:
    root = etree.fromstring(rb.sdf.robot_to_sdf(rb.load_robot("youbot_base")).encode())
    hub = root.xpath("//link[@name='front_left_hub']/visual/@name")
    rollers = root.xpath("//link[starts-with(@name, 'front_left_roller')]")
    assert "spoke" in hub
    assert len(rollers) == 12
    colors = {roller.findtext("visual/material/diffuse") for roller in rollers}
    assert len(colors) == 2
