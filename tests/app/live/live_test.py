#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The live bench before a virtual chip: live_test.py MELTSTAGE TEST [PICTURES]. TEST is a function below."""
import http.client
import json
import os
import pathlib
import re
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "page"))
from browser import Browser  # noqa: E402

MELTSTAGE = sys.argv[1]
TOKEN = "0123456789abcdef-token"
ESCAPE, TAB, ENTER = "\ue00c", "\ue004", "\ue007"


def command(*arguments: str, status: int = 0) -> str:
    done = subprocess.run([MELTSTAGE, *arguments], capture_output=True, text=True, timeout=60)
    assert done.returncode == status, f"{arguments}: exit status {done.returncode}, expected {status}: {done.stderr}"
    return done.stdout + done.stderr


def until(condition, what: str, limit_s: float = 10.0):
    end = time.monotonic() + limit_s
    while time.monotonic() < end:
        if value := condition():
            return value
        time.sleep(0.02)
    raise AssertionError(f"not within {limit_s} s: {what}")


def press(browser: Browser, selector: str) -> None:
    """As a person would, who sees what the page's top doesn't hide."""
    browser.run("document.querySelector(arguments[0]).scrollIntoView({block: 'center'})", selector)
    browser.click(selector)


class Chip:
    """A virtual chip behind a link; a context manager."""

    def __init__(self, folder: pathlib.Path) -> None:
        self.link = folder / "tc"
        self.start()

    def start(self) -> None:
        self.process = subprocess.Popen([MELTSTAGE, "chip", "serve", "--port", str(self.link)], stdout=subprocess.PIPE, text=True)
        assert "ends with Ctrl-C" in self.process.stdout.readline()

    def unplug(self) -> None:
        self.process.kill()
        self.process.wait(20)

    def read(self, register: str) -> str:
        return command("chip", "read", "--port", str(self.link), register).split()[1]

    def runs(self) -> bool:
        return int(self.read("STATUS"), 16) & 1 == 1

    def __enter__(self) -> "Chip":
        return self

    def __exit__(self, *_: object) -> None:
        self.process.send_signal(signal.SIGCONT)
        self.process.terminate()
        self.process.wait(20)


class Live:
    """The server; a context manager."""

    def __init__(self, *arguments: str, listen: str = "127.0.0.1:0", largest_file: int = resource.RLIM_INFINITY) -> None:
        limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, largest_file))  # noqa: E731
        self.process = subprocess.Popen([MELTSTAGE, "live", "--listen", listen, *arguments], stdout=subprocess.PIPE, text=True, preexec_fn=limit)
        line = self.process.stdout.readline()
        self.host = re.search(r"http://([^/]+)/", line).group(1)
        self.port = int(self.host.rsplit(":", 1)[1])
        self.ids = 0
        self.expected = 0  # exit status

    def ask(self, method: str, path: str, body: str | bytes | None = None, headers: dict | None = None) -> tuple[int, str]:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        connection.request(method, path, body, {"Content-Type": "application/json", **(headers or {})})
        answer = connection.getresponse()
        return answer.status, answer.read().decode()

    def post(self, what: dict, **options) -> tuple[int, str]:
        self.ids += 1
        return self.ask("POST", "/command", json.dumps({"id": f"test {self.ids}", **what}), **options)

    def raw(self, text: bytes) -> bytes:
        """What comes back for these bytes, until the server closes."""
        with socket.create_connection(("127.0.0.1", self.port), 30) as line:
            line.sendall(text)
            answer = b""
            while piece := line.recv(65536):
                answer += piece
            return answer

    def memory_kb(self) -> int:
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+)", status).group(1))

    def __enter__(self) -> "Live":
        return self

    def __exit__(self, *_: object) -> None:
        self.process.terminate()
        ended = self.process.wait(30)
        assert ended == self.expected, f"exit status {ended}, expected {self.expected}"


