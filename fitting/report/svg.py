"""A drawing that belongs to its page: colours by the page's variables, so that it suits light and dark."""

import re
import xml.etree.ElementTree as ElementTree

from fitting.report.colours import in_page_colour

_COLOUR = re.compile(r"#[0-9a-f]{6}\b")
_FONT = re.compile(r"font(-family)?:[^;]*;?\s*")
# What XML cannot hold, and names from files may.
_FORBIDDEN = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")
_SIZE = re.compile(r"([0-9.]+)px")


def in_page(drawing: str, key: str, alt: str) -> str:
    """A drawing as an element of a page.

    Args:
        drawing: SVG file as matplotlib writes it.
        key: beginning of all names inside it, so that drawings do not meet each other's.
        alt: what is to be seen.
    """
    root = ElementTree.fromstring(_FORBIDDEN.sub("\ufffd", drawing))
    for node in root.iter():
        for child in [child for child in node if _plain(child.tag) in ("metadata", "style")]:
            node.remove(child)
    for node in root.iter():
        node.tag = _plain(node.tag)
        for name in list(node.attrib):
            value = node.attrib.pop(name)
            node.set(_plain(name), _rewritten(_plain(name), value, key))
    box = root.get("viewBox", "")
    root.attrib.clear()
    root.attrib.update({"viewBox": box, "role": "img", "aria-label": alt})
    return ElementTree.tostring(root, encoding="unicode", short_empty_elements=False)


def _plain(name: str) -> str:
    return name.rsplit("}", 1)[-1]


def _rewritten(name: str, value: str, key: str) -> str:
    if name == "id":
        return f"{key}-{value}"
    if name == "href" and value.startswith("#"):
        return f"#{key}-{value[1:]}"
    if name == "style":
        return _COLOUR.sub(lambda match: in_page_colour(match.group(0)), _FONT.sub(_font_size, value))
    return value.replace("url(#", f"url(#{key}-")


def _font_size(match: re.Match) -> str:
    size = _SIZE.search(match.group(0))
    return f"font-size: {size.group(1)}px; " if size else ""
