"""Drives real headless Chromium over WebDriver (Debian: chromium, chromium-driver), on pages of tests/page_make.c.

    page_browser.py FOLDER [NAME…]       tests; a line each: "passed NAME" or "FAILED NAME: why"
    page_browser.py --shot FILE OUT.png WIDTH [HEIGHT] [dark] [SCRIPT]   a picture of a page, for people

Exit status: 0 all passed, 1 some failed, 77 no browser can be started here. Nothing but the standard library.
"""

import base64
import json
import math
import os
import re
import struct
import sys
import time
import zlib

sys.dont_write_bytecode = True
from webdriver import Browser, Missing  # noqa: E402

WIDTH, HEIGHT = 160, 96


# ---- what the pages hold (tests/page_make.c) ----------------------------------------------------------------


def linear(variant, index, x, y):
    step = 1 if variant < 0 else variant * 6
    if x < 8:
        return [[0, -0.125, 1, 64, 65504, 0.0009765625, 8, 0.25][x]] * 3
    return [((x * (3 - c) + y * (1 + c) + index * 4 + step * c + step) % 512) / 256 for c in range(3)]


def shown(values, exposure=0.0):
    v = [x * 2 ** exposure for x in values]
    mixed = [max(0.8 * v[c] + 0.1 * v[(c + 1) % 3] + 0.1 * v[(c + 2) % 3], 0) for c in range(3)]
    return [255 * min(max(math.sqrt(x / (x + 0.6) + 0.01) - 0.1, 0), 1) for x in mixed]


def srgb(values, exposure=0.0):
    v = [max(x * 2 ** exposure, 0) for x in values]
    return [255 * min(12.92 * x if x <= 0.0031308 else 1.055 * x ** (1 / 2.4) - 0.055, 1) for x in v]


def flip_map(index, x, y):
    return (x + 2 * y + 5 * index) % 256


# ---- the viewer as a test sees it ----------------------------------------------------------------------------


class Check(Exception):
    pass


def check(condition, text):
    if not condition:
        raise Check(text)


class Page:
    def __init__(self, browser, folder):
        self.b, self.folder = browser, folder

    def open(self, name="main.html", query=""):
        self.b.open(os.path.join(self.folder, name), query)

    def box(self, selector):
        return self.b.js("document.querySelector(arguments[0]).scrollIntoView({block: 'center', behavior: 'instant'}); const r = document.querySelector(arguments[0]).getBoundingClientRect();"
                         "return {x: r.x, y: r.y, width: r.width, height: r.height}", selector)

    def canvas(self):
        return self.box(".stage canvas")

    def focus(self, selector=".stage canvas"):
        self.b.js("document.querySelector(arguments[0]).focus()", selector)

    def pixels(self):
        """{(x, y): rgb} of the canvas is too much: a function of device pixels."""
        data = self.b.js("""const c = document.querySelector('.stage canvas'), d = document.createElement('canvas');
            d.width = c.width; d.height = c.height;
            const g = d.getContext('2d', {willReadFrequently: true});
            g.drawImage(c, 0, 0);
            const bytes = g.getImageData(0, 0, d.width, d.height).data;
            let text = '';
            for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode.apply(null, bytes.subarray(i, i + 8192));
            return [d.width, d.height, btoa(text)]""")
        width, height, raw = data[0], data[1], base64.b64decode(data[2])
        return width, height, lambda x, y: list(raw[4 * (y * width + x):4 * (y * width + x) + 3])

    def compare(self, want, tolerance, points=None, half=False, size=(WIDTH, HEIGHT)):
        """Every few pixels of the picture at scale 1, which must be in the middle of its pane, against want(x, y)."""
        width, height, got = self.pixels()
        left, right = 0, width // 2 - 1 if half else width
        x0, y0 = (left + right) // 2 - size[0] // 2, height // 2 - size[1] // 2
        worst, count = (0, ""), 0
        for x, y in points or [(x, y) for y in range(0, size[1], 3) for x in range(size[0])]:
            if not left <= x0 + x < right:
                continue
            is_, should = got(x0 + x, y0 + y), want(x, y)
            off = max(abs(a - b) for a, b in zip(is_, should))
            worst, count = max(worst, (off, f"pixel {x},{y}: {is_} instead of {[round(v, 1) for v in should]}")), count + 1
        check(count > 100 or points, "the picture is not where it should be")
        check(worst[0] <= tolerance, f"off by {worst[0]:.2f}/255: {worst[1]}")
        return worst[0]

    def text(self, selector):
        return self.b.js("return document.querySelector(arguments[0]).textContent", selector)

    def value(self, selector):
        return self.b.js("return document.querySelector(arguments[0]).value", selector)


