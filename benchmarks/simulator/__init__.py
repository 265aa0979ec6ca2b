"""Experiments from an independent simulator: it shares no line with the program that is to analyse them.

Hammer and cart move in absolute coordinates, the classical Runge-Kutta method takes fixed steps of 1 us wherever the stop is near, the
contact switch is hard, and the sensor chain (white noise, 16-bit converter) is its own. What a rig can conceal is listed in `effects/`.
"""

from benchmarks.simulator.case import Case, Order, draw_case, write_case
from benchmarks.simulator.effects import EFFECTS, LISTED, UNLISTED
from benchmarks.simulator.experiment import RecordPlan, draw_plan, simulate
from benchmarks.simulator.folder import write_experiment
from benchmarks.simulator.hidden import Hidden
from benchmarks.simulator.rig import KINDS, Rig, draw_rig
from benchmarks.simulator.sensors import Sensor, standard_sensors
from benchmarks.simulator.unrest import UNREST

__all__ = [
    "EFFECTS",
    "KINDS",
    "LISTED",
    "UNLISTED",
    "UNREST",
    "Case",
    "Hidden",
    "Order",
    "RecordPlan",
    "Rig",
    "Sensor",
    "draw_case",
    "draw_plan",
    "draw_rig",
    "simulate",
    "standard_sensors",
    "write_case",
    "write_experiment",
]
