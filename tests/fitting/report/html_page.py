"""A page taken apart, for tests of reports."""

from html.parser import HTMLParser

VOID = {"meta", "br", "wbr", "hr", "img", "link", "input"}


class Page(HTMLParser):
    """Looks whether every element ends where it should, and keeps what starts."""

    def __init__(self, text):
        super().__init__()
        self.open, self.seen = [], []
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.seen.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open and self.open[-1] == tag, (tag, self.open, self.getpos())
        self.open.pop()

    def handle_startendtag(self, tag, attrs):
        self.seen.append((tag, dict(attrs)))

    def all(self, tag):
        """Attributes of all elements of a kind."""
        return [attrs for name, attrs in self.seen if name == tag]
