"""
What a body is: one declarative description, from which the URDF and every engine's arrays follow.

Conventions: SI units, REP-103 axes. In the rest pose (all joints at 0) every link's frame is
parallel to the world's. The base link's frame sits at its centre of mass; every other link's frame
sits at the joint that moves it. A joint turns its child about `axis` relative to its parent.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, pi

Vector = tuple[float, float, float]
Tensor = tuple[Vector, Vector, Vector]
X: Vector = (1.0, 0.0, 0.0)
Y: Vector = (0.0, 1.0, 0.0)
Z: Vector = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Box:
    """A box with edges along the link frame's axes."""

    size_m: Vector


@dataclass(frozen=True)
class Capsule:
    """A cylinder of `length_m` with hemispheres of its radius on both ends, along `axis`."""

    length_m: float
    radius_m: float
    axis: Vector


@dataclass(frozen=True)
class Sphere:
    """A solid sphere."""

    radius_m: float


@dataclass(frozen=True)
class Cylinder:
    """A cylinder of `length_m` with flat ends, along `axis`."""

    length_m: float
    radius_m: float
    axis: Vector


Shape = Box | Capsule | Sphere | Cylinder


@dataclass(frozen=True)
class Placed:
    """
    A shape at its place in a link.

    `centre_m` is the shape's centre in the link's frame, `rpy_rad` how the shape is turned there:
    fixed-axis roll, pitch and yaw, as in URDF.
    """

    shape: Shape
    centre_m: Vector = (0.0, 0.0, 0.0)
    rpy_rad: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Link:
    """
    A rigid link: its mass, and the shape or shapes that can touch the floor.

    Attributes
    ----------
    shape
        One shape, centred at the centre of mass, or any number of `Placed` ones.
    centre_m
        Centre of mass in the link's frame.
    inertia_axis
        For a single capsule, the axis of its smallest moment of inertia where that is not the
        capsule's own. The original program hands its physics engine inertia tensors that are
        turned into the world's frame already, and the engine turns them again: lying capsules come
        out with the smallest moment about another axis. The bodies of the study have what it
        really simulated.
    inertia_kg_m2
        Inertia tensor (3, 3) about the centre of mass, in the link's axes; None: of the shapes at
        uniform density.

    """

    name: str
    shape: Shape | tuple[Placed, ...]
    mass_kg: float = 1.0
    centre_m: Vector = (0.0, 0.0, 0.0)
    inertia_axis: Vector | None = None
    inertia_kg_m2: Tensor | None = None

    @property
    def shapes(self) -> tuple[Placed, ...]:
        """All shapes, each at its place."""
        if isinstance(self.shape, tuple):
            return self.shape
        return (Placed(self.shape, self.centre_m),)


@dataclass(frozen=True)
class Servo:
    """
    How a joint follows its target angle.

    Velocity target = `gain_per_s` * (target - angle), no faster than `max_speed_up_rad_s` towards
    larger angles and `max_speed_down_rad_s` towards smaller ones, reached with at most
    `max_torque_nm`.
    """

    gain_per_s: float = 1.0
    max_speed_up_rad_s: float = 1.0
    max_speed_down_rad_s: float = inf
    max_torque_nm: float = 10.0


@dataclass(frozen=True)
class Joint:
    """
    A hinge between two links, driven by one motor neuron.

    `origin_m` is the joint's (and the child's frame's) place in the parent's frame.
    """

    name: str
    parent: str
    child: str
    origin_m: Vector
    axis: Vector
    lower_rad: float = -pi / 4
    upper_rad: float = pi / 4
    servo: Servo = field(default_factory=Servo)
    time_constant: float = 1.0


@dataclass(frozen=True)
class Body:
    """
    A robot's body and nervous periphery.

    Attributes
    ----------
    links
        The first is the base.
    joints
        In the order of the motor neurons; parents stand before their children.
    sensors
        In the order of the sensor neurons: `touch:LINK` (0 or 1), `position:JOINT` (rad) or
        `motor:JOINT` (the joint's motor neuron one step ago: the original program's wiring of
        the spheres).
    height_m
        Of the base link's origin above the floor at the start.
    world
        Name of the world that the body is meant for.
    length_m
        The body length used to normalise displacements.

    """

    name: str
    description: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    sensors: tuple[str, ...]
    height_m: float
    length_m: float
    world: str = 'paper'
    hidden_neurons: int = 5

    def joint(self, name: str) -> Joint:
        """Return the joint called `name` (KeyError if there is none)."""
        return {joint.name: joint for joint in self.joints}[name]

    def link(self, name: str) -> Link:
        """Return the link called `name` (KeyError if there is none)."""
        return {link.name: link for link in self.links}[name]
