"""Experiments in: folders with `experiment.toml` and record files become checked SI arrays; no physics is known here."""

from identification.experiment.channels import CHANNELS, MOTION_CHANNELS, si_unit
from identification.experiment.errors import ExperimentError
from identification.experiment.experiment import Experiment, Load, ParameterOption, Record, Sensor, Suspension
from identification.experiment.load import load_experiment

__all__ = [
    "CHANNELS",
    "MOTION_CHANNELS",
    "Experiment",
    "ExperimentError",
    "Load",
    "ParameterOption",
    "Record",
    "Sensor",
    "Suspension",
    "load_experiment",
    "si_unit",
]
