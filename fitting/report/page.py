"""The page: a report as one HTML file that needs nothing else."""

import re
from pathlib import Path

from fitting.report.colours import variables
from fitting.report.content import Figure, Report, Section
from fitting.report.drawing import drawn
from twin.io._whole_file import whole_file

_HERE = Path(__file__).parent


def write_report(path: str | Path, report: Report) -> Path:
    """Write a report as one HTML page, whole or not at all.

    Args:
        path: file to write; its folder exists.
        report: what to write.

    Returns:
        The file.

    Raises:
        InputError: the folder does not exist.
    """
    with whole_file(path) as temporary:
        temporary.write_text(page_of(report), encoding="utf-8", errors="replace", newline="\n")
    return Path(path)


def page_of(report: Report) -> str:
    """The page as text. The same report gives the same text.

    Args:
        report: what to show.
    """
    import jinja2

    templates = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_HERE),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters["breakable"] = _breakable
    sections = (report.asked, *report.sections)
    return templates.get_template("page.html.j2").render(
        report=report,
        sections=[_shown(i, section) for i, section in enumerate(sections, start=1)],
        light=variables(dark=False),
        dark=variables(dark=True),
    )


def _shown(number: int, section: Section) -> dict[str, object]:
    return {
        "key": f"s{number}",
        "content": section,
        "paragraphs": [part.strip() for part in section.text.split("\n\n") if part.strip()],
        "figures": [_variants(f"s{number}f{i}", figure) for i, figure in enumerate(section.figures)],
    }


def _variants(key: str, figure: Figure) -> dict[str, object]:
    """The figure with its pictures, by the screens that they are for."""
    from markupsafe import Markup

    screens = ("broad", "narrow") if figure.wide else ("all",)
    pictures = [(screen, Markup(drawn(figure, screen, f"{key}{screen[0]}"))) for screen in screens]
    return {"content": figure, "pictures": pictures}


def _breakable(name: str) -> str:
    """A long name that may be broken behind its dots and underscores."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"([._])", r"\1<wbr>", str(escape(name))))
