"""Controller of a humanoid: a plan of feet and centre of mass, joint angles by inverse kinematics, stiff joints.

The plan is made before the robot starts. The centre of mass x follows from the planned centre of pressure p, because a
body at a constant height h falls away from it: x − (h/g) ẍ = p. This is one banded system over the whole plan.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.linalg import solve_banded

from ..sets import Array
from .quadruped import PERIOD
from .world import GRAVITY, World

STIFF, DAMPED = 90.0, 0.4
"""Stiffness and damping of a joint, N m/rad and N m s/rad. The model adds its own damping."""

STRAIGHTENS = 0.25
"""Correction of the ankles by the tilt of the body, rad/rad."""

LIFT = 0.03
"""Height of a step, m."""

SETTLES = 1.5
"""The robot stands for this long before its first step and after its last one, s."""


@dataclass(frozen=True)
class Walk:
    """A walk of a humanoid, or its stand."""

    seconds: float
    stride: float = 0.0
    """Length of a step, m. The robot stands if it is 0 and it does not turn."""
    step: float = 0.55
    """Duration of a step, s."""
    turn: float = 0.0
    """Of a step, rad."""
    moves: float = 0.0
    """Motion of the body while it stands, as a share of the height."""
    lifted: tuple[float, float, float, float, float] | None = None
    """Lift by hand or crane: begin and end, s, height, m, duration of the lift, s, and sway, m."""
    pause: tuple[float, float] | None = None
    """Begin and end of a stand within the walk, s."""


@dataclass(frozen=True, eq=False)
class Plan:
    """At each command. Shapes (N, 3), (N,), (N, 2, 3), (N, 2) and (N, 5)."""

    body: Array
    heading: Array
    tilt: Array
    feet: Array
    headings: Array
    carried: Array
    """Height and pose of the lift, as in `quadruped.Command`; NaN while the robot stands on its own feet."""


class Humanoid:
    """Walks a robot of `world` by a plan."""

    def __init__(self, world: World, walk: Walk, ripple: float, random: np.random.Generator) -> None:
        self.world, self.ripple, self.random = world, ripple, random
        self.model, self.data = world.model, world.data
        model = self.model
        self.base = model.jnt_bodyid[0]
        self.feet = [model.body(name).id for name in world.robot.feet]
        sides = ("l", "r")
        names = ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ank_pitch", "ank_roll")
        joints = [[model.joint(f"{side}_{name}").id for name in names] for side in sides]
        self.positions = [model.jnt_qposadr[of] for of in joints]
        self.dofs = [model.jnt_dofadr[of] for of in joints]
        self.limits = 0.6 * world.weight * world.robot.height
        self.noise = np.zeros(model.nv - 6)
        self.pose = mujoco.MjData(model)
        self.pose.qpos[:] = model.qpos0
        # Knees must be bent, or the legs could not shorten.
        for at in self.positions:
            signs = np.sign([model.jnt_axis[model.jnt_qposadr.tolist().index(q)][1] for q in at])
            self.pose.qpos[at] = np.array([0.0, 0.0, -0.35, 0.7, -0.35, 0.0]) * np.where(signs == 0.0, 1.0, signs)
        mujoco.mj_kinematics(model, self.pose)
        mujoco.mj_comPos(model, self.pose)
        width = self.pose.xpos[self.feet[0]][1] - self.pose.xpos[self.feet[1]][1]
        soles = np.array([_sole(model, foot) for foot in self.feet])
        self.ankle = -float(soles[0, 2])
        height = float(world.robot.height)
        self.offset = np.array([*(self.pose.subtree_com[self.base] - self.pose.qpos[:3])[:2], 0.0])
        self.plan = planned(walk, width, soles, height, self.ankle, self.offset)
        for _ in range(400):
            self._solve(0)
        if self._solve(0) > 2e-3:
            raise RuntimeError(f"{world.robot.name} cannot stand")
        self.data.qpos[:] = self.pose.qpos
        self.data.qpos[2] += 0.002
        mujoco.mj_forward(model, self.data)
        self.lifted_from: Array | None = None
        self.clock = 0

    def has_fallen(self) -> bool:
        up = self.data.xmat[self.base].reshape(3, 3)[2, 2]
        return bool(up < 0.7 or self.data.qpos[2] < 0.6 * self.world.robot.height)

    def command(self) -> None:
        data, k = self.data, min(self.clock, len(self.plan.body) - 1)
        self.clock += 1
        self._solve(k)
        wanted = self.pose.qpos[7:].copy()
        rotation = data.xmat[self.base].reshape(3, 3)
        carried = self.plan.carried[k]
        data.xfrc_applied[self.base] = 0.0
        if np.isnan(carried[0]):
            self.lifted_from = None
            self._straighten(wanted, rotation, k)
        else:
            self._carry(carried, rotation)
        self.noise += -400.0 * PERIOD * self.noise + np.sqrt(800.0 * PERIOD) * self.random.normal(size=len(self.noise))
        torque = STIFF * (wanted - data.qpos[7:]) - DAMPED * data.qvel[6:] + data.qfrc_bias[6:]
        data.qfrc_applied[6:] = np.clip(
            torque + self.ripple * self.limits * self.noise, -4.0 * self.limits, 4.0 * self.limits
        )

    def _solve(self, k: int) -> float:
        """A step of the inverse kinematics. Returns the error before it, m and rad."""
        plan, pose = self.plan, self.pose
        pose.qpos[:3] = plan.body[k]
        pose.qpos[3:7] = _quaternion(plan.tilt[k, 0], plan.tilt[k, 1], plan.heading[k])
        mujoco.mj_kinematics(self.model, pose)
        mujoco.mj_comPos(self.model, pose)
        largest = 0.0
        for leg, foot in enumerate(self.feet):
            move, turn = np.zeros((3, self.model.nv)), np.zeros((3, self.model.nv))
            mujoco.mj_jacBody(self.model, pose, move, turn, foot)
            goal, error = _quaternion(0.0, 0.0, plan.headings[k, leg]), np.zeros(3)
            mujoco.mju_subQuat(error, goal, pose.xquat[foot])
            error = pose.xmat[foot].reshape(3, 3) @ error
            full = np.concatenate([plan.feet[k, leg] - pose.xpos[foot], error])
            jacobian = np.vstack([move, turn])[:, self.dofs[leg]]
            change = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + 1e-6 * np.eye(6), full)
            pose.qpos[self.positions[leg]] += np.clip(change, -0.1, 0.1)
            largest = max(largest, float(np.abs(full).max()))
        return largest

    def _straighten(self, wanted: Array, rotation: Array, k: int) -> None:
        """Adds the torque with which the ankles push a tilted body back."""
        roll, pitch = np.arctan2(rotation[2, 1], rotation[2, 2]), -np.arcsin(np.clip(rotation[2, 0], -1.0, 1.0))
        roll, pitch = roll - self.plan.tilt[k, 0], pitch - self.plan.tilt[k, 1]
        for leg in range(2):
            joints = [self.model.jnt_qposadr.tolist().index(q) for q in self.positions[leg][4:]]
            axes = self.model.jnt_axis[joints]
            # A turn of the sole against the tilt of the body.
            wanted[self.positions[leg][4] - 7] += STRAIGHTENS * pitch * axes[0][1]
            wanted[self.positions[leg][5] - 7] += STRAIGHTENS * roll * axes[1][0]

    def _carry(self, carried: Array, rotation: Array) -> None:
        data = self.data
        if self.lifted_from is None:
            self.lifted_from = data.qpos[:3].copy()
        lift, x, y, roll, pitch = carried
        mass = self.world.weight / GRAVITY
        target = self.lifted_from + [x, y, lift]
        pull = mass * (120.0 * (target - data.qpos[:3]) - 22.0 * data.qvel[:3] + [0.0, 0.0, GRAVITY])
        pull[2] = np.clip(pull[2], 0.0, 3.0 * self.world.weight)
        now = (np.arctan2(rotation[2, 1], rotation[2, 2]), -np.arcsin(np.clip(rotation[2, 0], -1.0, 1.0)))
        turning = rotation @ (60.0 * np.array([roll - now[0], pitch - now[1], 0.0])) - 12.0 * (
            rotation @ data.qvel[3:6]
        )
        data.xfrc_applied[self.base] = [*pull, *(0.02 * mass * turning * self.world.robot.height)]


def run(robot: Humanoid, seconds: float) -> bool:
    """Follows the plan. Returns false if the robot falls."""
    for _ in range(round(seconds / PERIOD)):
        robot.command()
        robot.world.advance()
        if robot.has_fallen():
            return False
    return True


def planned(walk: Walk, width: float, soles: Array, height: float, ankle: float, offset: Array) -> Plan:
    """Feet step in turn, and the body follows the centre of pressure."""
    n = round(walk.seconds / PERIOD)
    t = np.arange(n, dtype=np.float64) * PERIOD
    feet = np.tile([[0.0, 0.5 * width, ankle], [0.0, -0.5 * width, ankle]], (n, 1, 1)).astype(float)
    headings = np.zeros((n, 2))
    heading = np.zeros(n)
    middles = np.tile(_middle(feet[0], headings[0], soles), (n, 1))
    place, yaw = np.array([0.0, 0.0]), 0.0
    leg, at = 0, SETTLES
    # Adds one step after the other. A step changes the plan from its begin on.
    walks = walk.stride != 0.0 or walk.turn != 0.0
    while walks and at + walk.step + SETTLES < walk.seconds:
        if walk.pause and walk.pause[0] <= at < walk.pause[1]:
            at = walk.pause[1]
        if walk.lifted and at + walk.step > walk.lifted[0] - SETTLES:
            break
        is_last = at + 2.0 * walk.step + SETTLES >= walk.seconds
        yaw += walk.turn
        place = place + (0.0 if is_last else walk.stride) * np.array([np.cos(yaw), np.sin(yaw)])
        side = 0.5 * width * (1.0 if leg == 0 else -1.0)
        goal = np.array([place[0] - side * np.sin(yaw), place[1] + side * np.cos(yaw), ankle])
        begins, ends = at + 0.25 * walk.step, at + walk.step
        start, first = feet[-1, leg].copy(), headings[-1, leg]
        part = np.clip((t - begins) / (ends - begins), 0.0, 1.0)
        done = part**3 * (10.0 - 15.0 * part + 6.0 * part**2)
        moved = t >= begins
        curve = start + (goal - start) * done[:, None]
        curve[:, 2] += LIFT * 16.0 * part**2 * (1.0 - part) ** 2
        feet[moved, leg] = curve[moved]
        headings[moved, leg] = (first + (yaw - first) * done)[moved]
        turns = np.clip((t - at) / walk.step, 0.0, 1.0)
        moving = t >= at
        heading[moving] = (heading[-1] + (yaw - heading[-1]) * turns)[moving]
        other = 1 - leg
        standing = _middle(feet[-1:, other][0][None], headings[-1:, other], soles[other][None])
        was = middles[-1].copy()
        shift = np.clip((t - at) / (0.25 * walk.step), 0.0, 1.0)[:, None]
        middles[moving] = (was + (standing - was) * shift)[moving]
        # After the last step the weight returns to the middle.
        both = _middle(feet[-1], headings[-1], soles)
        back = np.clip((t - ends) / (0.25 * walk.step), 0.0, 1.0)[:, None]
        after = t >= ends
        pauses = walk.pause and ends >= walk.pause[0] and at < walk.pause[0]
        stops = walk.lifted and ends + walk.step > walk.lifted[0] - SETTLES
        if is_last or pauses or stops or ends + walk.step + SETTLES >= walk.seconds:
            middles[after] = (standing + (both - standing) * back)[after]
        leg, at = other, ends
    com = _body_over(middles, height + 0.03)
    body = np.column_stack([com - offset[:2], np.full(n, height)])
    tilt = np.zeros((n, 2))
    if walk.moves:
        begins, ends = walk.pause or (SETTLES, walk.seconds)
        grows = (np.clip((t - begins - 1.0) / 2.0, 0.0, 1.0) * np.clip((ends - 1.0 - t) / 1.0, 0.0, 1.0))[:, None]
        waves = [np.sin(2.0 * np.pi * hertz * t + phase) for hertz, phase in ((0.4, 0.0), (0.3, 0.5), (0.61, 0.0))]
        body += walk.moves * height * grows * np.column_stack(waves) * [0.6, 1.0, 0.6]
        body[:, 2] -= walk.moves * height * 0.8 * grows[:, 0]
        tilt[:, 0] = 0.05 * grows[:, 0] * np.sin(2.0 * np.pi * 0.5 * t + 1.0)
        tilt[:, 1] = 0.05 * grows[:, 0] * np.sin(2.0 * np.pi * 0.83 * t)
    return Plan(body, heading, tilt, feet, headings, _carried(walk, t))


def _carried(walk: Walk, t: Array) -> Array:
    carried = np.full((len(t), 5), np.nan)
    if walk.lifted is None:
        return carried
    begins, ends, lift, rise, sway = walk.lifted
    during = (t >= begins) & (t < ends)
    up = np.minimum(np.clip((t - begins) / rise, 0.0, 1.0), np.clip((ends - t) / rise, 0.0, 1.0))
    up = up * up * (3.0 - 2.0 * up)
    waves = [sway * np.sin(2.0 * np.pi * hertz * (t - begins)) for hertz in (1.7, 0.7, 1.1, 0.9, 1.3)]
    of = np.column_stack(
        [lift * up + 0.2 * waves[0] * up, waves[1] * up, waves[2] * up, 2.0 * waves[3] * up, 2.0 * waves[4] * up]
    )
    carried[during] = of[during]
    return carried


def _middle(feet: Array, headings: Array, soles: Array) -> Array:
    """Mean of the middles of soles, on the ground."""
    cosine, sine = np.cos(headings), np.sin(headings)
    x = feet[:, 0] + cosine * soles[:, 0] - sine * soles[:, 1]
    y = feet[:, 1] + sine * soles[:, 0] + cosine * soles[:, 1]
    return np.array([x.mean(), y.mean()])


def _body_over(pressure: Array, height: float) -> Array:
    """Solves x − (h/g) ẍ = p."""
    a = height / (GRAVITY * PERIOD**2)
    n = len(pressure)
    bands = np.vstack([np.full(n, -a), np.full(n, 1.0 + 2.0 * a), np.full(n, -a)])
    bands[1, [0, -1]] = 1.0
    bands[0, 1] = bands[2, -2] = 0.0
    return np.asarray(solve_banded((1, 1), bands, pressure))


def _sole(model: mujoco.MjModel, body: int) -> Array:
    """Middle of the lower side of the boxes of a foot, m, frame of the foot."""
    boxes = [g for g in range(model.ngeom) if model.geom_bodyid[g] == body and model.geom_contype[g]]
    at, size = model.geom_pos[boxes], model.geom_size[boxes]
    return np.array([*at[:, :2].mean(axis=0), (at[:, 2] - size[:, 2]).min()])


def _quaternion(roll: float, pitch: float, yaw: float) -> Array:
    result = np.zeros(4)
    mujoco.mju_euler2Quat(result, np.array([yaw, pitch, roll]), "ZYX")
    return result