TESTS = []


def test(function):
    TESTS.append(function)
    return function


# The table's error: what the page itself says, and the rounding of 8 bits twice.
TABLE = 1.6


@test
def renderer(p):
    """Which one draws; the table's error is said and is what it is."""
    p.open()
    check(p.b.js("return document.getElementById('viewer').dataset.renderer") == p.expected_renderer, "another renderer draws")
    said = re.search(r"off by ([\d.]+)/255 in the mean and ([\d.]+)/255 at most", p.text("#viewer"))
    check(said and float(said.group(1)) < 0.2 and float(said.group(2)) < TABLE, f"the table's error: {said and said.group(0)}")


@test
def wipe(p):
    """Left of the line is A, right of it B: dragged, and moved by keys."""
    p.open()
    p.focus()
    p.b.keys("1")
    split = lambda: float(p.b.js("return document.querySelector('.handle').getAttribute('aria-valuenow')"))
    check(split() == 50, "the line does not start in the middle")
    p.compare(lambda x, y: shown(linear(0 if x < WIDTH / 2 else 1, 3, x, y)), TABLE)
    box = p.canvas()
    y = box["y"] + box["height"] / 2
    to = box["x"] + box["width"] / 2 + 40
    p.b.pointer(("move", box["x"] + box["width"] / 2, y), "down", ("move", to - 9, y), ("move", to, y), "up")
    p.compare(lambda x, y: shown(linear(0 if x < WIDTH / 2 + 40 else 1, 3, x, y)), TABLE)
    before = split()
    p.b.keys("Left", "Left", "Left")
    check(split() == before - 3, "an arrow key moves the line by 1 %")
    p.b.keys("Left", down=["Shift"])
    check(split() == before - 13, "with Shift by 10 %")


@test
def flip(p):
    p.open()
    p.focus()
    p.b.keys("1", "Space")
    p.compare(lambda x, y: shown(linear(0, 3, x, y)), TABLE)
    p.b.keys("Space")
    p.compare(lambda x, y: shown(linear(1, 3, x, y)), TABLE)
    check(p.b.js("return document.querySelector('.tag.a').hidden && !document.querySelector('.tag.b').hidden"), "the label says B")
    p.b.keys("Space")
    p.compare(lambda x, y: shown(linear(0, 3, x, y)), TABLE)


