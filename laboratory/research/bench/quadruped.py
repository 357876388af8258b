"""Controller of a quadruped that knows its true state.

The forces of the standing feet hold the body. They are the smallest forces, by least squares, whose sum and moment
accelerate the body as wanted. A foot that swings follows a smooth curve to the next foothold. Torques are Jᵀ times the
force of a standing foot, and the inertia of the leg times the acceleration of a swinging one, plus gravity.

Speeds and durations scale with the height h of the robot: √(g h) and √h.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import mujoco
import numpy as np

from ..sets import Array
from .world import CONTROLLED, GRAVITY, LEGS, STEP, World

PERIOD = STEP * CONTROLLED
"""Time between two commands, s."""

CRAWL = (2, 0, 3, 1)
"""Order of the legs in a crawl: rear left, front left, rear right, front right."""

SHIFTS = 0.62
"""Part of a leg's turn in a crawl in which the body moves over the other three feet, before the leg swings."""

TOUCHES = 0.02
"""Load of a foot that has landed, as a share of the robot's weight."""

FOLLOWS = (120.0, 22.0)
"""Stiffness and damping of the hand or crane that carries a robot, 1/s² and 1/s."""


@dataclass(frozen=True)
class Command:
    """Gait, speed and posture that the robot is to have now."""

    gait: str = "stand"
    """`stand`, `trot` or `crawl`."""
    speed: float = 0.0
    """Forward, m/s."""
    turn: float = 0.0
    """About up, rad/s."""
    period: float = 0.5
    """Duration of a cycle of the gait, s."""
    duty: float = 0.58
    """Part of a cycle for which a foot of a trot stands."""
    clearance: float = 0.22
    """Height of a swing, as a share of h."""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Displacement of the body from the middle of the feet, as a share of h."""
    tilt: tuple[float, float] = (0.0, 0.0)
    """Roll and pitch of the body, rad."""
    push: float = 0.0
    """Sideways force on the body, as a share of the weight."""
    harness: bool = False
    """Ropes hold a body that tilts, sinks or drifts, so that a robot on grease does not fall."""
    carried: tuple[float, float, float, float, float] | None = None
    """Height that a hand or a crane lifts the body by, its displacement in x and y (m), roll and pitch (rad)."""


@dataclass
class Legs:
    """State of the gait."""

    stands: Array = field(default_factory=lambda: np.ones(4, bool))
    since: Array = field(default_factory=lambda: np.full(4, 1.0))
    """Time since the last landing or lift-off, s."""
    begun: Array = field(default_factory=lambda: np.zeros((4, 3)))
    """Where the swing began, m."""
    planted: Array = field(default_factory=lambda: np.zeros((4, 3)))
    """Where each foot stands, or stood last, m."""


class Quadruped:
    """Walks a robot of `world`."""

    def __init__(self, world: World, ripple: float, random: np.random.Generator) -> None:
        self.world, self.ripple, self.random = world, ripple, random
        self.model, self.data, self.height = world.model, world.data, world.robot.height
        model = self.model
        joints = [[model.joint(f"{leg}_{part}_joint").id for part in ("hip", "thigh", "calf")] for leg in LEGS]
        self.positions = [model.jnt_qposadr[of] for of in joints]
        self.dofs = [slice(model.jnt_dofadr[of[0]], model.jnt_dofadr[of[0]] + 3) for of in joints]
        self.thighs = [of[1] for of in joints]
        self.geoms = [model.geom(leg).id for leg in LEGS]
        self.bodies = [model.geom_bodyid[geom] for geom in self.geoms]
        self.radii = np.array([model.geom_size[geom, 0] for geom in self.geoms])
        self.base = model.jnt_bodyid[0]
        self.mass = world.weight / GRAVITY
        self.limits = 0.6 * world.weight * self.height
        self.noise = np.zeros(12)
        self.legs = Legs()
        self.phase, self.yaw, self.begun_slot = 0.0, 0.0, -1
        self._stand_up()
        self.reference = self.data.qpos[:2].copy()
        self.shift_from = self.shift = self.data.subtree_com[self.base][:2].copy()
        self.inertia = self._inertia()
        self.velocity = np.zeros(2)
        self.lifted_from: Array | None = None
        self.was_carried = False

    def feet(self) -> Array:
        return np.array(self.data.geom_xpos[self.geoms])

    def has_fallen(self) -> bool:
        up = self.data.xmat[self.base].reshape(3, 3)[2, 2]
        ground = self.legs.planted[:, 2].mean()
        is_low = self.data.qpos[2] - ground < 0.45 * self.height
        return bool(up < 0.6 or is_low or not np.isfinite(self.data.qpos).all())

    def command(self, command: Command) -> None:
        """Sets the torques for the next period."""
        data = self.data
        rotation = data.xmat[self.base].reshape(3, 3)
        yaw = float(np.arctan2(rotation[1, 0], rotation[0, 0]))
        level = _about_up(yaw)
        feet, load = self.feet(), self.world.load()
        self._advance_references(command, yaw, level)
        swing = self._step(command, feet, load, level)
        if command.carried is not None:
            torques = self._hang(command, rotation, yaw)
        else:
            self.lifted_from = None
            data.xfrc_applied[self.base] = 0.0
            if self.was_carried:
                self._put_down()
            forces = self._forces(command, rotation, yaw, level, feet)
            torques = self._torques(command, forces, swing, feet, level)
        if command.harness:
            self._hold(command, rotation, level)
        self.was_carried = command.carried is not None
        data.xfrc_applied[self.base, 1] += command.push * self.world.weight
        # Motors and gears are not silent, so their torque has noise below 64 Hz.
        self.noise += -400.0 * PERIOD * self.noise + np.sqrt(800.0 * PERIOD) * self.random.normal(size=12)
        torques = torques + self.ripple * self.limits * self.noise.reshape(4, 3)
        data.qfrc_applied[:] = 0.0
        for leg in range(4):
            data.qfrc_applied[self.dofs[leg]] = np.clip(torques[leg], -4.0 * self.limits, 4.0 * self.limits)

    def _stand_up(self) -> None:
        """Puts each foot below its thigh."""
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        data.qpos[:7] = [0.0, 0.0, self.height, 1.0, 0.0, 0.0, 0.0]
        for leg, at in enumerate(self.positions):
            low, high = model.jnt_range[model.jnt_qposadr.tolist().index(at[2])]
            sign = -1.0 if low + high < 0.0 else 1.0
            data.qpos[at] = [0.0, -0.8 * sign, 1.5 * sign]
        mujoco.mj_forward(model, data)
        target = np.array([[*data.xanchor[thigh][:2], radius] for thigh, radius in zip(self.thighs, self.radii)])
        target[:, 1] = self.feet()[:, 1]
        for _ in range(300):
            for leg in range(4):
                error = target[leg] - self.feet()[leg]
                jacobian = self._jacobian(leg)[:, self.dofs[leg]]
                change = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + 1e-5 * np.eye(3), error)
                data.qpos[self.positions[leg]] += np.clip(change, -0.2, 0.2)
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
        mujoco.mj_forward(model, data)
        error = np.linalg.norm(self.feet() - target, axis=1).max()
        if error > 0.02:
            raise RuntimeError(f"{self.world.robot.name} cannot stand: a foot is {error:.3f} m off")
        self.posture = np.array([data.qpos[at] for at in self.positions])
        self.stance = target[:, :2]
        data.qpos[2] += max(self.world.ground.height(*foot[:2]) for foot in target) + 0.003
        mujoco.mj_forward(model, data)
        self.legs.planted = self.feet()
        self.legs.begun = self.feet()

    def _jacobian(self, leg: int) -> Array:
        jacobian = np.zeros((3, self.model.nv))
        mujoco.mj_jac(self.model, self.data, jacobian, None, self.data.geom_xpos[self.geoms[leg]], self.bodies[leg])
        return jacobian

    def _inertia(self) -> Array:
        """Inertia of the whole robot about its centre of mass, kg m²."""
        data, total = self.data, np.zeros((3, 3))
        for body in range(1, self.model.nbody):
            turned, arm = data.ximat[body].reshape(3, 3), data.xipos[body] - data.subtree_com[self.base]
            own = turned @ np.diag(self.model.body_inertia[body]) @ turned.T
            total += own + self.model.body_mass[body] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        return total

    def _advance_references(self, command: Command, yaw: float, level: Array) -> None:
        self.velocity += (self.data.qvel[:2] - self.velocity) * PERIOD / 0.05
        self.yaw += command.turn * PERIOD
        self.yaw = yaw + float(np.clip(_wrapped(self.yaw - yaw), -0.3, 0.3))
        self.reference += (level[:2, 0] * command.speed) * PERIOD
        ahead = self.reference - self.data.qpos[:2]
        distance = float(np.linalg.norm(ahead))
        if distance > 0.12 * self.height:
            self.reference = self.data.qpos[:2] + ahead * 0.12 * self.height / distance

    def _step(self, command: Command, feet: Array, load: Array, level: Array) -> Array:
        """Lets feet lift and land. Returns the progress of each swing, from 0 to 1."""
        legs = self.legs
        wants = np.ones(4, bool)
        progress = np.ones(4)
        if command.gait != "stand":
            self.phase = (self.phase + PERIOD / command.period) % 1.0
        if command.gait == "trot":
            phases = (self.phase + np.array([0.0, 0.5, 0.5, 0.0])) % 1.0
            wants = phases < command.duty
            progress = np.where(wants, 1.0, (phases - command.duty) / (1.0 - command.duty))
        elif command.gait == "crawl":
            slot, part = divmod(4.0 * self.phase, 1.0)
            leg = CRAWL[int(slot)]
            others = [other for other in range(4) if other != leg]
            if int(slot) != self.begun_slot:
                self.begun_slot, self.shift_from = int(slot), self.shift.copy()
            over = 0.72 * legs.planted[others, :2].mean(axis=0) + 0.28 * legs.planted[:, :2].mean(axis=0)
            self.shift = self.shift_from + (over - self.shift_from) * _smooth(part / (0.9 * SHIFTS))
            if part >= SHIFTS:
                wants[leg], progress[leg] = False, (part - SHIFTS) / (1.0 - SHIFTS)
        if command.gait != "crawl":
            self.shift = self.data.subtree_com[self.base][:2].copy()
            self.begun_slot = -1
        touches = load > TOUCHES * self.world.weight
        for leg in range(4):
            legs.since[leg] += PERIOD
            if legs.stands[leg] and not wants[leg] and legs.since[leg] > 0.04:
                legs.stands[leg], legs.since[leg] = False, 0.0
                legs.begun[leg] = feet[leg]
            elif not legs.stands[leg] and touches[leg] and (wants[leg] or progress[leg] > 0.6):
                legs.stands[leg], legs.since[leg] = True, 0.0
                legs.planted[leg] = feet[leg]
            if legs.stands[leg] and touches[leg]:
                legs.planted[leg] = feet[leg]
        return progress

    def _forces(self, command: Command, rotation: Array, yaw: float, level: Array, feet: Array) -> Array:
        """Force of each foot on the body, N; zero for feet that swing."""
        data, legs, h = self.data, self.legs, self.height
        com, velocity, turn = data.subtree_com[self.base], data.qvel[:3], rotation @ data.qvel[3:6]
        ground = float((legs.planted[:, 2] - self.radii).mean())
        roll, pitch = np.arctan2(rotation[2, 1], rotation[2, 2]), -np.arcsin(np.clip(rotation[2, 0], -1.0, 1.0))
        along = np.linalg.norm((legs.planted[:2] - legs.planted[2:])[:, :2].mean(axis=0))
        slope = -float((legs.planted[:2] - legs.planted[2:])[:, 2].mean() / along)
        wanted = np.array(
            [command.tilt[0] - roll, command.tilt[1] + np.clip(slope, -0.3, 0.3) - pitch, _wrapped(self.yaw - yaw)]
        )
        forward = level[:2, 0] * command.speed
        if command.gait == "trot":
            across = 8.0 * (self.reference - data.qpos[:2]) + 6.0 * (forward - velocity[:2])
        elif command.gait == "crawl":
            across = np.clip(60.0 * (self.shift - com[:2]), -3.0, 3.0) - 13.0 * velocity[:2]
        else:
            middle = legs.planted[:, :2].mean(axis=0) + level[:2, :2] @ np.array(command.offset[:2]) * h
            across = 60.0 * (middle - com[:2]) - 12.0 * velocity[:2]
        up = 100.0 * (h * (1.0 + command.offset[2]) + ground - data.qpos[2]) - 18.0 * velocity[2]
        acceleration = np.clip([*across, up], -6.0, 6.0)
        turning = level @ (np.array([160.0, 160.0, 60.0]) * wanted) - np.array([22.0, 22.0, 12.0]) * turn
        turning = np.clip(turning + [0.0, 0.0, 12.0 * command.turn], -40.0, 40.0)
        wrench = np.concatenate(
            [self.mass * (acceleration + [0.0, 0.0, GRAVITY]), level @ self.inertia @ level.T @ turning]
        )
        forces = np.zeros((4, 3))
        standing = np.flatnonzero(legs.stands)
        if len(standing) == 0:
            return forces
        arms = feet[standing] - com
        effect = np.hstack([np.vstack([np.eye(3), _skew(arm)]) for arm in arms])
        # A foot that has just landed, or is about to lift, bears less.
        share = np.clip(legs.since[standing] / 0.03, 0.15, 1.0)
        if command.gait == "trot":
            phases = (self.phase + np.array([0.0, 0.5, 0.5, 0.0])[standing]) % 1.0
            left = (command.duty - phases) * command.period
            share = np.minimum(share, np.where(left > 0.0, np.clip(left / 0.03, 0.15, 1.0), 1.0))
        price = np.repeat(1e-3 / share**2, 3) * np.tile([1.5, 1.5, 1.0], len(standing))
        weight = np.array([1.0, 1.0, 2.0, 10.0 / h, 10.0 / h, 5.0 / h])
        weighted = effect.T * weight
        found = np.linalg.solve(weighted @ effect + np.diag(price), weighted @ wrench).reshape(-1, 3)
        found[:, 2] = np.clip(found[:, 2], 0.03 * self.world.weight, 1.2 * self.world.weight)
        sideways = np.linalg.norm(found[:, :2], axis=1)
        found[:, :2] *= np.minimum(1.0, 0.6 * found[:, 2] / np.maximum(sideways, 1e-9))[:, None]
        forces[standing] = found
        return forces

    def _torques(self, command: Command, forces: Array, progress: Array, feet: Array, level: Array) -> Array:
        data = self.data
        inertia = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, data, inertia)
        torques = np.zeros((4, 3))
        for leg, dofs in enumerate(self.dofs):
            jacobian = self._jacobian(leg)
            own = jacobian[:, dofs]
            if self.legs.stands[leg]:
                torques[leg] = data.qfrc_bias[dofs] - own.T @ forces[leg]
                if command.harness:
                    # A leg on grease resists the motion of its foot, because its gears do.
                    torques[leg] -= own.T @ (2.0 * self.mass * (jacobian @ data.qvel))
                continue
            at, speed = self._swing(command, leg, float(progress[leg]), level)
            stiffness, damping = (700.0, 45.0) if self.height < 0.4 else (500.0, 36.0)
            wanted = stiffness * (at - feet[leg]) + damping * (speed - jacobian @ data.qvel)
            wanted *= min(1.0, 150.0 / max(float(np.linalg.norm(wanted)), 1e-9))
            regular = own @ own.T + 1e-4 * self.height**2 * np.eye(3)
            acceleration = own.T @ np.linalg.solve(regular, wanted)
            torques[leg] = inertia[dofs, dofs] @ acceleration + data.qfrc_bias[dofs]
        return torques

    def _swing(self, command: Command, leg: int, progress: float, level: Array) -> tuple[Array, Array]:
        """Position and velocity of the curve of a foot."""
        h, legs, base = self.height, self.legs, self.data.qpos[:2]
        crawls = command.gait == "crawl"
        swings = command.period * (0.25 * (1.0 - SHIFTS) if crawls else 1.0 - command.duty)
        stands = command.period - swings
        left = max(swings * (1.0 - progress), 0.0)
        forward = level[:2, 0] * command.speed
        if crawls:
            around = legs.planted[:, :2].mean(axis=0)
            arm = level[:2, :2] @ (self.stance[leg] - self.stance.mean(axis=0))
            target = around + arm + forward * stands * 0.62
        else:
            around = base
            arm = level[:2, :2] @ self.stance[leg]
            correction = 0.16 * np.sqrt(h / 0.35) * (self.velocity - forward)
            target = around + arm + self.velocity * left + forward * stands / 2.0 + correction
        ahead = command.turn * (left + stands / 2.0)
        target = target + np.array([-arm[1], arm[0]]) * ahead
        start = legs.begun[leg]
        # The ground is as high as the feet that stand.
        end = float((legs.planted[:, 2] - self.radii).mean() + self.radii[leg])
        done, rate = _smooth(progress), _smooth_rate(progress) / swings
        across = start[:2] + (target - start[:2]) * done
        top = max(start[2], end) + command.clearance * h
        if progress < 0.45:
            part, low, high = progress / 0.45, start[2], top
            duration = 0.45 * swings
        else:
            part, low, high = (progress - 0.45) / 0.55, top, end - 0.004
            duration = 0.55 * swings
        up, speed = low + (high - low) * _smooth(part), (high - low) * _smooth_rate(part) / duration
        late = legs.since[leg] - swings
        if late > 0.0:
            # The ground is lower than expected: search for it.
            up, speed = end - min(0.5 * late * np.sqrt(h), 0.3 * h), -0.5 * np.sqrt(h)
        return np.array([*across, up]), np.array([*((target - start[:2]) * rate), speed])

    def _hang(self, command: Command, rotation: Array, yaw: float) -> Array:
        """A hand or crane moves the body. The legs hold their posture, softly."""
        assert command.carried is not None
        data, mass = self.data, self.mass
        if self.lifted_from is None:
            self.lifted_from = data.qpos[:3].copy()
            self.yaw = yaw
        lift, x, y, roll, pitch = command.carried
        stiff, damp = FOLLOWS
        target = self.lifted_from + [x, y, lift]
        pull = mass * (stiff * (target - data.qpos[:3]) - damp * data.qvel[:3] + [0.0, 0.0, GRAVITY])
        pull[2] = np.clip(pull[2], 0.0, 3.0 * self.world.weight)
        now = (np.arctan2(rotation[2, 1], rotation[2, 2]), -np.arcsin(np.clip(rotation[2, 0], -1.0, 1.0)))
        error = np.array([roll - now[0], pitch - now[1], _wrapped(self.yaw - yaw)])
        level = _about_up(yaw)
        turning = level @ (60.0 * error) - 12.0 * (rotation @ data.qvel[3:6])
        data.xfrc_applied[self.base] = [*pull, *(level @ self.inertia @ level.T @ turning)]
        inertia = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, data, inertia)
        torques = np.zeros((4, 3))
        for leg, dofs in enumerate(self.dofs):
            error = self.posture[leg] - data.qpos[self.positions[leg]]
            wanted = 150.0 * error - 18.0 * data.qvel[dofs]
            torques[leg] = inertia[dofs, dofs] @ wanted + data.qfrc_bias[dofs]
        return torques

    def _hold(self, command: Command, rotation: Array, level: Array) -> None:
        data, weight, h = self.data, self.world.weight, self.height
        roll, pitch = np.arctan2(rotation[2, 1], rotation[2, 2]), -np.arcsin(np.clip(rotation[2, 0], -1.0, 1.0))
        sunk = 0.94 * h + float((self.legs.planted[:, 2] - self.radii).mean()) - data.qpos[2]
        drift = (level[:2, 0] * command.speed - data.qvel[:2]) / np.sqrt(GRAVITY * h)
        across = weight * np.clip(0.35 * drift, -0.12, 0.12)
        turning = weight * h * (level @ [-2.5 * roll, -2.5 * pitch, 0.0] - 0.12 * (rotation @ data.qvel[3:6]))
        data.xfrc_applied[self.base] += [*across, weight * np.clip(3.0 * sunk / h, 0.0, 0.6), *turning]

    def _put_down(self) -> None:
        self.legs = Legs(planted=self.feet(), begun=self.feet())
        self.reference = self.data.qpos[:2].copy()


def run(robot: Quadruped, seconds: float, plan: Callable[[float], Command]) -> bool:
    """Follows a plan. Returns false if the robot falls."""
    for k in range(round(seconds / PERIOD)):
        robot.command(plan(k * PERIOD))
        robot.world.advance()
        if robot.has_fallen():
            return False
    return True


def _about_up(yaw: float) -> Array:
    cosine, sine = np.cos(yaw), np.sin(yaw)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def _skew(v: Array) -> Array:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def _wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _smooth(part: float) -> float:
    """Smooth curve from 0 to 1, with zero speed and acceleration at both ends."""
    part = min(max(part, 0.0), 1.0)
    return part**3 * (10.0 - 15.0 * part + 6.0 * part**2)


def _smooth_rate(part: float) -> float:
    return 30.0 * part**2 * (1.0 - part) ** 2 if 0.0 < part < 1.0 else 0.0
