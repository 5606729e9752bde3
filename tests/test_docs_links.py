"""Links of the README and of the documentation's pages lead somewhere, also where the repository alone is read."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs" / "papers").glob("*.md"))]


def links(page):
    """Targets of the links of a page that stay in the repository."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    return [link for link in re.findall(r"\]\(([^)\s]+)\)", text) if "://" not in link]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    missing = [link for link in links(page) if not (page.parent / link.partition("#")[0]).exists()]
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_examples_that_are_included_exist(page):
    included = re.findall(r"\{literalinclude\} (\S+)", page.read_text(encoding="utf-8"))
    assert all((page.parent / name).is_file() for name in included)


def test_readme_is_short_and_has_its_picture():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) < 120
    assert (ROOT / "docs" / "_static" / "first_fit.png").stat().st_size < 150_000
    assert "docs/_static/first_fit.png" in text


def test_study_files_page_names_every_procedure_and_its_keys():
    from fitting.study.identify_run import known_procedures

    text = (ROOT / "docs" / "study_files.md").read_text(encoding="utf-8")
    missing = [
        f"{name}.{key}" for name, one in known_procedures().items() for key in one.KEYS if f"`{key}`" not in text
    ]
    assert not missing and all(f"`{name}`" in text for name in known_procedures())
