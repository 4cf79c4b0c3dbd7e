"""Headless Chromium over WebDriver (chromedriver on the loopback address); nothing but the standard library."""

import base64
import json
import math
import os
import re
import subprocess
import tempfile
import urllib.error
import urllib.request


class Missing(Exception):
    """No browser can be started here."""


class Browser:
    def __init__(self, *flags):
        self.home = tempfile.TemporaryDirectory(prefix="relit-page-")
        try:
            self.driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE,
                                           stderr=subprocess.DEVNULL, text=True)
        except OSError as error:
            raise Missing(f"chromedriver: {error}")
        port = None
        for line in self.driver.stdout:
            found = re.search(r"started successfully on port (\d+)", line)
            if found:
                port = found.group(1)
                break
        if not port:
            raise Missing("chromedriver does not start")
        self.base = f"http://127.0.0.1:{port}"
        self.opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        args = ["--headless=new", "--disable-gpu", "--enable-unsafe-swiftshader", "--hide-scrollbars", "--force-color-profile=srgb",
                f"--user-data-dir={self.home.name}", "--no-first-run", "--disable-dev-shm-usage", *flags]
        if os.getuid() == 0:  # its own sandbox refuses root
            args.append("--no-sandbox")
        wanted = {"browserName": "chrome", "goog:chromeOptions": {"args": args},
                  "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"}}
        try:
            made = self.call("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})
        except RuntimeError as error:
            self.driver.kill()
            raise Missing(f"chromium: {str(error).splitlines()[0]}")
        self.session = f"/session/{made['sessionId']}"
        self.cdp("Emulation.setFocusEmulationEnabled", enabled=True)

    def close(self):
        try:
            self.call("DELETE", self.session)
        finally:
            self.driver.terminate()
            self.driver.wait()
            self.home.cleanup()

    def call(self, method, path, data=None):
        body = json.dumps(data if data is not None else {}).encode() if method == "POST" else None
        request = urllib.request.Request(self.base + path, body, {"Content-Type": "application/json"}, method=method)
        try:
            with self.opener.open(request, timeout=60) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise RuntimeError(json.load(error)["value"]["message"])

    def post(self, path, data=None):
        return self.call("POST", self.session + path, data)

    def cdp(self, command, **params):
        return self.post("/goog/cdp/execute", {"cmd": command, "params": params})

    def js(self, script, *args):
        return self.post("/execute/sync", {"script": script, "args": list(args)})

    def size(self, width, height, ratio=1, mobile=False):
        self.cdp("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=ratio, mobile=mobile)

    def media(self, scheme="light", motion="no-preference", kind=""):
        self.cdp("Emulation.setEmulatedMedia", media=kind, features=[
            {"name": "prefers-color-scheme", "value": scheme}, {"name": "prefers-reduced-motion", "value": motion}])

    def open(self, path, query=""):
        self.post("/url", {"url": "file://" + os.path.abspath(path) + query})
        self.settle()

    def settle(self):
        """Until the viewer has drawn what it was asked for."""
        script = """const v = document.getElementById('viewer') || document.body, done = arguments[arguments.length - 1];
            let quiet = 0, last = '';
            const look = () => {
              const now = v.dataset.drawn + '|' + v.hasAttribute('aria-busy');
              quiet = now === last && !v.hasAttribute('aria-busy') ? quiet + 1 : 0;
              last = now;
              if (quiet >= 2) done(true); else requestAnimationFrame(look);
            };
            look();"""
        return self.post("/execute/async", {"script": script, "args": []})

    def keys(self, *keys, down=()):
        names = {"Left": "\ue012", "Up": "\ue013", "Right": "\ue014", "Down": "\ue015", "Tab": "\ue004", "Enter": "\ue007",
                 "Escape": "\ue00c", "Shift": "\ue008", "Alt": "\ue00a", "Space": " ", "Home": "\ue011", "End": "\ue010"}
        held = [names[k] for k in down]
        steps = [{"type": "keyDown", "value": k} for k in held]
        for key in keys:
            steps += [{"type": t, "value": names.get(key, key)} for t in ("keyDown", "keyUp")]
        steps += [{"type": "keyUp", "value": k} for k in held]
        self.post("/actions", {"actions": [{"type": "key", "id": "keyboard", "actions": steps}]})
        self.settle()

    def pointer(self, *steps):
        """("move", x, y), "down", "up"."""
        actions = [{"type": "pointerMove", "duration": 0, "x": math.floor(s[1]), "y": math.floor(s[2])} if s[0] == "move"
                   else {"type": "pointerDown" if s == "down" else "pointerUp", "button": 0} for s in steps]
        self.post("/actions", {"actions": [{"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": actions}]})
        self.settle()

    def wheel(self, x, y, delta):
        self.post("/actions", {"actions": [{"type": "wheel", "id": "wheel", "actions": [
            {"type": "scroll", "x": round(x), "y": round(y), "deltaX": 0, "deltaY": delta, "duration": 0}]}]})
        self.settle()

    def log(self, kind):
        return self.post("/se/log", {"type": kind})

    def shot(self, path, full=True):
        data = self.cdp("Page.captureScreenshot", captureBeyondViewport=full, format="png")["data"]
        with open(path, "wb") as file:
            file.write(base64.b64decode(data))
