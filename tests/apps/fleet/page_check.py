#!/usr/bin/env python3
"""Reads a page of a fleet with an HTML parser: its elements are closed, it needs nothing from elsewhere, and its links lead to files.

usage: page_check.py PAGE DRIVES REPORTS LINES   (how many drives are in its table, have a report, and are on its maps)
"""
import html.parser, os, sys, urllib.parse

path, (drives, reports, lines) = sys.argv[1], map(int, sys.argv[2:5])
EMPTY = {"meta", "path", "circle", "line", "rect", "i"}  # i stands closed, too


class Page(html.parser.HTMLParser):
    def __init__(self):
        super().__init__(convert_charrefs=True)
        self.open, self.links, self.rows, self.lines, self.title, self.section = [], [], {}, 0, "", ""

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        assert not {"src", "onload", "onclick"} & set(attributes), (tag, attributes)
        assert tag != "script"
        if tag == "a":
            self.links.append(attributes["href"])
        self.lines += tag == "polyline"
        if tag == "tr":
            self.rows[self.section] = self.rows.get(self.section, 0) + 1
        if tag not in EMPTY or tag == "i":
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        assert "src" not in dict(attributes)

    def handle_endtag(self, tag):
        assert self.open and self.open.pop() == tag, (tag, self.open)

    def handle_data(self, data):
        if self.open and self.open[-1] == "h2":
            self.section = data


page = Page()
page.feed(open(path, encoding="utf-8").read())
page.close()
assert page.open == [], page.open
assert page.rows["Verdicts"] == drives + 1, page.rows
assert page.lines == lines, page.lines
for link in page.links:
    file = os.path.join(os.path.dirname(path), urllib.parse.unquote(link))
    assert os.path.isfile(file) and not urllib.parse.urlsplit(link).scheme, link
assert len(page.links) == reports, page.links
