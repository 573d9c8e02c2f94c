"""What of a twin its runs left open, or deny, and what would cure it: a line each."""

from __future__ import annotations

from collections.abc import Iterator

from irtwin.document.odd_stretch import odd
from irtwin.twin.twin import Twin

_CONTRADICTED = 0.01  # of a joint's torque, RMS: by less, consistent bodies are as good as any
_OTHER_UNITS = 3.0  # times: phases that are counted or not, and warm windings, make no more of a data sheet's number


def doubts(twin: Twin) -> tuple[str, ...]:
    """Return what is to be said of a twin."""
    return (
        *_of_stretches(twin),
        *_of_motion(twin),
        *_of_description(twin),
        *_of_bodies(twin),
        *_of_data_sheet(twin),
    )


def _of_stretches(twin: Twin) -> Iterator[str]:
    """Yield where runs show something beside the robot's own torque."""
    if where := odd(twin.odd_stretches):
        yield (
            f"the twin leaves over six times as much torque as elsewhere in {where}, which counts for little: look "
            "there for a contact, a load or a channel that dropped out"
        )


def _of_bodies(twin: Twin) -> Iterator[str]:
    """Yield that no physically consistent bodies give the measured torque, where none do."""
    if twin.body_change is not None and twin.body_change >= _CONTRADICTED:
        yield (
            "no physically consistent bodies give the measured torque: theirs differs from the best fit's by up to "
            f"{100 * twin.body_change:.2g} % of a joint's (RMS); an effect may be lacking, or a joint of the URDF wrong"
        )


def _of_motion(twin: Twin) -> Iterator[str]:
    """Yield which joints no run moves enough to show what rubs there, where torque was fitted."""
    rubs = {effect.id for effect in twin.stack.effects if effect.family == "friction"}
    shown = {
        parameter.joint for parameter in twin.parameters if parameter.effect in rubs and parameter.lower is not None
    }
    still = [name for name in twin.robot.joint_names if rubs and twin.base_parameters and name not in shown]
    if still:
        yield (
            f"the runs hardly move {', '.join(still)}, so nothing of friction and little of bodies is known there; log "
            "runs that do (`irtwin robot excite` designs one)"
        )


def _of_description(twin: Twin) -> Iterator[str]:
    """Yield that a robot's description has no inertias."""
    if twin.base_parameters and not any(inertia.mass > 0 for inertia in twin.robot.model.inertias):
        yield (
            "the robot's description has no inertias, and torque tells sums of them alone: masses and centres of "
            "single links are guesses; give <inertial> in the URDF where these are used"
        )


def _of_data_sheet(twin: Twin) -> Iterator[str]:
    """Yield numbers of drives that the runs deny."""
    parameters = {
        (parameter.effect, parameter.joint, parameter.name): parameter
        for parameter in twin.parameters
        if not parameter.link
    }
    for effect, term in (*twin.stack.torque_terms, *twin.stack.power_terms):
        fitted = parameters.get((effect.id, term.joint, term.name))
        if fitted is None or fitted.joint is None or fitted.lower is None or fitted.upper is None or term.expected <= 0:
            continue
        if fitted.upper * _OTHER_UNITS < term.expected or fitted.lower > _OTHER_UNITS * term.expected:
            stated = f"{term.expected:.3g} {term.unit}"
            logged = f"{fitted.value:.3g} ({fitted.lower:.3g} to {fitted.upper:.3g})"
            yield (
                f"{fitted.joint}: the data sheet says {fitted.name} is {stated}, the runs {logged}; one of both is "
                f"wrong: mend [robot.joint.{fitted.joint}] in dataset.toml, or look for what the log lacks"
            )
