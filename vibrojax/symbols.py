"""The thesis's symbols at the axes of figures, the same in every figure."""

SYMBOLS = {
    "frequency_hz": r"excitation frequency $\Omega$",
    "frequency": r"excitation frequency $\Omega$",
    "ratio": r"frequency ratio $\Omega/\omega$",
    "clearance": r"gap over amplitude gap$/A_0$",
    "gap": "gap",
    "base_amplitude": "amplitude of the cart $A_0$",
    "amplitude": "amplitude of the cart $A_0$",
    "mass_ratio": "mass over that of the model",
    "m": "mass of the hammer $m$",
    "f_n": r"natural frequency $\omega$",
    "zeta": r"damping ratio $\zeta$",
    "k_i": "impact stiffness $k_i$",
    "n": "impact exponent $n$",
    "lambda_i": r"impact damping $\lambda_i$",
}
"""What stands at an axis, by the name in the data set; a name that is not listed has its meaning there."""
FORCE, FORCE_OF_CYCLE, FORCE_OVER_WEIGHT = "largest $F_i$ (N)", "largest $F_i$ of a cycle (N)", r"$F_i/(m\,g)$"
AT_STROBES = "$u$ at the strobes (mm)"
RATIO = r"$\Omega/\omega$"


def short(name: str) -> str:
    """Symbol of an axis or parameter, for legends.

    Example:
        >>> short("k_i"), short("gap")
        ('$k_i$', 'gap')
    """
    return "$" + SYMBOLS[name].partition("$")[2] if "$" in SYMBOLS.get(name, "") else name
