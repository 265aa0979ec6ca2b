"""Experiments in: folders with `experiment.toml` and record files become checked SI arrays; no physics is known here."""

from identification.experiment.channels import CHANNELS, KINDS, MOTION_CHANNELS, si_unit
from identification.experiment.errors import ExperimentError
from identification.experiment.experiment import Experiment, Load, ParameterOption, Prior, Record, Sensor, Suspension
from identification.experiment.load import load_experiment
from identification.experiment.noise import estimate_noise

__all__ = [
    "CHANNELS",
    "KINDS",
    "MOTION_CHANNELS",
    "Experiment",
    "ExperimentError",
    "Load",
    "ParameterOption",
    "Prior",
    "Record",
    "Sensor",
    "Suspension",
    "estimate_noise",
    "load_experiment",
    "si_unit",
]
