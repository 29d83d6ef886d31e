"""A headless Chromium driven over ChromeDriver's HTTP interface; needs nothing but Python's standard library."""

import base64
import json
import os
import shutil
import socket
import struct
import subprocess
import tempfile
import time
import urllib.request
import zlib

FLAGS = [
    "--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--hide-scrollbars", "--force-device-scale-factor=1", "--disable-dev-shm-usage", "--force-prefers-reduced-motion",
    "--proxy-server=127.0.0.1:9",  # a page that tries to load anything from a network gets an error
]


def chromium():
    """Paths of browser and driver, or None."""
    browser, driver = shutil.which("chromium"), shutil.which("chromedriver")
    return (browser, driver) if browser and driver else None


class Browser:
    """with Browser() as browser: ...; ends the driver and the browser, and removes the profile."""

    def __init__(self, width=800, height=600):
        browser, driver = chromium()
        self.profile = tempfile.mkdtemp(prefix="curvesup_browser_")
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.driver = subprocess.Popen([driver, f"--port={self.port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        options = {"binary": browser, "args": FLAGS + [f"--user-data-dir={self.profile}", f"--window-size={width},{height}"]}
        capabilities = {"browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}
        try:
            self._await_driver()
            answer = self._send("POST", "/session", {"capabilities": {"alwaysMatch": capabilities}})
            self.session = "/session/" + answer["sessionId"]
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        if getattr(self, "session", None):
            try:
                self._send("DELETE", self.session)
            except OSError:
                pass
        self.driver.terminate()
        self.driver.wait()
        shutil.rmtree(self.profile, ignore_errors=True)

    def _await_driver(self):
        for _ in range(200):
            try:
                if self._send("GET", "/status")["ready"]:
                    return
            except OSError:
                time.sleep(0.1)
        raise RuntimeError("chromedriver does not answer")

    def _send(self, method, path, body=None):
        data = None if body is None and method != "POST" else json.dumps(body or {}).encode()
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}{path}", data, {"Content-Type": "application/json"}, method=method)
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        try:
            with opener.open(request, timeout=120) as response:
                return json.load(response)["value"]
        except urllib.error.HTTPError as error:
            raise RuntimeError(json.load(error)["value"]["message"]) from None

    def size(self, width, height):
        """Size of the page itself."""
        self._send("POST", self.session + "/goog/cdp/execute", {"cmd": "Emulation.setDeviceMetricsOverride", "params": {
            "width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}})

    def open(self, file):
        self._send("POST", self.session + "/url", {"url": "file://" + os.path.abspath(file)})

    def run(self, script, *arguments):
        return self._send("POST", self.session + "/execute/sync", {"script": script, "args": list(arguments)})

    def wait(self, condition, seconds=60):
        """Until the JavaScript expression holds."""
        end = time.time() + seconds
        while time.time() < end:
            if self.run(f"return !!({condition});"):
                return
            time.sleep(0.05)
        raise AssertionError(f"not within {seconds} s: {condition}")

    def settle(self):
        """Until the picture stands still with all detail."""
        self.wait("window.curvesup && window.curvesup.still()")

    def click(self, selector):
        element = self._send("POST", self.session + "/element", {"using": "css selector", "value": selector})
        self._send("POST", self.session + "/element/" + next(iter(element.values())) + "/click", {})

    def keys(self, text):
        self._send("POST", self.session + "/actions", {"actions": [{"type": "key", "id": "keyboard", "actions": [
            step for key in text for step in ({"type": "keyDown", "value": key}, {"type": "keyUp", "value": key})]}]})

    def slide(self, selector, value):
        self.run("const s = document.querySelector(arguments[0]); s.value = arguments[1]; s.dispatchEvent(new Event('input'));",
                 selector, value)

    def log(self):
        """Console messages since the last call that are warnings or errors."""
        entries = self._send("POST", self.session + "/se/log", {"type": "browser"})
        # The browser's own remarks on software rendering are not the page's.
        return [e["message"] for e in entries if e["level"] in ("SEVERE", "WARNING") and "GL Driver Message" not in e["message"]]

    def picture(self, width=None, height=None, scale=1):
        """The page as PNG, or its upper left width x height, scaled."""
        if width is None:
            return base64.b64decode(self._send("GET", self.session + "/screenshot"))
        clip = {"x": 0, "y": 0, "width": width, "height": height, "scale": scale}
        answer = self._send("POST", self.session + "/goog/cdp/execute", {"cmd": "Page.captureScreenshot", "params": {"format": "png", "clip": clip}})
        return base64.b64decode(answer["data"])


def read_png(data):
    """(width, height, rows of RGB bytes) of an 8-bit PNG without interlacing."""
    at, packed, width, height, channels = 8, b"", 0, 0, 0
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour, _, _, interlace = struct.unpack(">IIBBBBB", body)
            assert depth == 8 and colour in (2, 6) and interlace == 0, "unexpected kind of PNG"
            channels = 3 if colour == 2 else 4
        if kind == b"IDAT":
            packed += body
        at += 12 + length
    raw, stride = zlib.decompress(packed), width * channels
    rows, previous = [], bytearray(stride)
    for y in range(height):
        kind, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for x in range(stride):
            left = line[x - channels] if x >= channels else 0
            up, corner = previous[x], previous[x - channels] if x >= channels else 0
            if kind == 1:
                line[x] = (line[x] + left) & 255
            elif kind == 2:
                line[x] = (line[x] + up) & 255
            elif kind == 3:
                line[x] = (line[x] + (left + up) // 2) & 255
            elif kind == 4:
                guess = left + up - corner
                near = min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))[2]
                line[x] = (line[x] + near) & 255
        previous = line
        rows.append(bytes(line) if channels == 3 else bytes(v for i, v in enumerate(line) if i % 4 != 3))
    return width, height, rows


def write_png(width, height, rows):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    packed = zlib.compress(b"".join(b"\0" + row for row in rows), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) + chunk(b"IDAT", packed) + chunk(b"IEND", b"")


def different_pixels(a, b, tolerance=24):
    """Share of the pixels of two pictures of one size in which some channel differs by more than `tolerance`."""
    (width, height, rows_a), (width_b, height_b, rows_b) = a, b
    if (width, height) != (width_b, height_b):
        return 1.0
    differing = 0
    for row_a, row_b in zip(rows_a, rows_b):
        if row_a == row_b:
            continue
        for x in range(0, 3 * width, 3):
            if max(abs(row_a[x + c] - row_b[x + c]) for c in range(3)) > tolerance:
                differing += 1
    return differing / (width * height)
