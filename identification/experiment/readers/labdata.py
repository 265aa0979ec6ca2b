"""The libraries behind recorders' own formats: an extra of the package, loaded only when such a file is read."""

import importlib
import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

from identification.experiment.errors import ExperimentError

INSTALL = 'pip install "vibrojax[labdata]"'


def load_library(name: str, kind: str) -> ModuleType:
    """Import the library that reads a format.

    Args:
        name: of the module.
        kind: the format, for the message.

    Returns:
        The module.

    Raises:
        ExperimentError: it is not installed; the message says how to install it.

    Example:
        >>> load_library("no_such_library", "TDMS")
        Traceback (most recent call last):
        identification.experiment.errors.ExperimentError: TDMS files need the package no_such_library, which is not installed: \
run pip install "vibrojax[labdata]", or export the record to .csv, .h5, .mat or .npz
    """
    try:
        with silenced(name):
            return importlib.import_module(name)
    except ImportError as error:
        raise ExperimentError(
            f"{kind} files need the package {name}, which is not installed: run {INSTALL}, or export the record to .csv, .h5, .mat or .npz"
        ) from error


@contextmanager
def silenced(name: str) -> Iterator[None]:
    """A block in which a library logs nothing, nor reports errors while its half-made objects are thrown away.

    What is wrong with a file is said once, by the reader.

    Args:
        name: of the library.
    """
    logger, hook = logging.getLogger(name), sys.unraisablehook
    before = logger.disabled, logger.level, [(child, child.disabled) for child in _children(name)]
    try:
        sys.unraisablehook = lambda unraisable: None
        logger.disabled = True
        for child, _ in before[2]:
            child.disabled = True
        yield
    finally:
        sys.unraisablehook = hook
        logger.disabled = before[0]
        for child, disabled in before[2]:
            child.disabled = disabled


def _children(name: str) -> list[logging.Logger]:
    """The loggers of a library's modules."""
    loggers = list(logging.Logger.manager.loggerDict.items())
    return [one for key, one in loggers if key.startswith(f"{name}.") and isinstance(one, logging.Logger)]