class Events:
    """A listener: what the server tells, as (name, data)."""

    def __init__(self, live: Live, path: str = "/events", headers: dict | None = None) -> None:
        self.connection = http.client.HTTPConnection("127.0.0.1", live.port, timeout=30)
        self.connection.request("GET", path, headers=headers or {})
        self.answer = self.connection.getresponse()
        self.got: list[tuple[str, object]] = []
        self.ids: list[str] = []
        if self.answer.status == 200:
            threading.Thread(target=self.listen, daemon=True).start()

    def listen(self) -> None:
        name = number = ""
        try:
            for line in self.answer:
                key, _, value = line.decode().rstrip("\n").partition(": ")
                if key == "id":
                    number = value
                elif key == "event":
                    name = value
                elif key == "data":
                    self.ids.append(number)
                    self.got.append((name, json.loads(value)))
        except (OSError, ValueError, AttributeError):  # closed
            pass

    def of(self, name: str) -> list:
        return [data for event, data in list(self.got) if event == name]

    def until(self, name: str, fits, what: str, limit_s: float = 10.0):
        return until(lambda: next((data for data in self.of(name) if fits(data)), None), what, limit_s)


def connected(live: Live) -> Events:
    events = Events(live)
    events.until("connection", lambda data: data["connected"], "the chip answers")
    return events


def operate(body) -> None:
    """`body` with a chip and a server before it."""
    with tempfile.TemporaryDirectory() as name, Chip(pathlib.Path(name)) as chip, Live("--port", str(chip.link)) as live:
        body(chip, live)


def requests() -> None:
    """What a request must bring, and bounds."""
    def body(chip: Chip, live: Live) -> None:
        connected(live)
        own = {"Origin": f"http://{live.host}"}
        status, page = live.ask("GET", "/")
        assert status == 200 and page.startswith("<!DOCTYPE html>"), page[:100]
        for headers, expected in [({"Host": "evil.example"}, 403), ({"Host": f"evil.example:{live.port}"}, 403), ({"Origin": "http://evil.example"}, 403),
                                  ({"Origin": "null"}, 403), ({"Content-Type": "text/plain"}, 415), (own, 200)]:
            for path in ("/command",) if expected == 415 else ("/command", "/samples"):
                asked = live.post({"do": "stop"}, headers=headers) if path == "/command" else live.ask("GET", path, headers=headers)
                assert asked[0] == expected, f"{path} with {headers}: {asked}, expected {expected}"
        assert Events(live, headers={"Origin": "http://evil.example"}).answer.status == 403
        head = f"POST /command HTTP/1.1\r\nHost: {live.host}\r\nContent-Type: application/json\r\n".encode()
        for request, expected in [(head + b"Content-Length: 1073741824\r\n\r\n{", b" 413 "), (head + b"Transfer-Encoding: chunked\r\n\r\n1\r\n{\r\n", b" 411 "),
                                  (head + b"Content-Length: -1\r\n\r\n", b" 411 "), (b"GET /" + b"a" * 20_000 + b" HTTP/1.1\r\n\r\n", b" 414 "),
                                  (b"\x00\xff\x16\x03\x01 nonsense\r\n\r\n", b" 400 ")]:
            answer = live.raw(request)
            assert expected in answer.split(b"\r\n")[0], f"{request[:80]}: {answer[:80]}, expected{expected}"
        try:
            assert live.ask("POST", "/command", b"a" * 10_000_000)[0] == 413
        except (BrokenPipeError, ConnectionResetError):  # the server need not read what it refuses
            pass
        assert live.ask("GET", "/../../etc/passwd")[0] == 404
        listeners = [Events(live) for _ in range(20)]
        assert [listener.answer.status for listener in listeners].count(200) <= 16
        assert listeners[-1].answer.status == 503, "the 21st listener"
        count = len(listeners[0].of("reading"))
        until(lambda: len(listeners[0].of("reading")) > count, "the first listener still hears")
        assert live.post({"do": "stop"})[0] == 200
        assert live.memory_kb() < 100_000, f"{live.memory_kb()} kB"
    operate(body)


