#!/usr/bin/env python3
"""Opens reports of `vlx-compare sweep` and `sequence` in headless Chromium and uses them.

    report_test.py REPORT.html [--screenshots FOLDER]
    report_test.py --bin FOLDER --testdata FOLDER      makes small reports first, with and without a reference

Drives chromedriver by the W3C WebDriver protocol with nothing but the standard library. Fails on any console message of
the page, on any network request, and on controls that do not change what they should.
"""
import argparse
import base64
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request

failures = []


def check(condition, what):
    print(("ok    " if condition else "FAILED ") + what)
    if not condition:
        failures.append(what)


class Browser:
    """A session of chromedriver; its profile is a temporary folder."""

    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix="variolux-browser-")
        # Port 0: chromedriver chooses a free one and says which.
        self.driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE, text=True)
        port = None
        for line in self.driver.stdout:
            if "successfully on port" in line:
                port = line.rsplit("on port", 1)[1].strip(" .\n")
                break
        if port is None:
            raise SystemExit("chromedriver did not start")
        self.opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        self.base = f"http://127.0.0.1:{port}"
        arguments = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars",
                     "--window-size=1280,1000", f"--user-data-dir={self.folder}"]
        options = {"args": arguments, "perfLoggingPrefs": {"enableNetwork": True}}
        answer = self.call("POST", "/session", {"capabilities": {"alwaysMatch": {
            "browserName": "chrome", "goog:chromeOptions": options,
            "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"}}}})
        self.session = f"/session/{answer['sessionId']}"

    def call(self, method, path, body=None):
        request = urllib.request.Request(self.base + path, method=method,
                                         data=None if body is None else json.dumps(body).encode(),
                                         headers={"Content-Type": "application/json"})
        with self.opener.open(request, timeout=120) as response:
            return json.load(response)["value"]

    def open(self, url):
        self.call("POST", self.session + "/url", {"url": url})

    def run(self, script, *arguments):
        """The script's return value; it may await."""
        body = f"const done = arguments[arguments.length - 1]; (async () => {{ {script} }})().then(done, e => done('error: ' + e));"
        return self.call("POST", self.session + "/execute/async", {"script": body, "args": list(arguments)})

    def cdp(self, command, parameters):
        return self.call("POST", self.session + "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def keys(self, selector, text):
        """Focuses an element and types into it, as a keyboard would."""
        self.run("document.querySelector(arguments[0]).focus();", selector)
        actions = []
        for key in text:
            actions += [{"type": "keyDown", "value": key}, {"type": "keyUp", "value": key}]
        self.call("POST", self.session + "/actions", {"actions": [{"type": "key", "id": "keyboard", "actions": actions}]})

    def logs(self, kind):
        return self.call("POST", self.session + "/se/log", {"type": kind})

    def screenshot(self, path):
        """The whole page."""
        size = self.run("return [document.documentElement.scrollWidth, document.documentElement.scrollHeight];")
        shot = self.cdp("Page.captureScreenshot", {"captureBeyondViewport": True, "clip": {
            "x": 0, "y": 0, "width": size[0], "height": min(size[1], 12000), "scale": 1}})
        pathlib.Path(path).write_bytes(base64.b64decode(shot["data"]))

    def close(self):
        try:
            self.call("DELETE", self.session)
        finally:
            self.driver.terminate()
            self.driver.wait()
            shutil.rmtree(self.folder, ignore_errors=True)


ARROW_DOWN, ARROW_RIGHT, ENTER = "\ue015", "\ue014", "\ue007"
SETTLE = "while (page.viewer && !page.viewer.settled()) await new Promise(r => setTimeout(r, 20));"
PICTURE = "return document.getElementById('picture').toDataURL();"


def use(browser, url, screenshots):
    browser.open(url)
    for _ in range(600):
        ready = browser.run("return document.documentElement.dataset.ready === 'yes' && (!page.viewer || page.viewer.settled()) && "
                            "(!page.inspector || document.getElementById('regions').dataset.region !== undefined);")
        if ready:
            break
        time.sleep(.1)
    check(ready, "the page becomes ready")

    check(browser.run("return document.querySelectorAll('#by-time .mark').length;") > 3, "the chart has points")
    check(browser.run("return document.querySelectorAll('#table tbody tr').length;") > 3, "the table has rows")
    check(browser.run("return document.querySelector('#table').textContent.includes('NaN') || document.body.innerText.includes('undefined');") is False,
          "no NaN or undefined is shown")
    check(browser.run("return [...document.querySelectorAll('svg path')].every(p => !p.getAttribute('d').includes('NaN'));"),
          "no chart line has a NaN")

    # Another measure draws another chart; a series can be switched off.
    before = browser.run("return document.getElementById('by-time').innerHTML;")
    browser.run("const s = document.getElementById('measure'); s.selectedIndex = s.options.length - 1; s.dispatchEvent(new Event('change'));")
    check(browser.run("return document.getElementById('by-time').innerHTML;") != before, "the measure can be chosen")
    browser.run("const s = document.getElementById('measure'); s.selectedIndex = 0; s.dispatchEvent(new Event('change'));")
    points = browser.run("return document.querySelectorAll('#by-time .mark').length;")
    browser.run("document.querySelector('.legend button').click();")
    check(browser.run("return document.querySelectorAll('#by-time .mark').length;") < points, "the legend hides a series")
    browser.run("document.querySelector('.legend button').click();")

    # The viewer, by mouse and keyboard.
    settled = lambda: browser.run(SETTLE + PICTURE)
    first = settled()
    browser.run("const s = document.getElementById('split'); s.value = 20; s.dispatchEvent(new Event('input'));")
    second = settled()
    check(second != first, "the divider's slider acts")
    check(browser.run("return document.getElementById('divider').style.left.includes('20%');"), "the divider moves with it")
    browser.keys("#viewer", "++")
    third = settled()
    check(third != second and browser.run("return page.viewer.state.zoom;") == 1, "plus zooms")
    browser.keys("#viewer", ARROW_RIGHT)
    check(settled() != third, "arrows pan")
    # Both sides show the same place: with one image on both, the divider must not show.
    browser.run("const l = document.getElementById('left'); window.oldLeft = l.value; l.value = document.getElementById('right').value; l.dispatchEvent(new Event('change'));")
    same = settled()
    browser.keys("#viewer", "...")
    check(settled() == same, "zoom and position are the same on both sides")
    browser.run("const l = document.getElementById('left'); l.value = window.oldLeft; l.dispatchEvent(new Event('change'));")
    third = settled()
    browser.keys("#viewer", "e")
    check(settled() != third, "exposure acts")
    for _ in range(browser.run("return document.getElementById('view').options.length;") - 1):
        third = settled()
        browser.keys("#viewer", "v")
        check(settled() != third, "view: " + browser.run("return document.getElementById('view').selectedOptions[0].textContent;"))
    browser.run("document.getElementById('reset').click();" + SETTLE)
    box = browser.run("document.getElementById('viewer').scrollIntoView(); const b = document.getElementById('viewer').getBoundingClientRect(); return [b.x, b.y, b.width, b.height];")
    split = browser.run("return page.viewer.state.split;")
    middle = round(box[1] + min(box[3], 600) / 2)
    browser.call("POST", browser.session + "/actions", {"actions": [{"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": [
        {"type": "pointerMove", "x": round(box[0] + split * box[2]), "y": middle}, {"type": "pointerDown", "button": 0},
        {"type": "pointerMove", "x": round(box[0] + .8 * box[2]), "y": middle, "duration": 50}, {"type": "pointerUp", "button": 0}]}]})
    check(abs(browser.run("return page.viewer.state.split;") - .8) < .02, "the divider can be dragged")
    browser.run("page.viewer.change({view: 'radiance', exposure: 0, split: .5});")

    # Calibration, if there is a reference.
    if browser.run("return document.getElementById('calibrated') !== null;"):
        before = browser.run("return document.getElementById('scores').innerHTML;")
        browser.run("const s = document.getElementById('calibrated'); s.selectedIndex = (s.selectedIndex + 1) % s.options.length; s.dispatchEvent(new Event('change'));")
        check(browser.run("return document.getElementById('scores').innerHTML;") != before, "the calibrated setting can be chosen")

    # The inspector, if regions were inspected.
    if browser.run("return document.getElementById('regions') !== null;"):
        region = lambda: browser.run("return document.getElementById('regions').dataset.region;")
        old = region()
        check(browser.run("return document.querySelector('#variogram .model') !== null;"), "a fitted model is drawn")
        check(browser.run("return document.querySelectorAll('#variogram circle').length;") > 10, "the cloud is drawn")
        browser.keys("#regions", ENTER)
        check(region() != old, "Enter goes to the next inspected region")
        old = region()
        browser.keys("#regions", ARROW_DOWN)
        check(region() != old, "arrows move between regions")
        old = region()
        browser.run("const c = document.getElementById('regions'), b = c.getBoundingClientRect(); "
                    "c.dispatchEvent(new MouseEvent('click', {clientX: b.x + b.width * .93, clientY: b.y + b.height * .9}));")
        check(region() != old, "a click chooses a region")
        check(browser.run("return document.getElementById('region').textContent.includes('condition');"), "its condition number is told")
        browser.keys("#regions", ENTER)
    look(browser, url, screenshots, "")


def use_sequence(browser, url, screenshots):
    """The page of `vlx-compare sequence`."""
    browser.open(url)
    ready = lambda: browser.run("return document.documentElement.dataset.ready === 'yes' && asked === drawn;")
    for _ in range(100):
        if ready():
            break
        time.sleep(.1)
    check(ready(), "the page becomes ready")
    check(browser.run("return document.querySelectorAll('#by-frame .mark').length;") == 6, "the chart has a point a frame and sequence")
    check(browser.run("return document.querySelectorAll('#player canvas').length;") == 3, "the reference and two sequences are shown")
    check(browser.run("return /NaN|undefined|null/.test(document.body.innerText);") is False, "no NaN or undefined is shown")
    check(browser.run("return [...document.querySelectorAll('svg path')].every(p => !p.getAttribute('d').includes('NaN'));"),
          "no chart line has a NaN")
    chart = browser.run("return document.getElementById('by-frame').innerHTML;")
    browser.run("const s = document.getElementById('measure'); s.selectedIndex = 1; s.dispatchEvent(new Event('change'));")
    check(browser.run("return document.getElementById('by-frame').innerHTML;") != chart, "the measure can be chosen")
    browser.run("document.querySelector('.legend button').click();")
    check(browser.run("return document.querySelectorAll('#by-frame .mark').length;") == 2, "the legend hides a sequence")
    browser.run("document.querySelector('.legend button').click();")

    shown = lambda: browser.run("while (asked !== drawn) await new Promise(r => setTimeout(r, 20));"
                                "return sources.map((s) => s.canvas.toDataURL()).join();")
    first = shown()
    browser.run("const f = document.getElementById('frame'); f.value = 1; f.dispatchEvent(new Event('input'));")
    second = shown()
    check(second != first and browser.run("return document.getElementById('frame-value').textContent;") == "8", "a frame can be chosen")
    for control, value, event in (("view", "signed", "change"), ("view", "relative", "change"), ("view", "radiance", "change"), ("exposure", 2, "input")):
        before = shown()
        browser.run("const c = document.getElementById(arguments[0]); c.value = arguments[1]; c.dispatchEvent(new Event(arguments[2]));", control, value, event)
        check(shown() != before, f"{control} {value} acts")
    frames = browser.run("document.getElementById('speed').value = 50; document.getElementById('play').click(); const seen = new Set();"
                         "for (let i = 0; i < 200 && seen.size < 3; ++i) { seen.add(document.getElementById('frame-value').textContent); await new Promise(r => setTimeout(r, 5)); }"
                         "document.getElementById('play').click(); return seen.size;")
    check(frames == 3, "it plays all frames")
    stopped = shown()
    time.sleep(.2)
    check(shown() == stopped and browser.run("return document.getElementById('play').textContent;") == "Play", "and stops")
    look(browser, url, screenshots, "sequence_")


def look(browser, url, screenshots, name):
    """What every page must be."""
    # Nothing wider than the window but what scrolls in itself.
    check(browser.run("return document.documentElement.scrollWidth <= window.innerWidth;"), "the page is not wider than the window")
    if screenshots:
        browser.screenshot(os.path.join(screenshots, name + "light.png"))
    browser.cdp("Emulation.setDeviceMetricsOverride", {"width": 390, "height": 800, "deviceScaleFactor": 1, "mobile": True})
    check(browser.run("return document.documentElement.scrollWidth <= 390;"), "nor than a telephone's")
    browser.cdp("Emulation.clearDeviceMetricsOverride", {})
    browser.cdp("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": "dark"}]})
    dark = browser.run("return getComputedStyle(document.body).backgroundColor;")
    check(sum(int(v) for v in dark[4:-1].split(",")) < 150, "dark when the reader prefers dark")
    if screenshots:
        browser.screenshot(os.path.join(screenshots, name + "dark.png"))
    browser.cdp("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": "light"}]})
    pdf = base64.b64decode(browser.call("POST", browser.session + "/print", {"background": True}))
    check(pdf.startswith(b"%PDF") and len(pdf) > 20000, "it prints")
    if screenshots:
        pathlib.Path(screenshots, name + "print.pdf").write_bytes(pdf)

    messages = browser.logs("browser")
    check(not messages, f"the console is empty {messages[:3]}")
    requests = [json.loads(entry["message"])["message"] for entry in browser.logs("performance")]
    outside = [r["params"]["request"]["url"][:80] for r in requests if r["method"] == "Network.requestWillBeSent"
               and r["params"].get("documentURL") == url and not r["params"]["request"]["url"].startswith(("file:", "data:", "blob:"))]
    check(not outside, f"nothing is loaded from elsewhere {outside[:3]}")


