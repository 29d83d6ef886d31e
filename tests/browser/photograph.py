#!/usr/bin/env python3
"""photograph.py PAGE OUT.png: three views of a preview page side by side, without the page around them."""

import sys

from webdriver import Browser, read_png, write_png

WIDTH, HEIGHT = 460, 480
VIEWS = ["part", "tree", "paths"]


def main(page, out):
    pictures = []
    with Browser() as browser:
        browser.size(WIDTH, HEIGHT)
        browser.open(page)
        browser.wait("window.curvesup && window.curvesup.ready")
        browser.run("""for (const id of ['panel', 'legend', 'buttons', 'note']) document.getElementById(id).style.display = 'none';
            document.querySelector('header').style.display = 'none'; document.getElementById('stage').style.height = '100%';
            const marks = document.getElementById('show-marks'); if (marks) marks.click();""")
        browser.wait(f"document.getElementById('canvas').clientHeight === {HEIGHT}")
        browser.run("document.getElementById('home').click()")
        for view in VIEWS:
            browser.run("const b = document.getElementById('preset-' + arguments[0]); if (b) b.click();", view)
            if view == "paths":
                browser.slide("#time", 0.66)
            browser.settle()
            pictures.append(read_png(browser.picture(WIDTH, HEIGHT)))
    rows = [b"".join(picture[2][y] for picture in pictures) for y in range(HEIGHT)]
    with open(out, "wb") as file:
        file.write(write_png(WIDTH * len(pictures), HEIGHT, rows))


if __name__ == "__main__":
    main(*sys.argv[1:])
