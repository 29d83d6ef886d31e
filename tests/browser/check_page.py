#!/usr/bin/env python3
"""check_page.py PAGE STORED.png ACTUAL.png: opens a preview page in a real browser and proves that it works.

Exit code 77 when there is no Chromium. Writes the picture that is compared with the stored one to ACTUAL.png.
"""

import base64
import math
import sys

from webdriver import Browser, chromium, different_pixels, read_png

WIDTH, HEIGHT = 800, 600
failures = []


def expect(holds, message):
    if not holds:
        failures.append(message)


def canvas(browser):
    """What is drawn: the part of the page under the canvas, at half size."""
    browser.settle()
    return read_png(browser.picture(WIDTH, HEIGHT, 0.5))


def bare(browser, on):
    """With or without everything around the canvas."""
    browser.run("""for (const id of ['panel', 'legend', 'buttons', 'note']) document.getElementById(id).style.display = arguments[0] ? 'none' : '';
        document.querySelector('header').style.display = arguments[0] ? 'none' : ''; window.dispatchEvent(new Event('resize'));""", on)
    browser.wait(f"document.getElementById('canvas').clientWidth {'===' if on else '<'} {WIDTH}")


def share(picture, holds):
    width, height, rows = picture
    found = sum(1 for row in rows for x in range(0, 3 * width, 3) if holds(row[x], row[x + 1], row[x + 2]))
    return found / (width * height)


def check_drawing(browser):
    picture = canvas(browser)
    drawn = share(picture, lambda r, g, b: abs(r - 0xf6) + abs(g - 0xf8) + abs(b - 0xfb) > 30)
    expect(drawn > 0.05, f"the canvas is blank: {100 * drawn:.2f} % of it differ from the background")
    expect(share(picture, lambda r, g, b: b > r + 25) > 0.02, "the part is not to be seen")
    expect(share(picture, lambda r, g, b: r > b + 60) > 0.002, "support and overhang are not to be seen")
    return picture


