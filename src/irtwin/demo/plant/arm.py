"""The arm: rigid links driven at the joints, by MuJoCo."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np


@dataclass(frozen=True)
class PlantPayload:
    """What the flange carries: mass in kg, centre of mass in the flange frame in m."""

    mass: float = 0.0
    com: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class LinkTolerance:
    """How far real links stray from the URDF (standard deviations): mass and inertia relative, com in m."""

    mass: float
    inertia: float
    com: float


class Arm:
    """Rigid-body dynamics of a URDF robot with rotor inertia at the joints and a payload at the flange."""

    def __init__(self, urdf: str, rotor_inertia: np.ndarray, payload: PlantPayload, step: float) -> None:
        """Build the arm; `rotor_inertia`: (n,) kg m^2 reflected to the joint, `step`: integration step in s."""
        spec = mujoco.MjSpec.from_string(urdf)
        spec.compiler.fusestatic = False
        if payload.mass:
            side = 0.06 * payload.mass ** (1 / 3)  # a cube of metal and air
            inertia = payload.mass * side**2 / 6
            body = spec.bodies[-1].add_body(name="payload", mass=payload.mass, ipos=payload.com)
            body.inertia, body.explicitinertial = [inertia] * 3, True
        self.model = spec.compile()
        self.model.opt.timestep = step
        self.model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        self.model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
        self.model.dof_armature[:] = rotor_inertia
        self.data = mujoco.MjData(self.model)

    def perturb(self, tolerance: LinkTolerance, rng: np.random.Generator) -> None:
        """Make the links those of one built robot. The inertias stay physically consistent."""
        model = self.model
        for body in range(1, model.nbody):
            normal = np.clip(rng.standard_normal(7), -2, 2)
            if model.body_mass[body] == 0 or model.body(body).name == "payload":
                continue
            mass = 1 + tolerance.mass * normal[0]
            second = 0.5 * model.body_inertia[body].sum() - model.body_inertia[body]
            second = mass * second * (1 + tolerance.inertia * normal[1:4])
            model.body_inertia[body] = second.sum() - second
            model.body_mass[body] *= mass
            model.body_ipos[body] += tolerance.com * normal[4:]
        mujoco.mj_setConst(model, self.data)

    @property
    def joint_names(self) -> list[str]:
        """Names of the joints, in order."""
        return [self.model.joint(index).name for index in range(self.model.njnt)]

    def place(self, q: np.ndarray) -> None:
        """Put the arm at rest at `q`: (n,) rad."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = q
        mujoco.mj_forward(self.model, self.data)

    def advance(self, torque: np.ndarray) -> np.ndarray:
        """Move on by one step under the net joint torque, (n,) N m; return the acceleration, rad/s^2."""
        self.data.qfrc_applied[:] = torque
        mujoco.mj_step(self.model, self.data)
        return np.array(self.data.qacc)

    def inverse_dynamics(self, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
        """Return the joint torque of a motion state, (n,) N m."""
        self.data.qpos[:], self.data.qvel[:], self.data.qacc[:] = q, dq, ddq
        mujoco.mj_inverse(self.model, self.data)
        return np.array(self.data.qfrc_inverse)

    def joint_inertia(self, q: np.ndarray) -> np.ndarray:
        """Return the diagonal of the inertia matrix at `q`, (n,) kg m^2."""
        self.data.qpos[:] = q
        mujoco.mj_fwdPosition(self.model, self.data)
        full = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, full)
        return full.diagonal().copy()

    def energy(self) -> float:
        """Return kinetic and potential energy of the present state, J."""
        mujoco.mj_energyPos(self.model, self.data)
        mujoco.mj_energyVel(self.model, self.data)
        return float(self.data.energy.sum())