@test
def side_by_side(p):
    """Both halves show the same place, also after zoom and pan."""
    p.open()
    p.focus()
    p.b.keys("s", "1")
    p.compare(lambda x, y: shown(linear(0, 3, x, y)), TABLE, half=True, points=[(x, y) for x in range(20, 140, 7) for y in range(5, 90, 7)])
    p.b.keys("+", "+", "+", "Right", "Down")
    check("400" in p.text("#zoom"), p.text("#zoom"))
    width, height, got = p.pixels()
    half, worst = width // 2, 0
    find = {}
    for x in range(WIDTH):
        for y in range(HEIGHT):
            find.setdefault(tuple(round(v) for v in shown(linear(0, 3, x, y))), []).append((x, y))
    for x in range(half // 4, half * 3 // 4, 17):
        a, b = got(x, height // 2), got(x + half + 1, height // 2)
        here = [q for d in (0, -1, 1) for e in (0, -1, 1) for f in (0, -1, 1) for q in find.get((a[0] + d, a[1] + e, a[2] + f), [])]
        off = min((max(abs(u - v) for u, v in zip(b, shown(linear(1, 3, *q)))) for q in here), default=99)
        worst = max(worst, off)
    check(worst <= 4, f"the halves show different places: {worst}")


@test
def exposure(p):
    """The slider, dragged; the keys; on scene-linear values, with both displays."""
    p.open()
    p.focus()
    p.b.keys("f", "1")
    box = p.box("#exposure")
    y = box["y"] + box["height"] / 2
    p.b.pointer(("move", box["x"] + box["width"] / 2, y), "down", ("move", box["x"] + box["width"] * 0.6, y),
                ("move", box["x"] + box["width"] * 0.69, y), "up")
    stops = float(p.value("#exposure"))
    check(2 < stops < 4, f"the slider stands at {stops}")
    p.compare(lambda x, y: shown(linear(0, 3, x, y), stops), TABLE)
    p.focus()
    p.b.keys("e", "[", "[", "[", "[", "[", "[")
    check(float(p.value("#exposure")) == -1.5, "[ is a quarter of a stop")
    p.compare(lambda x, y: shown(linear(0, 3, x, y), -1.5), TABLE)
    p.b.keys("v")
    p.compare(lambda x, y: srgb(linear(0, 3, x, y), -1.5), 0.6)


@test
def heat_map(p):
    p.open()
    p.focus()
    p.b.keys("f", "1", "h")
    heat = p.b.js("return JSON.parse(document.getElementById('page').textContent).heat")
    check(len(heat) == 768 and heat[:3] == [0, 0, 0] and min(heat[-3:]) > 230, "the colours of the heat map")
    color = lambda i: heat[3 * i:3 * i + 3]
    mix = lambda a, b, t: [u + (v - u) * t for u, v in zip(a, b)]
    check(p.value("#overlay") == "flip", "H is the next map")
    opacity = float(p.value("#opacity"))
    p.compare(lambda x, y: mix(shown(linear(0, 3, x, y)), color(flip_map(3, x, y)), opacity), TABLE)
    p.b.js("const o = document.getElementById('opacity'); o.value = 1; o.dispatchEvent(new Event('input'))")
    p.b.settle()
    p.compare(lambda x, y: color(flip_map(3, x, y)), 1)
    p.b.keys("h")
    p.compare(lambda x, y: color(int(flip_map(3, x, y) / 2 + 0.5)), 1)
    p.b.keys("h")
    difference = lambda x, y: max(abs(a - b) for a, b in zip(linear(0, 3, x, y), linear(1, 3, x, y)))
    near = lambda x, y: color(int(min(difference(x, y), 1) * 255 + 0.5))
    p.compare(near, 1)
    p.b.keys("h")
    p.compare(lambda x, y: shown(linear(0, 3, x, y)), TABLE)
    p.b.keys("h", "h")
    p.b.keys("b")  # variant 2, whose pair has no map of HDR-FLIP
    check("No such map" in p.text(".message") and not p.b.js("return document.querySelector('.message').hidden"), "a missing map is said")


@test
def zoom_and_pan(p):
    p.open()
    p.focus()
    p.b.keys("f", "1", "+", "+", "+")
    check("400" in p.text("#zoom"), f"three times + is 4: {p.text('#zoom')}")
    box = p.canvas()
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    p.b.pointer(("move", *middle), "down", ("move", middle[0] + 13, middle[1] + 20), ("move", middle[0] + 40, middle[1] - 20), "up")
    width, height, got = p.pixels()
    for ix, iy in [(70, 53), (75, 50), (60, 60)]:
        x, y = width // 2 + 40 + (ix - 80) * 4 + 2, height // 2 - 20 + (iy - 48) * 4 + 2
        want = shown(linear(0, 3, ix, iy))
        check(max(abs(a - b) for a, b in zip(got(x, y), want)) <= TABLE, f"pixel {ix},{iy} is not at {x},{y} after a drag by 40,-20")
    p.b.pointer(("move", *middle))
    before = p.text("#readout .place")
    p.b.wheel(*middle, -120)
    p.b.wheel(*middle, -120)
    check(p.text("#readout .place") == before and "800" in p.text("#zoom"), f"the wheel zooms at the pointer: {p.text('#zoom')}")
    p.b.keys("0")
    p.b.keys("1")
    p.compare(lambda x, y: shown(linear(0, 3, x, y)), TABLE)


@test
def read_out(p):
    """Coordinates, linear and shown values, difference, material and metrics of a pixel."""
    p.open()
    p.focus()
    p.b.keys("1")
    box = p.canvas()
    x, y = 33, 70
    at = (math.ceil(box["x"] + box["width"] // 2 + x - 80), math.ceil(box["y"] + box["height"] // 2 + y - 48))
    p.b.pointer(("move", *at))
    place = p.text("#readout .place")
    names = ["no material", "skin", "plaster", "wax"]
    for part in [f"x {x + 10}, y {y + 20}", names[(x // 16 + y // 16) % 4], f"FLIP {flip_map(3, x, y) / 255:.3f}"]:
        check(part in place, f"'{part}' is not in '{place}'")
    rows = p.b.js("return [...document.querySelectorAll('#readout tbody tr')].map(r => [...r.querySelectorAll('td')].map(c => c.textContent.replace('\\u2212', '-')))")
    a, b = linear(0, 3, x, y), linear(1, 3, x, y)
    for row, want in [(rows[0], a), (rows[1], b), (rows[2], [v - u for u, v in zip(a, b)])]:
        check(all(abs(float(g) - w) < 1e-3 for g, w in zip(row[:3], want)), f"linear {row[:3]} instead of {want}")
    for row, want in [(rows[0], shown(a)), (rows[1], shown(b))]:
        check(all(abs(float(g) - w) <= TABLE for g, w in zip(row[3:], want)), f"shown {row[3:]} instead of {want}")
    p.b.pointer("down", "up", ("move", at[0] + 30, at[1]))
    check("pinned" in p.text("#readout .place"), "a click pins the pixel")
    p.b.keys("Right", "Right", "Down", down=["Alt"])
    check(f"x {x + 12}, y {y + 21}" in p.text("#readout .place"), "Alt and arrows move it")
    p.b.keys("Escape")
    check("pinned" not in p.text("#readout .place"), "Escape lets go")


@test
def frames_and_variants(p):
    p.open()
    p.focus()
    p.b.keys("f", "1", ",")
    p.compare(lambda x, y: shown(linear(0, 0, x, y)), TABLE)
    p.b.keys(".", ".")
    p.compare(lambda x, y: shown(linear(0, 5, x, y)), TABLE)
    p.b.keys("a", "a")
    p.compare(lambda x, y: shown(linear(2, 5, x, y)), TABLE)
    p.b.keys("x")
    p.compare(lambda x, y: shown(linear(1, 5, x, y)), TABLE)


@test
def keyboard_only(p):
    """Every control can be reached and worked; focus is seen; help says how."""
    p.open()
    p.b.js("document.activeElement.blur()")
    seen, ring = [], []
    for _ in range(90):
        p.b.post("/actions", {"actions": [{"type": "key", "id": "keyboard", "actions": [
            {"type": t, "value": "\ue004"} for t in ("keyDown", "keyUp")]}]})
        name, outlined = p.b.js("""const e = document.activeElement, s = getComputedStyle(e), k = e.querySelector && e.querySelector('rect, span'), n = k && getComputedStyle(k);
            return [e.id || e.getAttribute('aria-label') || e.textContent.slice(0, 20), s.outlineStyle !== 'none' || s.boxShadow !== 'none' || (n && (n.boxShadow !== 'none' || parseFloat(n.strokeWidth) >= 1.9))]""")
        if name in seen[:1] and len(seen) > 20:
            break
        seen.append(name)
        if not outlined and not p.b.js("return document.activeElement === document.body"):
            ring.append(name)
    for wanted in ["help-open", "theme", "pick-a", "pick-b", "pick-frame", "exposure", "display", "overlay", "zoom", "pair", "Line between A and B", "Wipe", "mean"]:
        check(wanted in seen, f"Tab does not reach '{wanted}': {seen}")
    check(not ring, f"focus is not seen on {ring}")
    p.b.js("document.activeElement.blur()")
    p.b.keys("?")
    check(p.b.js("return document.getElementById('help').open"), "? opens help")
    check("Space" in p.text("#help"), "help lists the keys")
    p.b.keys("Escape")
    check(not p.b.js("return document.getElementById('help').open"), "Escape closes it")
    p.focus("#help-open")
    p.b.keys("Enter")
    check(p.b.js("return document.getElementById('help').open"), "Enter on ? opens help")
    p.b.keys("Escape")
    p.focus("#zoom")
    p.b.keys("w", "Space")
    check(p.b.js("return document.querySelector('.stage').dataset.mode") == "wipe", "space on a button presses it, and does not flip")


@test
def tables_and_links(p):
    """Numbers of metrics.json are in the table; worst frames go to the viewer, others to files."""
    p.open()
    head = p.b.js("return [...document.querySelectorAll('table.metrics thead th')].map(e => e.textContent)")
    check(head[:3] == ["Material", "FLIP", "HDR-FLIP"], f"columns {head}")
    row = p.b.js("return [...document.querySelectorAll('table.metrics tbody tr')].map(r => [...r.children].map(e => e.textContent))")
    check([r[0] for r in row] == ["all materials", "skin", "plaster", "wax"], f"rows {[r[0] for r in row]}")
    check("0.0172" in row[0][1] and "0.0310" in row[0][1] and "104" in row[0][1], f"FLIP of all: {row[0][1]}")
    check("beyond chance" in row[1][1] and "beyond" not in row[2][1], "what chance makes is told apart")
    p.b.js("document.querySelectorAll('table.metrics button.link')[0].click()")
    p.b.settle()
    check(p.value("#overlay") == "flip" and p.value("#pick-frame") == "1", "the worst frame is shown with its map")
    check(p.b.js("return document.querySelectorAll('.plot').length") == 6, "a plot a metric")
    check(p.b.js("return document.querySelectorAll('.node').length") == 9 and p.b.js("return document.querySelectorAll('.node.varied').length") == 7, "nodes of the graph")
    for part, where in [("2.31", "#cost"), ("predicted 2.2", "#cost"), ("flip.p95", "#thresholds"), ("graph.sss.pass", "#parameters"), ("0.", "#energy")]:
        check(part in p.text(where), f"'{part}' is not in {where}")
    p.b.js("document.querySelector('#files details').open = true")
    p.b.settle()
    links = p.b.js("return [...document.querySelectorAll('#files a')].map(a => a.getAttribute('href'))")
    check(links[:2] == ["./variant%200/monkey.0101.exr", "./variant%201/monkey.0101.exr"] and len(links) == 18, f"links {links[:3]}")
    p.b.js("document.querySelectorAll('.node')[2].focus()")
    check("sss_burley" in p.text(".detail") and "light.diffuse" in p.text(".detail"), f"a node in focus says what it reads: {p.text('.detail')}")
    p.focus(".plot")
    p.b.keys("Right", "Right")
    check("frame 102 (linked)" in p.text(".tip"), f"the plot is read by keys: {p.text('.tip')}")


@test
def light_and_dark(p):
    paper = lambda: p.b.js("return getComputedStyle(document.body).backgroundColor.match(/\\d+/g).map(Number)")
    p.open()
    check(min(paper()) > 200, "light is light")
    p.b.media("dark", "reduce")
    check(max(paper()) < 60, "dark is dark")
    ratio = p.b.js("""const lum = c => { const v = c.match(/[\\d.]+/g).slice(0, 3).map(x => c.startsWith('color(') ? Number(x) : x / 255).map(x => x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4); return 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2]; };
        const behind = e => { for (; e; e = e.parentElement) { const c = getComputedStyle(e).backgroundColor; if (!/, 0\\)$|transparent/.test(c)) return c; } return 'rgb(255,255,255)'; };
        const bad = []; for (const theme of ['light', 'dark']) { document.documentElement.dataset.theme = theme;
          for (const e of document.querySelectorAll('p, h1, h2, h3, th, td, dt, dd, a, button, label, li, small, summary, figcaption')) {
            if (!e.textContent.trim() || !e.getClientRects().length || e.closest('.stage')) continue;
            const a = lum(getComputedStyle(e).color), b = lum(behind(e)), k = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
            if (k < 4.5) bad.push(theme + ' ' + e.tagName + '.' + e.className + ' ' + e.textContent.slice(0, 20) + ' ' + k.toFixed(2)); } }
        delete document.documentElement.dataset.theme; return bad;""")
    ratio = [r for r in ratio if "aria-pressed" not in r]
    check(not ratio, f"contrast below 4.5: {ratio[:4]}")
    p.b.keys("t")
    check(min(paper()) > 200, "T switches")


@test
def phone(p):
    """360 pixels wide: nothing sticks out, controls are large enough, all of it works."""
    p.b.size(360, 740, 2, True)
    p.open("evil.html")  # long names
    width = p.b.js("return [document.documentElement.scrollWidth, innerWidth]")
    check(width == [360, 360], f"the page with long names is {width} wide")
    p.open()
    over = p.b.js("""const w = document.documentElement.clientWidth; if (document.documentElement.scrollWidth <= w) return [];
        return [...document.querySelectorAll('body *')].filter(e => e.getBoundingClientRect().right > w + 1 && !e.closest('.scroll, nav')).map(e => e.tagName + '.' + e.className).slice(0, 5)""")
    width = p.b.js("return [document.documentElement.scrollWidth, innerWidth]")
    check(width[0] <= 360 and not over, f"the page is {width[0]} wide: {over}")
    small = p.b.js("""return [...document.querySelectorAll('#viewer button, #viewer select')].filter(e => e.getClientRects().length && e.getBoundingClientRect().height < 32).map(e => e.textContent)""")
    check(not small, f"too small to touch: {small}")
    p.focus()
    p.b.keys("f", "1")
    p.compare(lambda x, y: shown(linear(0, 3, x, y)), TABLE)
    p.b.keys("w", "0")
    p.b.js("window.scrollTo(0, 0)")


@test
def touch(p):
    """Two fingers apart make it larger."""
    p.b.size(360, 740, 2, True)
    p.open()
    p.focus()
    p.b.keys("f", "1")
    box = p.canvas()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    finger = lambda name, sign: {"type": "pointer", "id": name, "parameters": {"pointerType": "touch"}, "actions": [
        {"type": "pointerMove", "duration": 0, "x": round(x + sign * 20), "y": round(y)}, {"type": "pointerDown", "button": 0},
        {"type": "pointerMove", "duration": 60, "x": round(x + sign * 40), "y": round(y)}, {"type": "pointerUp", "button": 0}]}
    p.b.post("/actions", {"actions": [finger("left", -1), finger("right", 1)]})
    p.b.settle()
    percent = int(re.sub(r"\D", "", p.text("#zoom")))
    check(160 <= percent <= 240, f"fingers twice as far apart: {percent} %")


@test
def stillness(p):
    """prefers-reduced-motion, and print."""
    scrolls = lambda: p.b.js("return getComputedStyle(document.documentElement).scrollBehavior")
    p.open()
    check(scrolls() == "auto", "scrolling is not smooth")
    p.b.media()
    check(scrolls() == "smooth", "scrolling is smooth")
    p.b.media(kind="print")
    check(p.b.js("return getComputedStyle(document.querySelector('.top')).display") == "none", "print leaves the bar out")
    p.b.media()


@test
def hostile_names(p):
    """Names are text: markup in them does nothing, and reads as it was."""
    p.open("evil.html")
    check(p.b.js("return window.evil === undefined"), "a name ran")
    name = p.b.js("return JSON.parse(document.getElementById('metrics').textContent).variants[1].name")
    check("</script><img" in name, "the name came through")
    check(name in p.text("h1") and name in p.text("#summary") and name in p.b.js("return document.title"), "it is shown as it is")
    check(p.b.js("return document.querySelectorAll('img').length") == 0, "an element came from a name")
    p.focus()
    p.b.keys("f", "1")
    p.compare(lambda x, y: shown(linear(0, 3, x, y)), TABLE)


@test
def reference_and_failed_frame(p):
    """--against: the reference is A; a frame that failed is said; without a display there is plain sRGB."""
    p.open("reference.html")
    p.focus()
    p.b.keys("f", "1")
    p.compare(lambda x, y: srgb(linear(-1, 3, x, y)), 0.6)
    check("reference" in p.text("#pick-a") and "<b>No such file</b>" in p.text("#failures"), "reference and failure")


@test
def nothing_held(p):
    """A page without a frame: it says so, its tables and links work, keys do no harm."""
    p.open("none.html")
    check("No frame is in this page" in p.text(".message") and not p.b.js("return document.querySelector('.message').hidden"), "it says so")
    p.focus()
    p.b.keys("f", "Space", "1", "+", "h", "a", ".", "Left")
    p.b.js("document.querySelectorAll('table.metrics button.link')[0].click()")
    p.b.settle()
    check(p.b.js("return document.querySelector('#files details').open"), "a worst frame that is not held leads to its files")


def read_png(path):
    """(width, height, pixel(x, y)) of an 8-bit RGB or RGBA file."""
    with open(path, "rb") as file:
        data = file.read()
    at, packed, head = 8, b"", None
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IHDR":
            head = struct.unpack(">IIBBBBB", data[at + 8:at + 21])
        if kind == b"IDAT":
            packed += data[at + 8:at + 8 + size]
        at += 12 + size
    width, height, depth, color = head[:4]
    n = {2: 3, 6: 4}[color]
    check(depth == 8, "an 8-bit file")
    raw, stride, rows, before = zlib.decompress(packed), width * n, [], bytes(width * n)
    for y in range(height):
        method, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            a, b, c = row[i - n] if i >= n else 0, before[i], before[i - n] if i >= n else 0
            if method == 4:
                p = a + b - c
                d = (abs(p - a), abs(p - b), abs(p - c))
                add = (a, b, c)[d.index(min(d))]
            else:
                add = (0, a, b, (a + b) // 2)[method]
            row[i] = (row[i] + add) & 255
        rows.append(bytes(row))
        before = rows[-1]
    return width, height, lambda x, y: list(rows[y][x * n:x * n + 3])


@test
def real_report(p):
    """A page of `relit ab` on the bundled capture shows what the run wrote as PNG, but for the table's error."""
    p.open("real/report.html")
    p.focus()
    p.b.keys("f", "1")
    for name in ["post", "pre_post"]:
        width, height, want = read_png(os.path.join(p.folder, "real", name, "monkey.0001.png"))
        p.compare(want, TABLE, size=(width, height), points=[(x, y) for x in range(0, width, 5) for y in range(0, height, 5)])
        p.b.keys("Space")
    check("skin" in p.text("#summary") and p.b.js("return document.querySelectorAll('.node').length") > 4, "its words and graph")
    p.b.js("document.querySelector('#files details').open = true")
    p.b.settle()
    links = p.b.js("return [...document.querySelectorAll('#files a')].map(a => decodeURIComponent(new URL(a.href).pathname))")
    check(len(links) == 4 and all(os.path.isfile(f) for f in links), f"links lead to files: {links[:2]}")


@test
def plan_page(p):
    """relit plan --format html: graph, times, lifetimes, memory."""
    p.open("plan.html")
    check(p.text("h1") == "skin.yaml" and "8.0" in p.text("#facts"), "title and peak memory")
    names = p.b.js("return [...document.querySelectorAll('.node .name')].map(e => e.textContent)")
    check(names == ["capture", "light", "a</script>a"], f"nodes {names}")
    check(p.b.js("return document.querySelectorAll('.edge').length") == 3 and p.b.js("return document.querySelectorAll('.edge.history').length") == 1, "edges")
    times = p.b.js("return [...document.querySelectorAll('.time .value')].map(e => e.textContent)")
    check(times == ["5.00", "1.50", "0.500"], f"times {times}")
    check("2.0" in p.b.js("return document.querySelectorAll('.node .ms')[1].textContent"), "a node's time is that of its steps")
    bars = p.b.js("return [...document.querySelectorAll('.life rect')].map(e => e.getAttribute('width') / document.querySelectorAll('.life rect')[2].getAttribute('width'))")
    check(len(bars) == 3 and abs(bars[0] - 0.25) < 0.02 and abs(bars[1] - 0.75) < 0.02, f"lifetimes {bars}")
    check("7.0" in p.text("#memory") and "idle" in p.text("#graph"), "memory, and what is left out")
    p.b.size(360, 740, 2, True)
    p.open("plan.html")
    check(p.b.js("return document.documentElement.scrollWidth") == 360, "it fits a phone")


def run_quiet(p, name):
    """No error on the console, no request but for the page itself."""
    severe = [e["message"] for e in p.b.log("browser") if e["level"] in ("SEVERE", "ERROR")]
    urls = []
    for entry in p.b.log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent" and message["params"]["documentURL"].startswith("file://"):
            urls.append(message["params"]["request"]["url"])
    bad = [u for u in urls if not u.startswith(("file://", "data:", "blob:", "about:"))]
    pages = [u for u in urls if u.startswith("file://") and not u.split("?")[0].endswith(".html")]
    check(not severe, f"{name}: console: {severe[:2]}")
    check(not bad and not pages, f"{name}: requests: {(bad + pages)[:3]}")


def run_tests(folder, names):
    status = 0
    # The second browser has no WebGL: the pages fall back.
    for label, flags, only in [("webgl", [], None), ("canvas", ["--disable-3d-apis"], ["renderer", "wipe", "flip", "side_by_side", "exposure", "heat_map", "zoom_and_pan", "phone", "real_report"])]:
        browser = Browser(*flags)
        try:
            page = Page(browser, folder)
            page.expected_renderer = "WebGL 2" if label == "webgl" else "2-D canvas"
            for function in TESTS:
                name = f"{label} {function.__name__}"
                if (only and function.__name__ not in only) or (names and function.__name__ not in names):
                    continue
                started, why = time.time(), None
                try:
                    browser.size(720, 460)
                    browser.media(motion="reduce")
                    function(page)
                    run_quiet(page, function.__name__)
                except (Check, RuntimeError) as error:
                    why = str(error).splitlines()[0]
                    status = 1
                print(f"FAILED {name}: {why}" if why else f"passed {name}", f"({time.time() - started:.1f} s)", flush=True)
        finally:
            browser.close()
    return status


def take_shot(arguments):
    path, out, width = arguments[0], arguments[1], int(arguments[2])
    browser = Browser()
    try:
        browser.size(width, int(arguments[3]) if len(arguments) > 3 else 900, 2 if width < 500 else 1, width < 500)
        browser.media("dark" if "dark" in arguments[4:] else "light")
        browser.open(path)
        for script in [a for a in arguments[4:] if a != "dark"]:
            browser.js(script)
            browser.settle()
        browser.shot(out)
        for entry in browser.log("browser"):
            print(entry["level"], entry["message"])
    finally:
        browser.close()


def main():
    try:
        if sys.argv[1] == "--shot":
            take_shot(sys.argv[2:])
            return 0
        return run_tests(sys.argv[1], sys.argv[2:])
    except Missing as missing:
        print(f"no browser: {missing}")
        return 77


if __name__ == "__main__":
    sys.exit(main())
