#!/usr/bin/python3
"""browser.py URL --until EXPRESSION [--wait S] [--after S] [--size WxH] [--picture OUT.png] [--print EXPRESSION]...

Opens a page in headless Chromium, waits until a JavaScript expression is true there, prints others, takes a picture.
Chromium is spoken to over two pipes (its DevTools protocol), so no port is opened. Exit code: 0 true in time and no error or
refused content on the page; 1 otherwise; 77 no Chromium on this machine.
"""
import argparse
import base64
import fcntl
import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time

FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync", "--remote-debugging-pipe"]


class Browser:
    """One Chromium with one page, in a profile of its own that is removed at the end."""

    def __init__(self, program, size):
        self.folder = tempfile.mkdtemp(prefix="cyclops-browser-")
        ends = [fcntl.fcntl(fd, fcntl.F_DUPFD_CLOEXEC, 10) for pair in (os.pipe(), os.pipe()) for fd in pair]

        def into_place():                       # Chromium reads from 3 and writes to 4
            os.dup2(ends[0], 3)
            os.dup2(ends[3], 4)

        self.process = subprocess.Popen([program, *FLAGS, "--user-data-dir=" + self.folder, "about:blank"], close_fds=False, preexec_fn=into_place,
                                        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(ends[0])
        os.close(ends[3])
        self.to, self.back = ends[1], ends[2]
        self.number, self.session, self.rest, self.complaints = 0, None, b"", []
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.ask(domain + ".enable")
        self.ask("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1, mobile=False)

    def ask(self, method, **params):
        self.number += 1
        message = {"id": self.number, "method": method, "params": params}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.to, json.dumps(message).encode() + b"\0")
        end = time.monotonic() + 30
        while True:
            answer = self.hear(end)
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(method + ": " + answer["error"]["message"])
                return answer["result"]

    def hear(self, end):
        while b"\0" not in self.rest:
            ready, _, _ = select.select([self.back], [], [], max(0, end - time.monotonic()))
            more = os.read(self.back, 1 << 20) if ready else b""
            if not more:
                raise RuntimeError("Chromium does not answer")
            self.rest += more
        text, self.rest = self.rest.split(b"\0", 1)
        message = json.loads(text)
        if message.get("method") == "Runtime.exceptionThrown":
            self.complaints.append(message["params"]["exceptionDetails"].get("exception", {}).get("description", "exception"))
        if message.get("method") == "Log.entryAdded" and message["params"]["entry"]["level"] == "error":
            self.complaints.append(message["params"]["entry"]["text"])
        return message

    def value(self, expression):
        return self.ask("Runtime.evaluate", expression=expression, returnByValue=True)["result"].get("value")

    def close(self):
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("url")
    parser.add_argument("--until", default="true")
    parser.add_argument("--wait", type=float, default=30)
    parser.add_argument("--after", type=float, default=0)
    parser.add_argument("--size", default="1480x1000")
    parser.add_argument("--picture")
    parser.add_argument("--print", action="append", default=[])
    options = parser.parse_args()
    program = next((p for p in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if p), None)
    if program is None:
        print("no Chromium on this machine", file=sys.stderr)
        sys.exit(77)
    browser = Browser(program, [int(n) for n in options.size.split("x")])
    try:
        browser.ask("Page.navigate", url=options.url)
        end = time.monotonic() + options.wait
        came = False
        while not came and time.monotonic() < end:
            time.sleep(0.1)
            came = bool(browser.value(options.until))
        time.sleep(options.after)
        for expression in options.print:
            print(browser.value(expression))
        if options.picture:
            with open(options.picture, "wb") as f:
                f.write(base64.b64decode(browser.ask("Page.captureScreenshot", format="png")["data"]))
    finally:
        browser.close()
    for complaint in browser.complaints:
        print("page: " + complaint, file=sys.stderr)
    if not came:
        print("never true: " + options.until, file=sys.stderr)
    sys.exit(0 if came and not browser.complaints else 1)


main()