def once() -> None:
    """A command is done once, whatever comes twice, and only what the chip has is taken."""
    def body(chip: Chip, live: Live) -> None:
        connected(live)
        first = json.dumps({"id": "a", "do": "set", "register": "setpoint", "value": 60})
        assert live.ask("POST", "/command", first)[0] == 200
        assert live.post({"do": "set", "register": "SETPOINT", "value": 70})[0] == 200
        again = live.ask("POST", "/command", first)
        assert again[0] == 200 and "SETPOINT is 60.0 degC" in again[1], again
        assert chip.read("SETPOINT") == "70.0", chip.read("SETPOINT")
        other = live.ask("POST", "/command", json.dumps({"id": "a", "do": "run"}))
        assert other[0] == 409 and "was given to" in other[1], other
        for bad in ["", "{", "[]", "null", "[" * 60_000, '{"id":"b"}', '{"do":"run"}', '{"id":"","do":"run"}', '{"id":7,"do":"run"}', '{"id":"b","do":"dance"}',
                    '{"id":"b","do":"run","now":1}', '{"id":"b","do":"set","register":"SETPOINT"}', '{"id":"b","do":"set","register":"SETPOINT","value":"60"}',
                    '{"id":"b","do":"set","register":"SETPOINT","value":1e999}', '{"id":"b","do":"set","register":"SETPOINT","value":NaN}',
                    '{"id":"b","do":"set","register":"SETPOINT","value":5000}', '{"id":"b","do":"set","register":"PV","value":1}', '{"id":"b","do":"set","register":"NO","value":1}',
                    '{"id":"b","do":"set","register":"CMD","value":1}', '{"id":"b","do":"set","register":"ADDRESS","value":5}', json.dumps({"id": "b" * 65, "do": "run"})]:
            status, said = live.ask("POST", "/command", bad)
            assert status == 400 and said.count("\n") == 1, f"{bad[:80]}: {status} {said}"
        assert live.post({"do": "event", "event": "sensor open"})[0] == 409
        assert chip.read("SETPOINT") == "70.0" and not chip.runs()
        refused = live.post({"do": "tune"})
        assert refused[0] == 409 and "heating must be on" in refused[1], refused
    operate(body)


def silent() -> None:
    """A chip that falls silent: what was asked then is unknown, what waited is not sent, nothing is sent when it is back."""
    def body(chip: Chip, live: Live) -> None:
        events = connected(live)
        chip.process.send_signal(signal.SIGSTOP)
        answers = {}

        def ask(name: str, what: dict) -> threading.Thread:
            thread = threading.Thread(target=lambda: answers.update({name: live.post(what)}))
            thread.start()
            time.sleep(0.3)
            return thread
        asked = [ask("set", {"do": "set", "register": "SETPOINT", "value": 50}), ask("run", {"do": "run"}), ask("stop", {"do": "stop"})]
        for thread in asked:
            thread.join(30)
        # the first was on the line, or waited behind a poll that was
        assert answers["set"][0] == 504 or "nothing was sent" in answers["set"][1], answers
        assert answers["run"][0] == 409 and "nothing was sent: Stop came first" in answers["run"][1], answers
        assert answers["stop"][0] == 409 and "nothing was sent" in answers["stop"][1] and "no answer" in answers["stop"][1], answers
        assert not events.of("connection")[-1]["connected"]
        told = len(events.of("connection"))
        chip.process.send_signal(signal.SIGCONT)
        until(lambda: len(events.of("connection")) > told and events.of("connection")[-1]["connected"], "it answers again")
        command("chip", "set", "--port", str(chip.link), "SETPOINT=33")
        time.sleep(1.5)
        assert chip.read("SETPOINT") == "33.0" and not chip.runs(), "something was sent by itself"
        assert not any("reset" in notice["text"] for notice in events.of("notice")), events.of("notice")
        # one that is certainly on the line; the chip that is there afterwards has never heard of it
        for _ in range(20):
            chip.process.send_signal(signal.SIGSTOP)
            status, said = live.post({"do": "set", "register": "SETPOINT", "value": 50})
            if status == 504:
                assert "it may have been done or not" in said, said
                break
            chip.process.send_signal(signal.SIGCONT)
            until(lambda: events.of("connection")[-1]["connected"], "it answers again")
        assert status == 504, (status, said)
        chip.unplug()
        told = len(events.of("connection"))
        chip.start()
        until(lambda: len(events.of("connection")) > told and events.of("connection")[-1]["connected"], "another chip answers")
        time.sleep(1)
        assert chip.read("SETPOINT") == "0.0", "what was unknown was sent again"
    operate(body)


