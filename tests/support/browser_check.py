#!/usr/bin/env python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Opens HTML files in a headless Chromium and prints their problems, one per line.

    browser_check.py [--pictures FOLDER] FILE.html ...

Checks for errors and external requests; empty pictures; basic accessibility (language, title, headings,
alternative texts, table headers, contrast, sizes); pages wider than the screen of a phone. Writes FILE.pdf
beside each file, in the paper size of the page, and with --pictures screenshots of a desktop and a phone.
Exit code 0: no problems; 1: problems; 77: no browser is installed.

Uses Chromium's DevTools protocol (https://chromedevtools.github.io/devtools-protocol/) over a pipe, so that
only the browser and Python are required.
"""
import argparse
import base64
import json
import os
import pathlib
import select
import shutil
import subprocess
import sys
import tempfile
import time

BROWSERS = ["chromium-headless-shell", "chromium", "google-chrome"]
PAGE_CHECKS = pathlib.Path(__file__).with_name("page_checks.js").read_text()
PATIENCE_S = 120


class Browser:
    """Browser with one page. Calls wait for their answer; events are stored."""

    def __init__(self, program, profile):
        from_us, self._write = os.pipe()
        self._read, to_us = os.pipe()

        def in_child():  # the browser reads from descriptor 3 and writes to 4
            high = [os.dup2(from_us, 50), os.dup2(to_us, 51)]
            os.dup2(high[0], 3)
            os.dup2(high[1], 4)

        self._process = subprocess.Popen(
            [program, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
             "--hide-scrollbars", "--remote-debugging-pipe", f"--user-data-dir={profile}"],
            preexec_fn=in_child, close_fds=False,
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(from_us)
        os.close(to_us)
        self._session, self._id, self._buffer, self.events = None, 0, b"", []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ["Page", "Runtime", "Log", "Network"]:
            self.call(domain + ".enable")

    def call(self, method, **parameters):
        self._id += 1
        message = {"id": self._id, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._id:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]
            self.events.append(answer)

    def wait_for(self, method):
        while not any(event.get("method") == method for event in self.events):
            self.events.append(self._next())

    def evaluate(self, script):
        answer = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(answer["exceptionDetails"]["exception"].get("description"))
        return answer["result"]["value"]

    def screen(self, width, mobile):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=800,
                  deviceScaleFactor=2 if mobile else 1, mobile=mobile)

    def close(self):
        self._process.kill()
        self._process.wait()

    def _next(self):
        end = time.monotonic() + PATIENCE_S
        while b"\0" not in self._buffer:
            if not select.select([self._read], [], [], max(0, end - time.monotonic()))[0]:
                raise RuntimeError("the browser does not answer")
            part = os.read(self._read, 1 << 20)
            if not part:
                raise RuntimeError("the browser has ended")
            self._buffer += part
        message, self._buffer = self._buffer.split(b"\0", 1)
        return json.loads(message)


def find_event_problems(events, address):
    for event in events:
        parameters = event.get("params", {})
        if event.get("method") == "Runtime.exceptionThrown":
            yield "a script fails: " + parameters["exceptionDetails"]["text"]
        elif event.get("method") == "Log.entryAdded" and parameters["entry"]["level"] != "verbose":
            yield "the console says: " + parameters["entry"]["text"]
        elif event.get("method") == "Runtime.consoleAPICalled":
            yield "the console says: " + str(parameters["args"])
        elif event.get("method") == "Network.requestWillBeSent":
            url = parameters["request"]["url"]
            if url != address and not url.startswith("data:"):
                yield "asks for " + url


def check(browser, file, pictures):
    address = file.resolve().as_uri()
    browser.screen(1280, False)
    browser.events.clear()
    browser.call("Page.navigate", url=address)
    browser.wait_for("Page.loadEventFired")
    problems = []
    for name, width, mobile in [("desktop", 1280, False), ("phone", 360, True)]:
        browser.screen(width, mobile)
        page = browser.evaluate("[document.documentElement.scrollWidth, document.body.scrollHeight]")
        problems += browser.evaluate(PAGE_CHECKS)
        if page[0] > width:
            problems.append(f"is {page[0]} px wide on a screen of {width} px")
        if pictures:
            shot = browser.call("Page.captureScreenshot", captureBeyondViewport=True, clip={
                "x": 0, "y": 0, "width": width, "height": page[1], "scale": 1})
            (pictures / f"{file.stem}-{name}.png").write_bytes(base64.b64decode(shot["data"]))
    pdf = browser.call("Page.printToPDF", preferCSSPageSize=True, paperWidth=11, paperHeight=17)
    file.with_suffix(".pdf").write_bytes(base64.b64decode(pdf["data"]))
    problems += find_event_problems(browser.events, address)
    return list(dict.fromkeys(problems))  # without duplicates


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--pictures", type=pathlib.Path)
    parser.add_argument("files", type=pathlib.Path, nargs="+")
    arguments = parser.parse_args()
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        print("no browser: install one of " + ", ".join(BROWSERS))
        return 77
    found = 0
    with tempfile.TemporaryDirectory() as profile:
        browser = Browser(program, profile)
        try:
            for file in arguments.files:
                for problem in check(browser, file, arguments.pictures):
                    print(f"{file.name}: {problem}")
                    found += 1
        finally:
            browser.close()
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
