"""Instruments on pseudo-terminals written from their manuals' words, in real time; nothing of clbrdf is used.

- Newport 1830-C: Instruction Manual, command list and appendix A (status byte).
- Newport SMC100: User's Manual EDH0206En2042, chapter 6.
- Ocean STS: Data Sheet, "Ocean Binary Protocol"; message types of SeaBreeze's OBPMessageTypes.h.

Each keeps a list `refused` of what its manual does not allow.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import select
import struct
import threading
import time
import tty


class OnPty(threading.Thread):
    def __init__(self):
        super().__init__(daemon=True)
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        self.port = os.ttyname(self.slave)
        self.refused = []
        self.heard = []
        self.lose = lambda request: False  # which replies are lost on the line
        self.buffer = b""
        self.alive = True

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.alive = False
        self.join(timeout=5.0)
        os.close(self.master)
        os.close(self.slave)

    def run(self):
        while self.alive:
            if select.select([self.master], [], [], 0.02)[0]:
                self.buffer += os.read(self.master, 4096)
                for request in self.requests():
                    self.heard.append(request)
                    reply = self.obey(request)
                    if reply and not self.lose(request):
                        with contextlib.suppress(OSError):
                            os.write(self.master, reply)

    def lines(self, end):
        while end in self.buffer:
            line, _, self.buffer = self.buffer.partition(end)
            yield line.decode("ascii")


class Meter1830C(OnPty):
    """A power meter with a new reading every 20 ms; `power(seconds)` is the light on it, W."""

    period = 0.02

    def __init__(self, power=lambda seconds: 1e-3, **left):
        super().__init__()
        self.power = power
        self.began = time.monotonic()
        self.set = {"A": 0, "B": 1, "E": 1, "F": 2, "G": 1, "K": 1, "L": 0, "R": 0, "U": 2, "W": 633, "Z": 0}
        self.set |= left
        self.offset = 3e-4 if self.set["Z"] else 0.0
        self.error_bits = 0
        self.history = [self.power(0.0)]
        self.read_done = False
        self.busy_until = time.monotonic() + 0.1

    def requests(self):
        return self.lines(b"\n")

    def now(self):
        return int((time.monotonic() - self.began) / self.period)

    def convert(self):
        """Take the readings that are due: none in hold, none while busy."""
        due = self.now() + 1 - len(self.history)
        for _ in range(max(due, 0)):
            if self.set["G"] and time.monotonic() > self.busy_until:
                self.history.append(self.power(len(self.history) * self.period))
                self.read_done = True
            else:
                self.history.append(self.history[-1])

    def obey(self, line):
        echo = (line + "\n").encode() if self.set["E"] else b""
        self.convert()
        reply = self.act(line)
        return echo + ((reply + "\n").encode() if reply is not None else b"")

    def act(self, line):
        if line == "C":  # clears every bit but "message available"
            self.error_bits, self.read_done = 0, False
            return None
        if line == "Q?":
            busy = 32 if time.monotonic() < self.busy_until else 0
            return str(self.error_bits | busy | (128 if self.read_done else 0))
        if line == "D?":
            self.read_done = False
            count = {1: 16, 2: 4, 3: 1}[self.set["F"]]
            watts = sum(self.history[-count:]) / len(self.history[-count:]) - self.offset
            if self.set["R"]:
                watts = min(watts, 10.0 ** (self.set["R"] - 9))
            return f"{watts:.4E}" if self.set["U"] == 1 else "-3.00E+1"
        code, value = line[:1], line[1:]
        if code not in self.set or (code == "E" and value == "?"):
            self.refused.append(line)
            self.error_bits |= 2
        elif value == "?":
            return f"{self.set[code]:04d}" if code == "W" else str(self.set[code])
        elif not value.isdigit() or not self.allows(code, value):
            self.refused.append(line)
            self.error_bits |= 1
        else:
            self.set[code] = int(value)
            if code == "Z":
                self.offset = self.history[-1] if int(value) else 0.0
            if code == "R":
                self.busy_until = time.monotonic() + 0.1
        return None

    @staticmethod
    def allows(code, value):
        if code == "W":
            return len(value) == 4 and 190 <= int(value) <= 1800
        return int(value) in {"F": (1, 2, 3), "R": range(9), "U": (1, 2, 3, 4), "K": (0, 1, 2)}.get(
            code, (0, 1)
        )


class Smc100(OnPty):
    """Three controllers; moves are instantaneous unless `speed` is given, `count` is the encoder's step."""

    count = 0.0005

    def __init__(self, hunting=0, offset=0.0):
        super().__init__()
        self.axes = {
            k: {"state": 0x0A, "at": 3.0, "bits": 0, "error": "@", "until": 0.0, "then": 0x33}
            for k in (1, 2, 3)
        }
        self.values = {k: {"VA": 20.0, "AC": 80.0, "SL": -200.0, "SR": 200.0} for k in (1, 2, 3)}
        self.hunting, self.offset, self.reads = hunting, offset, 0
        self.stall = False
        self.homing = []

    def requests(self):
        return self.lines(b"\r\n")

    def obey(self, line):
        if line == "ST":
            return b""
        address, code, value = int(line[0]), line[1:3], line[3:]
        axis = self.axes[address]
        if axis["state"] in (0x1E, 0x28) and time.monotonic() > axis["until"]:
            axis["state"] = axis["then"]
        reply = self.act(address, axis, code, value)
        return f"{address}{code}{reply}\r\n".encode() if reply is not None else b""

    def act(self, address, axis, code, value):
        state = axis["state"]
        ready = 0x32 <= state <= 0x35
        if code == "TS" and value in ("", "?"):
            bits, axis["bits"] = axis["bits"], 0  # the bits that are reported are cleared
            return f"{bits:04X}{axis['state']:02X}"
        if code == "TE" and value in ("", "?"):
            letter, axis["error"] = axis["error"], "@"
            return letter
        if code == "TP" and value in ("", "?"):
            self.reads += 1
            hunt = (self.reads * 7 % 5 - 2) / 2.0 * self.hunting * self.count
            return f"{axis['at'] + hunt:.5f}" if state != 0x0A else "0"
        if code == "VE":
            return " SMC_CC - Controller-driver version 2. 0. 1"
        if code == "PT":
            if float(value) > 1e-6:
                return f"{float(value) / self.values[address]['VA']:.4f}"
            return self.refuse(axis, "C", code + value)
        if code in self.values[address]:
            if value == "?":
                return f"{self.values[address][code]:g}"
            if not ready:
                return self.refuse(axis, "H", code + value)
            self.values[address][code] = float(value)
        elif code == "RS" and not value:
            axis["state"] = 0x0A
        elif code == "OR" and not value:
            if state != 0x0A:
                return self.refuse(axis, "K", code)
            self.homing.append((address, [k for k, a in self.axes.items() if a["state"] == 0x1E]))
            axis |= {"state": 0x1E, "until": time.monotonic() + 0.05, "then": 0x32, "at": 0.0}
        elif code == "PA":
            if not ready:
                return self.refuse(axis, "H", code + value)
            if not self.values[address]["SL"] <= float(value) <= self.values[address]["SR"]:
                return self.refuse(axis, "N", code + value)
            axis |= {
                "state": 0x28,
                "until": time.monotonic() + 0.02,
                "then": 0x33,
                "at": float(value) + self.offset,
            }
            if self.stall:  # slips: the bit is latched, the position counter has seen nothing
                self.stall, axis["bits"] = False, 0x20
        else:
            return self.refuse(axis, "A", code + value)
        return None

    def refuse(self, axis, letter, what):
        axis["error"] = letter
        self.refused.append(what)


