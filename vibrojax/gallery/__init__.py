"""All figures of one model or preset, made in one go, on one page."""

from vibrojax.gallery.make import make_gallery
from vibrojax.gallery.plates import Plate, model_plates, preset_plates

__all__ = ["Plate", "make_gallery", "model_plates", "preset_plates"]