def operated() -> None:
    """By a person with a mouse; what is set is read back beside the page."""
    def body(chip: Chip, live: Live) -> None:
        with Browser() as browser:
            browser.open(f"http://{live.host}/")
            browser.until("return document.getElementById('temperature_now').textContent.includes('25.0')", "a temperature", 10)
            assert "Connected to Meltstage TC1" in browser.text("#connection"), browser.text("#connection")
            browser.run("document.getElementById('setpoint').value = ''")
            browser.keys("#setpoint", "87.5")
            press(browser, "#setpoint_form button")
            browser.until("return document.getElementById('outcome').textContent.includes('set SETPOINT 87.5 °C: done')", "the set-point is set", 5)
            assert chip.read("SETPOINT") == "87.5", chip.read("SETPOINT")
            press(browser, "#run")
            browser.until("return document.getElementById('condition').textContent.startsWith('Heating is on')", "heating", 5)
            assert chip.runs()
            browser.until("return parseFloat(document.getElementById('duty_now').textContent) > 0", "duty", 5)
            press(browser, "#stop")
            browser.until("return document.getElementById('condition').textContent.startsWith('Heating is off')", "no heating", 5)
            assert not chip.runs()
            browser.keys("#find", "KP")
            press(browser, '[aria-label="Set KP"]')
            browser.run("document.getElementById('write_value').value = ''")
            browser.keys("#write_value", "0.5" + ENTER)
            browser.until("return document.getElementById('outcome').textContent.includes('set KP 0.5 1/K: done')", "KP is set", 5)
            assert chip.read("KP").startswith("0.5"), chip.read("KP")
            browser.until("return Array.from(document.querySelectorAll('#registers tr')).some(row => !row.hidden && row.textContent.startsWith('KP') &&"
                          " row.cells[1].textContent.startsWith('0.5'))", "KP is shown", 5)
            browser.run("document.getElementById('setpoint').value = '499'")
            press(browser, "#setpoint_form button")
            browser.until("return document.getElementById('outcome').className === 'bad'", "a refusal by the chip", 5)
            log = browser.run("return Array.from(document.querySelectorAll('#log td:last-child'), cell => cell.textContent)")
            assert len(log) == 5 and "refused" in log[0] and log[4] == "set SETPOINT 87.5 °C: done, SETPOINT is 87.5 °C", log
            count, size = browser.run("const rows = new Rows(); for (let i = 0; i < 900_000; ++i) rows.add(i / 4, 20, 30, 40); return [rows.count, rows.data.byteLength]")
            assert 200_000 <= count <= 400_000 and size < 50_000_000, f"{count} rows, {size} bytes in a page that is left open for days"
            assert browser.run("return performance.getEntriesByType('resource').every(entry => entry.name.startsWith(location.origin))")
            assert [error for error in browser.errors() if " 409 " not in error] == []
    operate(body)


def lost() -> None:
    """The port goes and comes back; the chip behind it is another one by then."""
    def body(chip: Chip, live: Live) -> None:
        with Browser() as browser:
            browser.open(f"http://{live.host}/")
            browser.until("return document.getElementById('connection').textContent.startsWith('Connected')", "connected", 10)
            press(browser, "#setpoint_form button")
            browser.until("return document.getElementById('outcome').textContent.includes('done')", "the set-point is set", 5)
            time.sleep(1.2)  # all registers are read each second
            chip.unplug()
            browser.until("return document.getElementById('connection').textContent === 'Lost.'", "lost", 3)
            told = browser.text("#lost")
            assert "port is gone" in told or "No such file" in told, told
            assert browser.run("return document.body.classList.contains('stale')")
            press(browser, "#run")
            browser.until("return document.getElementById('outcome').textContent.includes('nothing was sent')", "run is refused", 3)
            chip.start()
            browser.until("return document.getElementById('connection').textContent.startsWith('Connected')", "back", 3)
            assert browser.run("return document.getElementById('lost').hidden")
            notice = browser.until("return document.getElementById('notice_text').textContent", "the reset is told", 3)
            assert "The chip was reset" in notice and "SETPOINT 110.0 → 0.0 °C" in notice, notice
            assert not chip.runs() and chip.read("SETPOINT") == "0.0"
            live.process.send_signal(signal.SIGSTOP)
            browser.until("return document.body.classList.contains('stale')", "a server that hangs makes readings old", 6)
            live.process.send_signal(signal.SIGCONT)
            browser.until("return !document.body.classList.contains('stale')", "readings again", 6)
    operate(body)


