"""A check of HTML pages: every tag closed, every link and picture inside."""

from html.parser import HTMLParser

VOID = {"meta", "img", "br", "link", "input"}


class Checker(HTMLParser):
    """Follows open tags and collects what a page loads."""

    def __init__(self):
        super().__init__()
        self.open = []
        self.loaded = []
        self.anchors = set()
        self.links = []

    def handle_starttag(self, tag, attrs):
        values = {name: value or "" for name, value in attrs}
        self.loaded += [values["src"]] if "src" in values else []
        self.links += [values["href"]] if "href" in values else []
        self.anchors |= {values["id"]} if "id" in values else set()
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def checked(page):
    checker = Checker()
    checker.feed(page)
    assert checker.open == []
    return checker
