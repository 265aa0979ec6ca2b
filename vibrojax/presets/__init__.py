"""The thesis's rigs as far as they are known; each number says whether it is stated, estimated or assumed."""

from vibrojax.presets.preset import NAMES, Number, Origin, Preset, read_preset

__all__ = ["NAMES", "Number", "Origin", "Preset", "read_preset"]