def keyboard() -> None:
    """All that can be operated is reached by Tab and has a name; Escape stops, from a dialog too."""
    def body(chip: Chip, live: Live) -> None:
        with Browser() as browser:
            browser.open(f"http://{live.host}/")
            browser.until("return document.getElementById('temperature_now').textContent.includes('25.0')", "a temperature", 10)
            nameless = browser.run(
                "return Array.from(document.querySelectorAll('button, input, select, canvas'), e => [e.id || e.outerHTML.slice(0, 60),"
                " e.getAttribute('aria-label') || e.labels?.length || e.textContent.trim()]).filter(([, name]) => !name)")
            assert nameless == [], nameless
            reached = []
            browser.keys("body", TAB)
            for _ in range(14):
                reached.append(browser.run("return document.activeElement.id || document.activeElement.textContent.trim()"))
                browser.keys(":focus", TAB)
            assert reached[0] == "stop", reached
            missing = {"setpoint", "Set", "run", "clear", "tune", "temperature", "follow", "find"} - set(reached)
            assert not missing, missing
            browser.keys("#setpoint", ENTER)
            browser.until("return document.getElementById('outcome').textContent.includes('done')", "the set-point is set", 5)
            for place in ("#run", '[aria-label="Set KP"]'):
                browser.keys("#run", ENTER)
                until(chip.runs, "heating")
                if place != "#run":
                    browser.keys(place, ENTER)
                browser.keys(":focus", ESCAPE)
                until(lambda: not chip.runs(), f"Escape stops, from {place}", 2)
            outline = browser.run("document.getElementById('run').focus(); return getComputedStyle(document.activeElement).outlineStyle")
            assert outline == "solid", outline
            live_regions = browser.run("return ['lost', 'faults', 'notice', 'outcome', 'connection'].map(id => document.getElementById(id).getAttribute('role'))")
            assert live_regions == ["alert", "alert", "alert", "status", "status"], live_regions
    operate(body)


def two_clients() -> None:
    """Both see the same; one that comes back hears what it has missed."""
    def body(chip: Chip, live: Live) -> None:
        a, b = connected(live), connected(live)
        with Browser() as browser:
            browser.open(f"http://{live.host}/")
            browser.until("return document.getElementById('temperature_now').textContent.includes('25.0')", "a temperature", 10)
            assert live.post({"do": "set", "register": "SETPOINT", "value": 44})[0] == 200
            assert "44" in browser.until("return document.getElementById('log').textContent", "what another client asked", 5)
            browser.until("return document.getElementById('setpoint_now').textContent.startsWith('44.0')", "the new set-point", 5)
            look = "Object.defineProperty(document, 'hidden', {value: arguments[0], configurable: true}); document.dispatchEvent(new Event('visibilitychange'));"
            browser.run(look, True)
            browser.until("return document.body.classList.contains('stale')", "a tab that nobody looks at doesn't listen", 6)
            browser.run(look, False)
            browser.until("return !document.body.classList.contains('stale')", "and is up to date when it is looked at", 2)
        until(lambda: len(b.of("answer")) == 1 and len(b.of("reading")) >= 8, "readings")
        common = sorted(set(a.ids) & set(b.ids))
        by_id = [dict(zip(events.ids, events.got)) for events in (a, b)]
        assert len(common) > 5 and all(by_id[0][number] == by_id[1][number] for number in common)
        assert a.of("answer") == b.of("answer"), (a.of("answer"), b.of("answer"))
        seen = a.ids[-6]
        again = Events(live, headers={"Last-Event-ID": seen})
        until(lambda: len(again.ids) >= 5, "what was missed")
        assert again.ids[:5] == a.ids[-5:] or again.ids[0] == a.ids[a.ids.index(seen) + 1], (again.ids, a.ids[-8:])
        stranger = Events(live, headers={"Last-Event-ID": "another/99999999999999999999"})
        assert until(lambda: stranger.of("about"), "all from the beginning")
    operate(body)


