"""Numbers as a reader wants them: as many digits as their standard error supports."""

import math

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# Powers of ten that are written out.
_LEAST, _MOST = -3, 5


def plain(value: float, digits: int = 4) -> str:
    """A number with some significant digits.

    Args:
        value: the number.
        digits: significant digits.
    """
    if not math.isfinite(value):
        return _not_finite(value)
    if value == 0:
        return "0"
    power = _power(value, digits)
    if _LEAST <= power < _MOST:
        return _fixed(value, max(digits - 1 - power, 0))
    return f"{_fixed(value / 10.0**power, digits - 1)}·10{str(power).translate(_SUPERSCRIPTS)}"


def given(value: float) -> str:
    """A number that somebody chose, without zeros at its end.

    Args:
        value: the number.
    """
    text = plain(value, 6)
    mantissa, point, rest = text.partition("·")
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    return f"{mantissa}{point}{rest}"


def with_error(value: float, error: float) -> str:
    """A number and its standard error, which has two digits.

    Args:
        value: the number.
        error: its standard error; NaN where there is none.
    """
    if not (math.isfinite(value) and math.isfinite(error) and error > 0):
        return plain(value)
    return together((value, error), error, "{} ± {}")


def together(values: tuple[float, ...], error: float, form: str) -> str:
    """Several numbers of the same size, rounded where a standard error of two digits ends.

    Args:
        values: the numbers.
        error: the standard error.
        form: how to write them, such as "{} ± {}".
    """
    finite = [abs(v) for v in values if math.isfinite(v)]
    if not (math.isfinite(error) and error > 0 and finite):
        return form.format(*(plain(v) for v in values))
    last = _power(error, 2) - 1
    power = _power(max(*finite, error), 2)
    if _LEAST <= power < _MOST and last < 3:
        return form.format(*(_fixed(v, max(-last, 0)) for v in values))
    parts = [_fixed(v / 10.0**power, max(power - last, 0)) for v in values]
    return f"({form.format(*parts)})·10{str(power).translate(_SUPERSCRIPTS)}"


def percent(share: float) -> str:
    """A share in per cent, with two significant digits, or three above ten.

    Args:
        share: the share, 1 being 100 %.
    """
    value = 100 * share
    return f"{plain(value, 3 if abs(value) >= 10 else 2)} %"


def _power(value: float, digits: int) -> int:
    """Power of ten of the first digit, after rounding."""
    return int(f"{abs(value):.{digits - 1}e}".split("e")[1])


def _fixed(value: float, decimals: int) -> str:
    if not math.isfinite(value):
        return _not_finite(value)
    text = f"{value:.{decimals}f}"
    # No minus before nothing.
    return text.replace("-", "−") if float(text) != 0 else text.lstrip("-")


def _not_finite(value: float) -> str:
    return "–" if math.isnan(value) else ("∞" if value > 0 else "−∞")
