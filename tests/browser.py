"""A page in a real browser: Debian's headless chromium, spoken to in its DevTools protocol over a pair of pipes.

Messages are JSON ended by a zero byte, read by the browser on descriptor 3 and written on 4. The browser knows no host name and
draws with its own software renderer.
"""

import base64
import fcntl
import io
import json
import os
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Self

import numpy as np
from PIL import Image

PROGRAM = shutil.which("chromium")
FLAGS = [
    "--headless=new",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--hide-scrollbars",
    "--no-first-run",
    "--disable-background-networking",
    "--host-resolver-rules=MAP * ~NOTFOUND",
    "--remote-debugging-pipe",
    "--window-size=960,700",
]
# A program that becomes the browser, with the two pipes that it is given in the place of the descriptors 3 and 4.
_START = """
import os, sys
os.dup2(int(sys.argv[1]), 3), os.dup2(int(sys.argv[2]), 4), os.execv(sys.argv[3], sys.argv[3:])
"""


class Browser:
    """One page at a time; ``events`` is everything that the browser reported of it."""

    def __init__(self, profile: Path, *flags: str) -> None:
        assert PROGRAM is not None
        read, self._to = os.pipe()
        self._from, write = os.pipe()
        ends = [fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in (read, write)]
        words = [PROGRAM, *FLAGS, f"--user-data-dir={profile}", *flags, "about:blank"]
        command = [sys.executable, "-c", _START, *(str(end) for end in ends), *words]
        quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self._process = subprocess.Popen(command, pass_fds=ends, **quiet)
        for end in (read, write, *ends):
            os.close(end)
        self._rest, self._count, self.events = b"", 0, []
        targets = self._call("Target.getTargets", None)["targetInfos"]
        page = next(target["targetId"] for target in targets if target["type"] == "page")
        self._session = self._call("Target.attachToTarget", None, targetId=page, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """A browser whose pipes are closed ends; one that does not is ended."""
        os.close(self._to)
        os.close(self._from)
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """What a method of the page answers."""
        return self._call(method, self._session, **parameters)

    def open(self, path: Path, fragment: str = "") -> None:
        """Go to a file, and forget what was reported of the page before."""
        self.call("Page.navigate", url="about:blank")
        self.events.clear()
        self.call("Page.navigate", url=path.resolve().as_uri() + fragment)

    def screen(self, width: int, scheme: str = "light", media: str = "") -> None:
        """Be ``width`` pixels wide, as a screen in a colour ``scheme`` or, as ``media`` "print", as paper."""
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **size)
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        self.call("Emulation.setEmulatedMedia", media=media, features=features)

    def ask(self, expression: str) -> Any:
        """The value of an expression in the page."""
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, expression: str, seconds: float = 30) -> None:
        """Until an expression in the page is true."""
        until = time.monotonic() + seconds
        while not self.ask(f"Boolean({expression})"):
            assert time.monotonic() < until, f"never true: {expression}; reported: {self.complaints()}"
            time.sleep(0.05)

    def press(self, key: str) -> None:
        """Press and release a key by its name."""
        codes = {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, "Home": 36, "End": 35, "Enter": 13}
        for kind in ("keyDown", "keyUp"):
            typed = {"text": "\r"} if key == "Enter" and kind == "keyDown" else {}
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=codes[key], **typed)

    def picture(self, element: str) -> np.ndarray[Any, Any]:
        """The pixels (height, width, 3) of the element that a selector names, once two frames were drawn."""
        self.ask("new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go)))")
        box = self.ask(
            f"(({{x, y, width, height}}) => ({{x: x + scrollX, y: y + scrollY, width, height, scale: 1}}))"
            f"(document.querySelector({json.dumps(element)}).getBoundingClientRect())"
        )
        shot = self.call("Page.captureScreenshot", format="png", clip=box, captureBeyondViewport=True)["data"]
        return np.asarray(Image.open(io.BytesIO(base64.b64decode(shot))).convert("RGB")).astype(int)

    def requests(self) -> list[str]:
        """The addresses that the page asked for."""
        return [
            event["params"]["request"]["url"] for event in self.events if event["method"] == "Network.requestWillBeSent"
        ]

    def complaints(self) -> list[str]:
        """Errors and warnings of the page's console and of the browser about it, and exceptions."""
        printed = []
        for event in self.events:
            kind, facts = event["method"], event["params"]
            if kind == "Runtime.exceptionThrown":
                printed.append(json.dumps(facts["exceptionDetails"]))
            elif kind == "Runtime.consoleAPICalled" and facts["type"] in ("error", "warning", "assert"):
                printed.append(json.dumps(facts["args"]))
            elif kind == "Log.entryAdded" and facts["entry"]["level"] in ("error", "warning"):
                printed.append(facts["entry"]["text"])
        return printed

    def _call(self, method: str, session: str | None, **parameters: Any) -> dict[str, Any]:
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}
        if session is not None:
            message["sessionId"] = session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while (answer := self._next(method)).get("id") != self._count:
            self.events.append(answer)
        assert "error" not in answer, answer["error"]
        return dict(answer["result"])

    def _next(self, method: str) -> dict[str, Any]:
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._from], [], [], 60)
            more = os.read(self._from, 1 << 20) if ready else b""
            assert more, f"the browser said nothing to {method}"
            self._rest += more
        message, _, self._rest = self._rest.partition(b"\0")
        return dict(json.loads(message))