def check_slider(browser, before):
    browser.run("document.getElementById('preset-layers').click()")
    layers = canvas(browser)
    expect(different_pixels(before, layers) > 0.005, "layers look like the part")
    first, last = browser.run("const l = document.getElementById('layer'); return [Number(l.min), Number(l.max)]")
    expect(first == -3, f"the first layer of support is {first}, not -3")
    browser.slide("#layer", last // 2)
    half = canvas(browser)
    expect(different_pixels(layers, half) > 0.005, "the layer slider changes nothing")
    browser.run("document.getElementById('only').click()")
    only, orange = canvas(browser), lambda r, g, b: r > b + 60
    expect(0 < share(only, orange) < 0.4 * share(half, orange), "showing only one layer does not hide the others")
    browser.run("document.getElementById('only').click()")
    browser.slide("#layer", last)


def check_screenshot(browser, shown):
    """The picture button saves what is shown."""
    saved = browser.run("""let saved; const click = HTMLAnchorElement.prototype.click;
        HTMLAnchorElement.prototype.click = function () { saved = [this.href, this.download]; };
        document.getElementById('shot').click(); HTMLAnchorElement.prototype.click = click; return saved;""")
    expect(saved and saved[1] == "block.png", f"the saved picture is called {saved and saved[1]}")
    picture = read_png(base64.b64decode(saved[0].split(",")[1]))
    expect(picture[:2] == (WIDTH, HEIGHT), f"the saved picture has {picture[0]} x {picture[1]} pixels")
    blue = lambda r, g, b: b > r + 25
    expect(abs(share(picture, blue) - share(shown, blue)) < 0.01, "the saved picture shows something else")


def check_travel(browser):
    """Travel moves are drawn; while the print goes on only the latest of them, and the legend says so."""
    def shown(time):
        browser.run("document.getElementById('preset-paths').click()")
        browser.slide("#time", time)
        browser.run("for (const m of ['model', 'support']) document.getElementById(`show-${m}_paths`).click()")  # they hide short moves
        without = canvas(browser)
        browser.run("document.getElementById('show-travel').click()")
        picture, legend = canvas(browser), browser.run("return document.getElementById('legend').textContent")
        browser.run("document.getElementById('show-travel').click()")
        return different_pixels(without, picture), legend

    (recent, during), (every, after) = shown(0.95), shown(1)
    expect(every > 2e-4, f"travel moves cover {every:.6f} of the picture")
    expect(recent < 0.5 * every, f"travel moves cover {recent:.6f} of the picture during the print and {every:.6f} after it")
    expect("travel of the last" in during and "travel" in after and "last" not in after, f"the legend says of travel moves: {during}, {after}")
    browser.run("document.getElementById('preset-paths').click()")


def check_print(browser):
    browser.run("document.getElementById('preset-paths').click()")
    whole = canvas(browser)
    expect(share(whole, lambda r, g, b: b > r + 25) > 0.01, "toolpaths are not to be seen")
    check_screenshot(browser, whole)
    browser.slide("#time", 0.3)
    expect(different_pixels(whole, canvas(browser)) > 0.005, "the time slider changes nothing")
    before = browser.run("return window.curvesup.state.time")
    browser.run("document.getElementById('play').click()")
    browser.wait(f"window.curvesup.state.time > {before}")
    browser.run("document.getElementById('play').click()")
    check_travel(browser)
    browser.slide("#time", 1)
    browser.run("const c = document.getElementById('colour'); c.value = 'order'; c.dispatchEvent(new Event('change'))")
    expect(different_pixels(whole, canvas(browser)) > 0.005, "another colouring changes nothing")
    browser.run("document.getElementById('preset-tree').click()")
    tree = canvas(browser)
    expect(different_pixels(whole, tree) > 0.005, "the tree looks like the toolpaths")
    expect(share(tree, lambda r, g, b: b < 0.75 * r) < 0.3 and share(tree, lambda r, g, b: max(r, g, b) < 140) > 0.0005, "the tree is not to be seen")
    browser.run("document.getElementById('preset-overhang').click()")
    expect(share(canvas(browser), lambda r, g, b: r > 2 * g) > 0.005, "the overhang is not to be seen from below")
    browser.run("document.getElementById('preset-part').click()")


def check_keys(browser, before):
    browser.run("document.getElementById('canvas').focus()")
    browser.keys("x")
    expect(different_pixels(before, canvas(browser)) > 0.005, "the key x cuts nothing open")
    browser.keys("xxx")
    expect(different_pixels(before, canvas(browser)) < 0.002, "the cut does not close again")


def check_flight(browser):
    scene = browser.run("return JSON.parse(document.getElementById('scene').textContent).checks.filter((c) => !c.ok)")
    place = scene[0]["places"][0]["at"]
    before = browser.run("return window.curvesup.camera()")
    browser.click(".check.bad")
    browser.settle()
    after = browser.run("return window.curvesup.camera()")
    expect(math.dist(after["target"], place) < 0.01, f"a click on a failed check looks at {after['target']}, not at {place}")
    expect(after["distance"] < before["distance"], "a click on a failed check does not come nearer")
    expect(browser.run("return document.getElementById('note').textContent") != "", "the place of a failed check has no text")
    state = browser.run("return {time: window.curvesup.state.time, paths: window.curvesup.state.show.model_paths}")
    times = browser.run("return window.curvesup.pathTimes(7)")
    expect(state["paths"] and times[0] <= state["time"] <= times[1], f"a collision on path 7, laid from {times[0]} s to {times[1]} s, shows the print at {state['time']} s")
    browser.slide("#time", 1)
    browser.run("document.getElementById('preset-part').click(); document.getElementById('home').click()")
    browser.settle()


def check_report(browser):
    checks = browser.run("return JSON.parse(document.getElementById('scene').textContent).checks.length")
    browser.click("#tab-report")
    rows = browser.run("return document.querySelectorAll('#report table.checks tr').length")
    expect(rows == checks + 1, f"{rows - 1} of {checks} checks are in the report")
    expect(browser.run("return document.querySelectorAll('#report .bad-back').length") == 1, "the failed check is not red")
    expect(browser.run("return [...document.images].length > 0 && [...document.images].every((i) => i.naturalWidth > 0)"),
           "a plot does not show")
    browser.click("#tab-view")


def check_phone(browser):
    browser.size(390, 844)
    browser.settle()
    for tab in ("#tab-report", "#tab-view"):
        browser.click(tab)
        wide = browser.run("return Math.max(document.documentElement.scrollWidth, document.getElementById('report').scrollWidth)")
        expect(wide <= 390, f"{tab} is {wide} pixels wide on a phone")
    browser.click("#help")
    below = browser.run("return document.getElementById('keys').getBoundingClientRect().bottom - document.getElementById('stage').getBoundingClientRect().bottom")
    expect(below <= 0, f"the list of keys reaches {below} pixels out of the picture on a phone")
    browser.click("#help")
    shown = browser.run("return window.curvesup.camera().distance")
    browser.run("document.getElementById('home').click()")
    browser.settle()
    fitted = browser.run("return window.curvesup.camera().distance")
    expect(abs(shown / fitted - 1) < 0.01, f"a page that becomes smaller shows the part from {shown} mm, and it fits from {fitted} mm")
    browser.size(WIDTH, HEIGHT)
    browser.settle()


def check_detail(browser):
    """Slow frames lower the detail, fast ones raise it again."""
    lowered = browser.run("for (let i = 0; i < 40; ++i) window.curvesup.adapt(200); return window.curvesup.state.quality")
    expect(lowered >= 3, f"slow frames leave the detail at level {lowered}")
    segments, triangles, ends, valid = browser.run("""
        const n = 100, vertices = new Uint16Array(3 * n * n), index = [];
        for (let j = 0; j < n; ++j) for (let i = 0; i < n; ++i) {
          vertices.set([600 * i, 600 * j, 30000], 3 * (n * j + i));
          if (i + 1 < n && j + 1 < n) index.push(n * j + i, n * j + i + 1, n * j + i + n, n * j + i + 1, n * j + i + n + 1, n * j + i + n);
        }
        const half = 6 * Math.floor(index.length / 12);
        const few = window.curvesup.fewTriangles(vertices, new Uint32Array(index), [half, index.length], 1000);
        const chains = window.curvesup.fewChains(new Uint32Array([1000, 2, 500, 700]), 100);
        return [chains.index.length / 2, few.index.length / 3, few.ends, few.index.every((v) => v < n * n)];""")
    expect(20 <= segments <= 150, f"2200 segments become {segments} instead of about 100")
    expect(300 <= triangles <= 2000 and valid, f"19602 triangles become {triangles} instead of about 1000")
    expect(len(ends) == 2 and 0 < ends[0] < ends[1] == 3 * triangles, f"the parts of the fewer triangles end at {ends}")
    raised = browser.run("for (let i = 0; i < 900; ++i) window.curvesup.adapt(4); return window.curvesup.state.quality")
    expect(raised == 0, f"fast frames leave the detail at level {raised}")


def check_frames(browser):
    """A machine that needs too long for a frame gets less to draw until 30 frames a second hold, and no less than that. The
    page's clock is replaced, so the machine that runs the test does not matter."""
    browser.settle()
    slow, fast, crawl = browser.run("""
        const now = performance.now, ask = window.requestAnimationFrame, canvas = document.getElementById('canvas');
        let clock = performance.now() + 1e4, waiting = null;
        performance.now = () => clock;
        window.requestAnimationFrame = (frame) => { waiting = frame; return 0; };
        // Turning the wheel for so many frames; a frame takes what the level costs.
        const drive = (frames, cost) => {
          const levels = [];
          for (let i = 0; i < frames; ++i) {
            canvas.dispatchEvent(new WheelEvent('wheel', {deltaY: i % 2 ? 1 : -1, cancelable: true}));
            clock += cost[window.curvesup.state.quality];
            levels.push(window.curvesup.state.quality);
            waiting(clock);
          }
          return levels;
        };
        window.curvesup.state.quality = 0;
        const slow = drive(24, [140, 90, 60, 25, 8]), fast = drive(80, [4, 4, 4, 4, 4]);
        const crawl = drive(60, [400, 300, 200, 100, 60, 20]);
        clock += 1e4;
        for (let i = 0; i < 50 && !window.curvesup.still(); ++i) waiting(clock += 16);
        performance.now = now;
        window.requestAnimationFrame = ask;
        return [slow, fast, crawl];""")
    expect(slow[0] == 0 and slow[12] == 3, f"after twelve slow frames the detail is at level {slow[12]}")
    expect(all(level == 3 for level in slow[12:]), f"the detail does not stay where 30 frames a second hold: {slow[12:]}")
    expect(crawl[-1] == 5, f"on a very slow machine the detail stays at level {crawl[-1]}")
    expect(fast[-1] < 3, "fast frames do not raise the detail again")
    browser.run("document.getElementById('home').click()")
    browser.settle()


def main(page, stored, actual):
    if chromium() is None:
        print("chromium and chromedriver are not installed")
        return 77
    with Browser() as browser:
        browser.size(WIDTH, HEIGHT)
        browser.open(page)
        browser.wait("window.curvesup && window.curvesup.ready")
        bare(browser, True)
        browser.run("document.getElementById('home').click()")
        first = check_drawing(browser)
        with open(actual, "wb") as file:
            file.write(browser.picture(WIDTH, HEIGHT, 0.5))
        with open(stored, "rb") as file:
            off = different_pixels(first, read_png(file.read()))
        expect(off < 0.02, f"{100 * off:.2f} % of the picture differ from {stored}; the new one is {actual}")
        check_slider(browser, first)
        check_print(browser)
        check_keys(browser, first)
        bare(browser, False)
        check_flight(browser)
        check_report(browser)
        check_phone(browser)
        check_detail(browser)
        check_frames(browser)
        for message in browser.log():
            expect(False, "console: " + message)
    for failure in failures:
        print(failure)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