def make_reports(programs, testdata, folder):
    """Small sweeps of the test dump: with a reference (its own average) and a trace time, and without either."""
    dump = os.path.join(testdata, "dumps", "tungsten_cornell.exr")
    reference = os.path.join(folder, "reference.exr")
    subprocess.run([os.path.join(programs, "vlx-krige"), dump, "-o", reference, "--method", "mean", "--quiet"], check=True)
    sweep = [os.path.join(programs, "vlx-compare"), "sweep", dump, "--quiet", "--spp", "2,4", "--seeds", "2", "--inspect", "9"]
    subprocess.run(sweep + ["-o", folder + "/with", "--reference", reference, "--trace-seconds", "8", "--crop", "102,124,8,8",
                            "--external", "broken=exit 4; {input} {output}", "--target", "relmse=100"],
                   stdout=subprocess.DEVNULL)  # exit code 1: one method fails, and is to be shown failing
    subprocess.run(sweep + ["-o", folder + "/without", "--no-vary"], check=True)
    return [folder + "/with/report.html", folder + "/without/report.html", make_sequence(programs, dump, reference, folder)]


def make_sequence(programs, dump, reference, folder):
    """Three frames of the test dump, of two samples a pixel each, by two methods."""
    for frame in (7, 8, 9):
        shutil.copy(reference, f"{folder}/ref_{frame}.exr")
        samples = f"{folder}/samples_{frame}.exr"
        subprocess.run([os.path.join(programs, "vlx-pack"), "subset", dump, "-o", samples, "--samples", "2", "--part", str(frame - 6), "--quiet"], check=True)
        for method in ("mean", "gaussian"):
            subprocess.run([os.path.join(programs, "vlx-krige"), samples, "-o", f"{folder}/{method}_{frame}.exr", "--method", method, "--quiet"], check=True)
    page = folder + "/sequence.html"
    subprocess.run([os.path.join(programs, "vlx-compare"), "sequence", folder + "/ref_#.exr", folder + "/mean_#.exr", folder + "/gaussian_#.exr",
                    "--report", page, "--quiet"], check=True)
    return page


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("report", nargs="?")
    parser.add_argument("--screenshots")
    parser.add_argument("--bin")
    parser.add_argument("--testdata")
    arguments = parser.parse_args()
    if arguments.screenshots:
        os.makedirs(arguments.screenshots, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="variolux-report-") as folder:
        reports = [arguments.report] if arguments.report else make_reports(arguments.bin, arguments.testdata, folder)
        for report in reports:
            print(report)
            browser = Browser()
            try:
                look_at = use_sequence if report.endswith("sequence.html") else use
                look_at(browser, pathlib.Path(report).resolve().as_uri(), arguments.screenshots)
            finally:
                browser.close()
    print(f"{len(failures)} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
