"""The catalogue: every effect that the twin knows, those of other installed packages among them."""

from __future__ import annotations

from functools import cache
from importlib.metadata import entry_points

from irtwin.effects import (
    compliance,
    disturbance,
    drive,
    friction,
    load,
    local,
    rigid_body,
    sensing,
    supply,
    transmission,
)
from irtwin.effects.effect import Effect

GROUP = "irtwin.effects"

_BASELINE: tuple[type[Effect], ...] = (  # the seed paper's model, with rotor inertia and offset
    rigid_body.RigidBody,
    drive.RotorInertia,
    friction.CoulombFriction,
    friction.ViscousFriction,
    sensing.TorqueOffset,
    supply.MechanicalPower,
    supply.StandbyPower,
)
OWN: tuple[type[Effect], ...] = (
    *_BASELINE,
    friction.StribeckFriction,
    friction.NonlinearViscousFriction,
    friction.AsymmetricFriction,
    friction.LoadDependentFriction,
    friction.TemperatureDependentFriction,
    friction.PreslidingHysteresis,
    compliance.Backlash,
    compliance.JointElasticity,
    transmission.TorqueRipple,
    friction.PositionDependentFriction,
    transmission.JointCoupling,
    load.CableDrag,
    load.GravityCompensation,
    load.Payload,
    load.BaseTilt,
    load.ExternalContact,
    sensing.TorqueConstantError,
    sensing.TorqueDrift,
    sensing.EncoderOffset,
    sensing.TimeDelay,
    drive.CopperLoss,
    drive.WindingTemperature,
    drive.IronLoss,
    drive.InverterLoss,
    supply.NoRegeneration,
    supply.BusCapacitor,
    supply.HoldingBrakes,
    sensing.MeterLag,
    sensing.MeterGain,
    disturbance.PeriodicDisturbance,
    disturbance.SwitchingLoad,
    local.LocalWear,
    local.JointLimitSpring,
)

BASELINE = tuple(kind.id for kind in _BASELINE)  # the default twin
# What an exciting motion has to show.
EXCITED = (*BASELINE[:2], friction.ViscousFriction.id, friction.CoulombFriction.id, sensing.TorqueOffset.id)


def catalogue() -> dict[str, Effect]:
    """Return every effect that the twin knows, by id, in its default shape.

    An installed package adds its own: an entry point of the group `irtwin.effects` that names a class. ValueError where
    two have one id.
    """
    effects: dict[str, Effect] = {}
    for kind in (*OWN, *_registered()):
        effect = kind()
        if effect.id in effects:
            raise ValueError(f"two effects are called {effect.id}: {type(effects[effect.id])} and {kind}")
        effects[effect.id] = effect
    return effects


@cache
def _registered() -> tuple[type[Effect], ...]:
    points = sorted(entry_points(group=GROUP), key=lambda point: point.name)
    return tuple(point.load() for point in points)
