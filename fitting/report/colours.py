"""Colours of the page, light and dark: few, and all by name."""

PALETTE = ("#2563a8", "#c2621b", "#3a7d44", "#b3343a", "#7553a6", "#1f8a8a", "#8a6d1f", "#a64d79")
"""Colours of lines in turn on a light page; the page calls them --c0, --c1, ..."""
_ON_DARK = ("#74aae6", "#e8a15f", "#7fc48d", "#f08a8c", "#b79ce6", "#62c6c6", "#d0b35c", "#e08fb8")
_LIGHT = ((0x1C, 0x20, 0x26), (0xFF, 0xFF, 0xFF))
_DARK = ((0xE9, 0xEB, 0xEE), (0x17, 0x1A, 0x1F))
_STEP = 5


def variables(dark: bool) -> dict[str, str]:
    """The page's colours by name: lines --c0, --c1, ...; greys from the ink --g0 to the paper --g100.

    Args:
        dark: whether for a dark page.
    """
    ink, paper = _DARK if dark else _LIGHT
    found = {f"--c{i}": colour for i, colour in enumerate(_ON_DARK if dark else PALETTE)}
    for percent in range(0, 101, _STEP):
        mixed = (round(a + (b - a) * percent / 100) for a, b in zip(ink, paper, strict=True))
        found[f"--g{percent}"] = "#" + "".join(f"{part:02x}" for part in mixed)
    return found


def in_page_colour(colour: str) -> str:
    """What a colour of a drawing is called in the page; unknown ones stay.

    Args:
        colour: six hexadecimal digits after a #.
    """
    if colour in PALETTE:
        return f"var(--c{PALETTE.index(colour)})"
    if colour[1:3] == colour[3:5] == colour[5:7]:
        return f"var(--g{_STEP * round(int(colour[1:3], 16) / 255 * 100 / _STEP)})"
    return colour
