"""A differential robot in MuJoCo as the plant of a run (docs/own-plant.md): `pip install mujoco`.

    hil run scenario-1 --set robot.file=diff-2wd --set camera.file=diff-2wd \
        --set robot.plant=docs/examples/mujoco_plant.py

Rigid bodies, contacts and friction are MuJoCo's; motor and bridge are the robot file's, with the winding's
current taken as settled (its time constant is 0.5 ms). Geometry and masses come from the robot file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import mujoco

from hil import serve_plant

STEP_S = 0.0005  # of the engine; contacts of a robot of 1 kg want it short

MODEL = """
<mujoco>
  <option timestep="{step}" integrator="implicitfast" cone="elliptic" impratio="10"/>
  <default><geom condim="3" solref="0.004 1"/></default>
  <worldbody>
    <geom type="plane" size="20 20 1" friction="{wheel_friction} 0 0"/>
    <body name="robot" pos="{x} {y} {r}" euler="0 0 {theta}">
      <freejoint/>
      <inertial pos="0 0 0" mass="{mass}" diaginertia="{lean} {lean} {inertia}"/>
      <geom name="castor" type="sphere" size="{ball}" pos="{castor} 0 {down}" mass="0"
            friction="{castor_friction} 0 0" priority="1"/>
      {wheels}
    </body>
  </worldbody>
</mujoco>
"""
WHEEL = """
      <body pos="{axle} {left} 0">
        <joint name="{name}" axis="0 1 0" armature="{rotor}"/>
        <geom type="ellipsoid" size="{r} 0.006 {r}" mass="{mass}" friction="{friction} 0 0"/>
      </body>
"""


class MujocoPlant:
    """Two wheels, a ball for a castor, a floor."""

    takes = ("force_forward_n", "force_left_n", "torque_yaw_n_m")

    def reset(
        self,
        robot: Mapping[str, Any],
        start: Mapping[str, float],
        dt_s: float,  # noqa: ARG002 - a step is told its own
        seed: int,  # noqa: ARG002 - nothing is drawn
    ) -> None:
        """Build the robot from its file, standing at `start`."""
        if robot["vehicle"]["kind"] != "differential":
            raise SystemExit("this plant knows differential robots only; try robot.file=diff-2wd")
        self.robot, self.motor, self.bridge = robot, robot["motor"], robot["bridge"]
        r = robot["wheel_radius_m"]
        wheel_kg = 0.01  # the rest of a wheel's mass is the robot's
        rotor = self.motor["gear_ratio"] ** 2 * self.motor["rotor_inertia_kg_m2"]
        ball_m = 0.25 * r
        wheels = "".join(
            WHEEL.format(
                axle=robot["d0_m"], left=sign * robot["track_m"] / 2, name=name, r=r, mass=wheel_kg,
                rotor=rotor + robot["wheel_inertia_kg_m2"], friction=robot["floor"]["friction_ratio"],
            )
            for name, sign in (("left", 1), ("right", -1))
        )  # fmt: skip
        text = MODEL.format(
            step=STEP_S, x=start["x_m"], y=start["y_m"], theta=math.degrees(start["theta_rad"]), r=r,
            mass=robot["mass_kg"] - 2 * wheel_kg, inertia=robot["inertia_kg_m2"],
            lean=0.6 * robot["inertia_kg_m2"], ball=ball_m, down=ball_m - r,
            castor=robot["d0_m"] - robot["vehicle"]["castor_behind_m"],
            castor_friction=robot["vehicle"]["castor_friction_ratio"],
            wheel_friction=robot["floor"]["friction_ratio"], wheels=wheels,
        )  # fmt: skip
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)

    def _torque(self, volts: float, omega: float) -> tuple[float, float]:
        """Return torque at the wheel and current of a motor whose winding has settled."""
        motor, bridge = self.motor, self.bridge
        emf_v = motor["emf_constant_v_s_rad"] * motor["gear_ratio"] * omega
        pushing = volts - emf_v
        drop_v = min(bridge["drop_v"], abs(pushing)) * math.copysign(1.0, pushing)
        current = (pushing - drop_v) / (motor["resistance_ohm"] + bridge["resistance_ohm"])
        gear = motor["torque_constant_n_m_a"] * motor["gear_ratio"] * current
        lost = motor["coulomb_n_m"] + (1.0 - motor["gear_efficiency_ratio"]) * abs(gear)
        friction = lost * math.tanh(omega / 0.05) + motor["viscous_n_m_s_rad"] * omega
        return gear - friction, current

    def step(
        self, volts: tuple[float, float], dt_s: float, loads: Mapping[str, float]
    ) -> Mapping[str, float]:
        """Move on by `dt_s`; the engine takes its own shorter steps."""
        data = self.data
        joints = [data.joint("left"), data.joint("right")]
        body = data.body("robot")
        currents = [0.0, 0.0]
        for _ in range(round(dt_s / STEP_S)):
            for side, joint in enumerate(joints):
                torque, currents[side] = self._torque(volts[side], float(joint.qvel[0]))
                joint.qfrc_applied[0] = torque
            w, _, _, z = body.xquat
            theta = 2.0 * math.atan2(z, w)
            c, s = math.cos(theta), math.sin(theta)
            ahead, left = loads.get("force_forward_n", 0.0), loads.get("force_left_n", 0.0)
            body.xfrc_applied[:2] = c * ahead - s * left, s * ahead + c * left
            body.xfrc_applied[5] = loads.get("torque_yaw_n_m", 0.0)
            mujoco.mj_step(self.model, data)
        x, y, _, w, _, _, z = data.qpos[:7]
        vx, vy, _, _, _, turn = data.qvel[:6]
        theta = 2.0 * math.atan2(z, w)
        c, s = math.cos(theta), math.sin(theta)
        return {
            "x_m": float(x), "y_m": float(y), "theta_rad": theta,
            "eta1_m_s": float(c * vx + s * vy), "eta2_m_s": float(c * vy - s * vx),
            "theta_dot_rad_s": float(turn),
            "wheel_left_rad": float(joints[0].qpos[0]), "wheel_right_rad": float(joints[1].qpos[0]),
            "omega_left_rad_s": float(joints[0].qvel[0]),
            "omega_right_rad_s": float(joints[1].qvel[0]),
            "current_left_a": currents[0], "current_right_a": currents[1],
        }  # fmt: skip


if __name__ == "__main__":
    serve_plant(MujocoPlant())
