"""Numbers as text writes them, with decimal point or comma."""

import re

DECIMALS = (".", ",")
_NUMBERS = {
    mark: re.compile(rf"[-+]?(?:\d+(?:\{mark}\d*)?|\{mark}\d+)(?:[eE][-+]?\d+)?|[-+]?(?:nan|inf|infinity)", re.IGNORECASE)
    for mark in DECIMALS
}


def is_number(cell: str, decimal: str) -> bool:
    """Say whether a cell is a number.

    Args:
        cell: text without surrounding blanks.
        decimal: the decimal mark, "." or ",".

    Returns:
        Whether it is one; "nan" and "inf" are.

    Example:
        >>> is_number("-1,5e-3", ","), is_number("1_0", "."), is_number("1.234,5", ",")
        (True, False, False)
    """
    return cell.isascii() and _NUMBERS[decimal].fullmatch(cell) is not None


def to_number(cell: str, decimal: str) -> float | None:
    """Read a number; None where the cell is none.

    Args:
        cell: text without surrounding blanks.
        decimal: the decimal mark, "." or ",".

    Returns:
        The number.
    """
    if not is_number(cell, decimal):
        return None
    return float(cell.replace(",", ".") if decimal == "," else cell)
