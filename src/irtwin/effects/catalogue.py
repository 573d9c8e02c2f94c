"""The catalogue: every effect that the twin knows, those of other installed packages among them."""

from __future__ import annotations

from functools import cache
from importlib.metadata import entry_points

from irtwin.effects.compliance import Backlash, JointElasticity
from irtwin.effects.disturbance import PeriodicDisturbance, SwitchingLoad
from irtwin.effects.drive import CopperLoss, InverterLoss, IronLoss, RotorInertia, WindingTemperature
from irtwin.effects.effect import Effect
from irtwin.effects.friction import (
    AsymmetricFriction,
    CoulombFriction,
    LoadDependentFriction,
    NonlinearViscousFriction,
    PositionDependentFriction,
    PreslidingHysteresis,
    StribeckFriction,
    TemperatureDependentFriction,
    ViscousFriction,
)
from irtwin.effects.load import BaseTilt, CableDrag, ExternalContact, GravityCompensation, Payload
from irtwin.effects.local import JointLimitSpring, LocalWear
from irtwin.effects.rigid_body import RigidBody
from irtwin.effects.sensing import (
    EncoderOffset,
    MeterGain,
    MeterLag,
    TimeDelay,
    TorqueConstantError,
    TorqueDrift,
    TorqueOffset,
)
from irtwin.effects.supply import BusCapacitor, HoldingBrakes, MechanicalPower, NoRegeneration, StandbyPower
from irtwin.effects.transmission import JointCoupling, TorqueRipple

GROUP = "irtwin.effects"

_OWN: tuple[type[Effect], ...] = (
    RigidBody,
    RotorInertia,
    CoulombFriction,
    ViscousFriction,
    TorqueOffset,
    MechanicalPower,
    StandbyPower,
    StribeckFriction,
    NonlinearViscousFriction,
    AsymmetricFriction,
    LoadDependentFriction,
    TemperatureDependentFriction,
    PreslidingHysteresis,
    Backlash,
    JointElasticity,
    TorqueRipple,
    PositionDependentFriction,
    JointCoupling,
    CableDrag,
    GravityCompensation,
    Payload,
    BaseTilt,
    ExternalContact,
    TorqueConstantError,
    TorqueDrift,
    EncoderOffset,
    TimeDelay,
    CopperLoss,
    WindingTemperature,
    IronLoss,
    InverterLoss,
    NoRegeneration,
    BusCapacitor,
    HoldingBrakes,
    MeterLag,
    MeterGain,
    PeriodicDisturbance,
    SwitchingLoad,
    LocalWear,
    JointLimitSpring,
)

# The default twin: the seed paper's model, with rotor inertia and offset.
BASELINE = (
    RigidBody.id,
    RotorInertia.id,
    CoulombFriction.id,
    ViscousFriction.id,
    TorqueOffset.id,
    MechanicalPower.id,
    StandbyPower.id,
)
# What an exciting motion has to show.
EXCITED = (RigidBody.id, RotorInertia.id, ViscousFriction.id, CoulombFriction.id, TorqueOffset.id)


def catalogue() -> dict[str, Effect]:
    """Return every effect that the twin knows, by id, in its default shape.

    An installed package adds its own: an entry point of the group `irtwin.effects` that names a class. ValueError where
    two have one id.
    """
    effects: dict[str, Effect] = {}
    for kind in (*_OWN, *_registered()):
        effect = kind()
        if effect.id in effects:
            raise ValueError(f"two effects are called {effect.id}: {type(effects[effect.id])} and {kind}")
        effects[effect.id] = effect
    return effects


@cache
def _registered() -> tuple[type[Effect], ...]:
    points = sorted(entry_points(group=GROUP), key=lambda point: point.name)
    return tuple(point.load() for point in points)
