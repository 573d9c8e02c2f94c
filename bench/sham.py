"""Data sets in which nothing is missing: what a twin says of the same motions, with residuals of real ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from irtwin.signals.conditioning import condition
from irtwin.signals.log import DataSet, Run
from irtwin.signals.motion import Motion
from irtwin.twin.twin import Twin

BLOCK = 2.0  # s; residuals of measured robots remember 0.1 to 1.8 s (autocorrelation above 0.1)


def sham(
    data_set: DataSet, truth: Twin, full: Twin, seed: int, *, block: float = BLOCK, centred: bool = False
) -> DataSet:
    """Return the data set as it would be if the robot were the twin `truth` and nothing else.

    Torque and power become what `truth` predicts plus the residual of the twin `full`, resampled within each run by
    a circular block bootstrap (Politis and Romano 1992) of blocks of `block` seconds, all joints and power alike:
    autocorrelation and correlation between joints are kept, the tie to the motion is cut. `centred` takes each run's
    mean residual out: by it runs differ, which is no noise within them.
    """
    generator = np.random.default_rng(seed)
    runs = tuple(_sham(run, truth, full, generator, block, centred) for run in data_set.runs)
    return replace(data_set, robot=truth.robot, runs=runs, effects=truth.effect_ids)


def circular_blocks(count: int, length: int, generator: np.random.Generator) -> np.ndarray:
    """Return (count,) indices: stretches of `length` from random starts, the end joined to the start."""
    starts = generator.integers(count, size=-(-count // length))
    return ((starts[:, None] + np.arange(length)) % count).ravel()[:count]


def _sham(run: Run, truth: Twin, full: Twin, generator: np.random.Generator, block: float, centred: bool) -> Run:
    signals, motion = run.signals, condition(run, truth.robot, truth.cutoff)
    step = float(np.median(np.diff(signals.time)))
    place = circular_blocks(len(signals.time), max(1, round(block / step)), generator)
    torque, power = signals.torque, signals.power
    if torque is None and signals.current is not None:
        torque = signals.current * [joint.torque_constant for joint in truth.robot.joints]
    if torque is not None:
        residual = torque - _at(signals.time, motion, full.torque(motion))
        torque = _at(signals.time, motion, truth.torque(motion)) + _drawn(residual, place, centred)
    if power is not None:
        left = power - _at(signals.time, motion, full.power(motion))
        power = _at(signals.time, motion, truth.power(motion)) + _drawn(left, place, centred)
    return replace(run, signals=replace(signals, torque=torque, current=None, power=power))


def _drawn(residual: np.ndarray, place: np.ndarray, centred: bool) -> np.ndarray:
    drawn = residual[place]
    return drawn - drawn.mean(axis=0) if centred else drawn


def _at(time: np.ndarray, motion: Motion, values: np.ndarray) -> np.ndarray:
    """Return a twin's prediction at the times of the log."""
    if values.ndim == 1:
        return np.interp(time, motion.time, values)
    return np.column_stack([np.interp(time, motion.time, column) for column in values.T])