def virtual() -> None:
    """The chip within the server: its time, and what stands around it."""
    with tempfile.TemporaryDirectory() as name:
        scenario = pathlib.Path(name) / "scenario.txt"
        scenario.write_text("1 set SETPOINT 60;1.2 run;1.3 fan 0.1")
        for arguments in [("--simulate", "default", "--port", "tc"), ("--simulate", "none"), ("--simulate", "default", "--speed", "-1"), ("--simulate", "default", "--speed", "nan"),
                          ("--port", "tc", "--speed", "2")]:
            said = command("live", *arguments, status=2)
            assert said.count("\n") == 1, said
        with Live("--simulate", str(scenario), "--speed", "20") as live, Browser() as browser:
            browser.open(f"http://{live.host}/")
            browser.until("return parseFloat(document.getElementById('temperature_now').textContent) > 30", "the scenario heats", 20)
            assert browser.run("return [document.getElementById('speed').value, document.getElementById('knob_fan').value]") == ["20", "0.1"]
            browser.choose("#speed", "0")
            browser.until("return document.getElementById('outcome').textContent.includes('hold the time: done')", "time stands", 5)
            before = browser.text("#temperature_now")
            status, said = live.post({"do": "set", "register": "SET\u0000POINT", "value": 1})
            assert status == 400 and "expected" in said, said
            status, said = live.post({"do": "stop"})
            assert status == 409 and "time stands" in said, said
            time.sleep(0.6)
            assert browser.text("#temperature_now") == before
            browser.choose("#speed", "10")
            status, said = live.post({"do": "set", "register": "SETPOINT", "value": 60.04})
            assert status == 200 and "SETPOINT is 60.0 degC" in said, said
            browser.choose("#knob_sensor", "open")
            fault = browser.until("return document.getElementById('faults').textContent", "the fault", 10)
            assert re.match(r"SensorFault: .*Next: ", fault), fault
            press(browser, "#run")
            browser.until("return document.getElementById('outcome').textContent.includes('run: refused')", "a refusal", 5)
            for event, status in [("sensor gone", 409), ("set T_MAX 9999", 409), ("try set SETPOINT 480", 409), ("set SETPOINT 55", 200), ("sensor sound", 200), ("frame 05", 409)]:
                assert live.post({"do": "event", "event": event})[0] == status, event
            assert live.post({"do": "speed", "ratio": 1e6})[0] == 400
            browser.choose("#knob_reset", "on")
            notice = browser.until("return document.getElementById('notice_text').textContent", "the reset is told", 5)
            assert "The chip was reset" in notice, notice
            assert [error for error in browser.errors() if " 409 " not in error] == []


