#!/usr/bin/env python3
"""Both reports of a drive say the same: each word and figure of report.html is in the one page of report.pdf, as poppler reads it, and the map is drawn.
usage: report_test.py DRIVE"""
import html.parser
import os
import re
import subprocess
import sys


class Page(html.parser.HTMLParser):
    """The texts of the headings, the verdict, the reasons and the cells of the tables."""

    def __init__(self):
        super().__init__()
        self.tags, self.texts, self.within = [], [], []

    def handle_starttag(self, tag, attributes):
        if tag in ("h1", "h2", "p", "li", "th", "td"):
            self.within.append(tag)
            self.tags.append(tag)
            self.texts.append("")

    def handle_endtag(self, tag):
        if self.within and tag == self.within[-1]:
            self.within.pop()

    def handle_data(self, data):
        if self.within:
            self.texts[-1] += data


def run(*command):
    return subprocess.run(command, check=True, capture_output=True).stdout


drive = sys.argv[1]
pdf = drive + "/report.pdf"
squeeze = lambda text: re.sub(r"\s", "", text)
page = Page()
page.feed(open(drive + "/report.html", encoding="utf-8").read())
facts = run("pdfinfo", pdf).decode()
assert re.search(r"Pages: +1\n", facts) and "(A4)" in facts, facts
run("qpdf", "--check", pdf)
printed = squeeze(run("pdftotext", "-raw", pdf, "-").decode())
is_cut = re.search(r"and\d+morein(report.html|summary.json)", printed)
count = 0
for tag, text in zip(page.tags, page.texts):
    # The key of the map has its signs between the words, and what a page does not hold is counted there.
    if not squeeze(text) or "driven only" in text or re.match(r"\d+ more are in", text) or (is_cut and tag == "li"):
        continue
    assert squeeze(text) in printed, f"{text!r} is in report.html only"
    count += 1
assert count > 15, page.texts
# The map has as much colour in both: a line of green somewhere, where points were coloured.
if '<polyline class="coloured"' in open(drive + "/report.html").read():
    pixels = run("pdftoppm", "-r", "72", pdf)
    pixels = pixels[pixels.index(b"255\n") + 4 :]
    green = sum(1 for i in range(0, len(pixels) - 2, 3) if pixels[i] < 60 and 100 < pixels[i + 1] < 160 and pixels[i + 2] < 100)
    assert green > 30, green
assert os.path.getsize(pdf) < 1_000_000
print(f"{count} texts of report.html are in report.pdf")