class Sts(OnPty):
    """A spectrometer; its shutter opens evenly in `shutter` seconds, light is `rate` counts a second."""

    def __init__(self, rate=20_000.0, shutter=0.0, trigger=0, averages=1, boxcar=0):
        super().__init__()
        self.rate, self.shutter_time = rate, shutter
        self.trigger, self.averages, self.boxcar = trigger, averages, boxcar
        self.seconds, self.previous = 0.01, None
        self.open, self.moved = False, -1e9
        self.spectra = []

    def requests(self):
        while (start := self.buffer.find(b"\xc1\xc0")) >= 0 and len(self.buffer) >= start + 44:
            (remaining,) = struct.unpack_from("<I", self.buffer, start + 40)
            if len(self.buffer) < start + 44 + remaining:
                return
            yield self.buffer[start : start + 44 + remaining]
            self.buffer = self.buffer[start + 44 + remaining :]

    def obey(self, frame):
        assert frame[-20:-4] == hashlib.md5(frame[:-20]).digest()
        flags, kind, regarding = *struct.unpack_from("<H", frame, 4), *struct.unpack_from("<II", frame, 8)
        data = frame[24 : 24 + frame[23]]
        answer = self.act(kind, data)
        if answer is None:
            return b""
        if isinstance(answer, int):
            self.refused.append(f"{kind:08x}")
            return self.frame(kind, regarding, b"", 9, answer)
        if answer == b"" and not flags & 4:
            return b""
        return self.frame(kind, regarding, answer, 3 if answer == b"" else 1, 0)

    @staticmethod
    def frame(kind, regarding, data, flags, error):
        short = len(data) <= 16
        body = struct.pack("<2sHHHII", b"\xc1\xc0", 0x1100, flags, error, kind, regarding) + bytes(6)
        body += bytes([1, len(data) if short else 0]) + (data if short else b"").ljust(16, b"\0")
        body += struct.pack("<I", 20 + (0 if short else len(data))) + (b"" if short else data)
        return body + hashlib.md5(body).digest() + b"\xc5\xc4\xc3\xc2"

    def act(self, kind, data):
        if kind == 0x100:
            return b"S99"
        if kind == 0x110010:
            self.previous, self.seconds = self.seconds, struct.unpack("<I", data)[0] / 1e6
        elif kind == 0x110110:
            self.trigger = data[0]
        elif kind == 0x110100:
            return bytes([self.trigger])
        elif kind == 0x120010:
            (self.averages,) = struct.unpack("<H", data)
        elif kind == 0x120000:
            return struct.pack("<H", self.averages)
        elif kind == 0x121010:
            self.boxcar = data[0]
        elif kind == 0x121000:
            return bytes([self.boxcar])
        elif kind == 0x110410:
            if bool(data[0]) != self.open:
                self.open, self.moved = bool(data[0]), time.monotonic()
        elif kind == 0x400001:
            return struct.pack("<f", 25.0)
        elif kind == 0x101100:
            return None if self.trigger else self.spectrum()
        else:
            return 2
        return b""

    def share(self):
        if not self.shutter_time:
            return float(self.open)
        gone = min(1.0, (time.monotonic() - self.moved) / self.shutter_time)
        return gone if self.open else 1.0 - gone

    def spectrum(self):
        seconds, self.previous = self.previous or self.seconds, None
        parts = []
        for _ in range(self.averages * 10):
            parts.append(self.share())
            time.sleep(seconds / 10)
        light = self.rate * seconds * sum(parts) / len(parts)
        line = [1500 + light * (3.0 if k == 512 else 1.0) for k in range(1024)]
        if self.boxcar:
            w = self.boxcar
            line = [
                sum(line[max(0, k - w) : k + w + 1]) / len(line[max(0, k - w) : k + w + 1])
                for k in range(1024)
            ]
        self.spectra.append(line[0])
        return struct.pack("<1024H", *[min(16383, round(v)) for v in line])