def kept() -> None:
    """Runs in a folder, one laid over another; a full disk; files that are none."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name) / "runs"
        virtual_run = ("--simulate", "default", "--speed", "20", "--keep", str(folder))
        with Live(*virtual_run) as live:
            connected(live)
            live.post({"do": "set", "register": "SETPOINT", "value": 60})
            assert live.post({"do": "run"})[0] == 200
            begun = len(json.loads(live.ask("GET", "/samples")[1]))
            until(lambda: len(json.loads(live.ask("GET", "/samples")[1])) > begun + 10, "samples")
            live.process.kill()  # nothing of what was told is lost
            live.expected = -signal.SIGKILL
        first, = folder.iterdir()
        lines = first.read_text().splitlines(keepends=True)
        assert lines[0] == "time_s,temperature_degc,setpoint_degc,duty_percent\n" and len(lines) > 10, lines
        assert all(re.fullmatch(r"\d+\.\d{3}(,(-?\d+\.\d{3})?){3}\n", line) for line in lines[1:]), lines
        (folder / "run_2020-01-01_000000.csv").symlink_to("/etc/passwd")
        hostile = "time_s\n1,2,3,4\n1,2,3\n1,2,3,4,5\nnan,1,1,1\n,,,\n2,,,\n" + "9" * 5000 + "\n3,1e99,1,1\n4,5,6,7\n\x00\xff,,,\n8,8,8,8"
        (folder / "run_2020-01-02_000000.csv").write_text(hostile)
        (folder / "notes.txt").write_text("not a run")
        with Live(*virtual_run) as live, Browser() as browser:
            listed = [run["name"] for run in json.loads(live.ask("GET", "/runs")[1])]
            assert "run_2020-01-02_000000.csv" in listed and "run_2020-01-01_000000.csv" not in listed, listed
            status, rows = live.ask("GET", "/runs/run_2020-01-02_000000.csv")
            assert status == 200 and json.loads(rows) == [[1, 2, 3, 4], [2, None, None, None], [4, 5, 6, 7]], rows
            for path in ("/runs/run_2020-01-01_000000.csv", "/runs/../notes.txt", "/runs/notes.txt", "/runs/..%2f..%2fetc%2fpasswd", "/runs/run_2020-01-03_000000.csv", "/runs/"):
                assert live.ask("GET", path)[0] == 404, path
            browser.open(f"http://{live.host}/")
            shown = browser.until("return Array.from(document.querySelectorAll('#runs label'), label => label.textContent.trim())", "earlier runs", 10)
            until(lambda: browser.run("return document.querySelectorAll('#runs input').length") == 2, f"two runs, found {shown}")
            press(browser, "#runs tbody tr:first-child input")
            figures = browser.until("const cells = document.querySelector('#runs tbody tr').cells; return cells[2].textContent && Array.from(cells, cell => cell.textContent)", "its figures", 5)
            assert float(figures[2].split()[0]) > 25 and float(figures[4].split()[0]) > 10, figures
            curves = browser.run("return Chart.getChart(document.getElementById('temperature')).data.datasets.map(set => [set.label, set.data.length])")
            assert len(curves) == 4 and curves[3][1] > 8, curves
        with Live(*virtual_run, largest_file=200) as live:
            events = connected(live)
            problem = events.until("kept", lambda data: data["problem"], "a full disk is told", 5)["problem"]
            assert "File too large" in problem or "no room" in problem, problem
            count = len(events.of("reading"))
            until(lambda: len(events.of("reading")) > count + 2, "it goes on")
        newest = max(folder.glob("run_*.csv"))
        assert newest.read_bytes().endswith(b"\n") and newest.stat().st_size <= 200, newest.read_bytes()
        said = command("live", "--simulate", "default", "--keep", str(folder / "notes.txt"), status=2)
        assert "expected a folder" in said and said.count("\n") == 1, said


def token() -> None:
    with tempfile.TemporaryDirectory() as name, Chip(pathlib.Path(name)) as chip:
        file = pathlib.Path(name) / "token"
        port = ("--port", str(chip.link))
        for text, found in [("short\n", "5 characters"), ("", "0 characters"), ("0123456789 abcdef\n", "other characters"), ("0123456789abcdef\x00", "other characters")]:
            file.write_text(text)
            said = command("live", *port, "--token", str(file), status=2)
            assert found in said and said.count("\n") == 1, said
        said = command("live", *port, "--listen", "0.0.0.0:0", status=2)
        assert "--token" in said, said
        file.write_text(TOKEN + "\n")
        with Live(*port, "--token", str(file), listen="0.0.0.0:0") as live:
            for path in ("/", "/events", "/samples", "/nowhere"):
                assert live.ask("GET", path)[0] == 401, path
                assert live.ask("GET", path, headers={"Authorization": f"Bearer {TOKEN[:-1]}"})[0] == 401, path
                assert live.ask("GET", f"{path}?token={TOKEN}x")[0] == 401, path
            assert live.post({"do": "run"})[0] == 401
            assert live.post({"do": "stop"}, headers={"Authorization": f"Bearer {TOKEN}"})[0] in (200, 409)
            with Browser() as browser:
                browser.open(f"http://127.0.0.1:{live.port}/?token={TOKEN}")
                browser.until("return document.getElementById('temperature_now').textContent.includes('25.0')", "a temperature", 10)
                press(browser, "#setpoint_form button")
                browser.until("return document.getElementById('outcome').textContent.includes('done')", "the set-point is set", 5)
                assert browser.errors() == [], browser.errors()
        assert chip.read("SETPOINT") == "110.0"


def bad_use() -> None:
    with tempfile.TemporaryDirectory() as name, Chip(pathlib.Path(name)) as chip:
        port = ("--port", str(chip.link))
        with Live(*port) as live:
            connected(live)
            runs = chip.link.parent / "runs"
            said = command("live", *port, "--listen", live.host, "--keep", str(runs), status=2)
            assert not runs.exists(), "nothing is begun"
            assert "Address already in use" in said and said.count("\n") == 1, said
        for arguments in [("--port", str(chip.link.parent / "none")), (*port, "--listen", "8123"), (*port, "--listen", "127.0.0.1:65536"), (*port, "--listen", "example.org:80"),
                          (*port, "--listen", "::1:80"), (*port, "--token", "/none"), (*port, "--format", "9X1"), (*port, "--timeout", "nan"), ()]:
            said = command("live", *arguments, status=2)
            assert said.count("\n") == 1, said
        with Live(*port, listen="[::1]:0" if socket.has_ipv6 and os.path.exists("/proc/net/if_inet6") else "127.0.0.1:0"):
            pass
        with Live(*port) as live:  # ends while pages are open
            listeners = [connected(live) for _ in range(3)]
            begin = time.monotonic()
            live.process.send_signal(signal.SIGINT)
            assert live.process.wait(10) == 0
            assert time.monotonic() - begin < 3, "ends at once"
            assert all(listener.of("reading") for listener in listeners)


# Contrast of each text with what is behind it (WCAG 2.2, 1.4.3): those that are too low.
LOW_CONTRAST = """
const numbers = color => color.match(/[0-9.]+/g).map(Number);
const light = color => numbers(color).slice(0, 3).map(c => (c /= 255) <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4).reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
const behind = e => { for (; e; e = e.parentElement) { const c = getComputedStyle(e).backgroundColor; if (numbers(c)[3] !== 0) return c; } return 'rgb(255, 255, 255)'; };
const low = [];
for (const e of document.querySelectorAll('body *')) {
  if (!e.checkVisibility() || !(e.matches('input') || Array.from(e.childNodes).some(n => n.nodeType === 3 && n.data.trim()))) continue;
  const s = getComputedStyle(e), a = light(s.color), b = light(behind(e));
  const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  const large = parseFloat(s.fontSize) >= 24 || (parseFloat(s.fontSize) >= 18.66 && s.fontWeight >= 700);
  if (ratio < (large ? 3 : 4.5)) low.push(`${e.tagName} ${e.id} "${e.textContent.slice(0, 20)}": ${ratio.toFixed(2)}`);
}
return low;
"""


def looks() -> None:
    """Nothing sticks out to the side and each text has the contrast of AA, also when the line is lost; pictures for a person."""
    pictures = pathlib.Path(sys.argv[3]) if len(sys.argv) > 3 else None

    def body(chip: Chip, live: Live) -> None:
        connected(live)
        live.post({"do": "set", "register": "SETPOINT", "value": 90})
        live.post({"do": "run"})
        assert live.post({"do": "set", "register": "T_MIN", "value": 60})[0] == 200  # a fault: it is colder
        with Browser() as browser:
            for name, width, dark in [("wide", 1280, False), ("dark", 1280, True), ("narrow", 800, False), ("narrow_dark", 800, True), ("lost", 800, False), ("lost_dark", 1280, True)]:
                if name == "lost":
                    chip.unplug()
                browser.call("POST", "/goog/cdp/execute", {"cmd": "Emulation.setDeviceMetricsOverride", "params": {"width": width, "height": 1500, "deviceScaleFactor": 1, "mobile": False}})
                browser.call("POST", "/goog/cdp/execute", {"cmd": "Emulation.setEmulatedMedia", "params": {"features": [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]}})
                browser.open(f"http://{live.host}/")
                browser.until("return document.getElementById('temperature_now').textContent.includes('°C')", "a temperature", 10)
                fault = browser.until("return document.getElementById('faults').textContent", "the fault", 10)
                assert re.match(r"UnderTemp: .*Limit: T_MIN 60 °C.* Next: ", fault), fault
                if name.startswith("lost"):
                    browser.until("return document.getElementById('connection').textContent === 'Lost.'", "lost", 5)
                if name == "lost_dark":
                    browser.until("return document.getElementById('age').textContent === 'no answer since this page was opened'", "no age of a reading from before", 2)
                low = browser.run(LOW_CONTRAST)
                assert low == [], f"{name}: {low}"
                wide = browser.run("return [document.documentElement.scrollWidth, innerWidth]")
                assert wide[0] <= wide[1], f"{name}: {wide[0]} pixels in a window of {wide[1]}"
                back, front = browser.run("const s = getComputedStyle(document.body); return [s.backgroundColor, s.color]")
                assert (sum(map(int, re.findall(r"\d+", back)[:3])) < sum(map(int, re.findall(r"\d+", front)[:3]))) == dark, (back, front)
                if pictures:
                    browser.picture(pictures / f"{name}.png")
    operate(body)


if __name__ == "__main__":
    globals()[sys.argv[2]]()
