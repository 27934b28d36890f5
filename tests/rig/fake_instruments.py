"""Instruments for drivers that stand on other people's libraries: real code over connections in memory.

- ESP300: Newport, ESP300 User's Manual, section 3.  SR830: Stanford Research, SR830 manual, chapter 5.
- PM100USB: Thorlabs, PM100D manual, SCPI.  KDC101: Thorlabs, APT Communications Protocol.
"""

from __future__ import annotations

import struct
import time

import numpy as np


def visa_adapter(instrument):
    """An adapter of pymeasure that hands lines to `instrument.obey`."""
    from pymeasure.adapters import Adapter

    class InMemory(Adapter):
        def __init__(self):
            super().__init__()
            self.replies = []

        def _write(self, command, **_):
            if instrument.is_lost:
                raise OSError("No such device (it may have been disconnected)")
            for part in command.strip().split(";"):
                reply = instrument.obey(part.strip())
                if reply is not None:
                    self.replies.append(reply)

        def _read(self, **_):
            if instrument.lose_next or not self.replies:
                instrument.lose_next = False
                self.replies.clear()
                raise TimeoutError("VI_ERROR_TMO (-1073807339): Timeout expired before operation completed.")
            return self.replies.pop(0)

        def flush_read_buffer(self):
            self.replies.clear()

    return InMemory()


class Visa:
    identity = ""

    def __init__(self):
        self.lose_next = self.is_lost = False
        self.heard, self.refused = [], []

    def obey(self, line):
        self.heard.append(line)
        return self.identity if line == "*IDN?" else self.act(line)


class Pm100(Visa):
    identity = "Thorlabs,PM100USB,P0012345,1.7.0"

    def __init__(self, power=lambda: 1e-3):
        super().__init__()
        self.power = power
        self.state = {"UNIT": "DBM", "RANG:AUTO": "0", "WAV": 1064.0, "MAGN": 10.0, "COUN": 3000}

    def act(self, line):
        line = line.upper().replace("SENSE:", "SENS:")
        if line == "SYST:SENSOR:IDN?":
            return "S120C,1234,01-JAN-2020,1,18,33"
        if line == "MEAS:POW?":
            watts = self.power() * 10 ** (self.state["MAGN"] / 10)
            return f"{10 * np.log10(watts / 1e-3) if self.state['UNIT'] == 'DBM' else watts:.9E}"
        if line.startswith("SENS:CORR:WAV?"):
            return {"MIN": "400", "MAX": "1100"}.get(line[15:], f"{self.state['WAV']:E}")
        if line.startswith("SENS:CORR:WAV "):
            self.state["WAV"] = float(line[14:])
        elif line == "SENS:POW:UNIT W":
            self.state["UNIT"] = "W"
        elif line == "SENS:POW:RANG:AUTO ON":
            self.state["RANG:AUTO"] = "1"
        elif line.startswith("SENS:CORR:LOSS:INP:MAGN "):
            self.state["MAGN"] = float(line[24:])
        elif line.startswith("SENS:AVER:COUN "):
            self.state["COUN"] = int(line[15:])
        else:
            self.refused.append(line)
        return None


class Sr830(Visa):
    identity = "Stanford_Research_Systems,SR830,s/n12345,ver1.07"

    def __init__(self, volts=lambda: 1e-3, full=1.0):
        super().__init__()
        self.volts, self.full = volts, full
        self.latched = 0

    def act(self, line):
        line = line.replace(" ", "")
        if line == "OFLT?":
            return "0"  # 10 µs
        if line in ("OUTP?1", "OUTP?3"):
            value = self.volts()
            if value > self.full:
                self.latched |= 4
                value = self.full
            return f"{value:.9e}"
        if line == "LIAS?":
            bits, self.latched = self.latched, 0
            return str(bits)
        self.refused.append(line)
        return None


class Esp(Visa):
    identity = "ESP300 Version 3.04 09/09/01"

    def __init__(self, home_time=0.02):
        super().__init__()
        self.home_time = home_time
        self.axes = {
            k: {
                "on": 0,
                "at": 12.0,
                "until": 0.0,
                "SN": 2,
                "SL": -5.0,
                "SR": 5.0,
                "VA": 1.0,
                "AC": 1.0,
                "AG": 1.0,
            }
            for k in (1, 2, 3)
        }
        self.errors = []

    def act(self, line):
        if line == "TE?":
            return str(self.errors.pop(0) if self.errors else 0)
        if line == "ST":
            return None
        number, code, value = int(line[0]), line[1:3], line[3:]
        axis = self.axes[number]
        now = time.monotonic()
        if code == "TP":
            return f"{axis['at']:.4f}"
        if code == "MO":
            if value == "?":
                return str(axis["on"])
            axis["on"] = 1
        elif code == "MD":
            return "1" if now > axis["until"] else "0"
        elif code == "OR":
            axis["at"], axis["until"] = 0.0, now + self.home_time
        elif code == "PA":
            if not axis["SL"] <= float(value) <= axis["SR"]:
                self.errors.append(100 * number + (6 if float(value) > 0 else 7))
            else:
                axis["at"], axis["until"] = float(value), now + 0.005
        elif code in axis:
            if value == "?":
                return f"{axis[code]:g}"
            axis[code] = float(value)
        else:
            self.refused.append(line)
        return None


class Kdc101:
    """A K-Cube with a PRM1-Z8 (1919.64 counts a degree) speaking the APT protocol."""

    def __init__(self, serial=27000001, home_time=0.02):
        self.serial, self.home_time = serial, home_time
        self.out = b""
        self.at, self.until, self.state = 5000, 0.0, "unhomed"
        self.velocity = (0, 1000, 100000)
        self.bits = 0
        self.is_lost = self.lose_next = False
        self.unknown = []

    def write(self, data):
        if self.is_lost:
            raise OSError("device disconnected")
        while data:
            (kind,) = struct.unpack_from("<H", data)
            has_data = data[4] & 0x80
            length = 6 + (struct.unpack_from("<H", data, 2)[0] if has_data else 0)
            self.act(kind, data[6:length])
            data = data[length:]

    def read(self, size):
        if len(self.out) < size:
            raise TimeoutError("timeout during read")
        data, self.out = self.out[:size], self.out[size:]
        return data

    def reply(self, kind, data):
        if self.lose_next:
            self.lose_next = False
            return
        self.out += struct.pack("<HHBB", kind, len(data), 0x81, 0x50) + data

    def act(self, kind, data):
        now = time.monotonic()
        if self.state in ("homing", "moving") and now > self.until:
            self.state = "ready"
        if kind == 0x0005:
            info = struct.pack("<I8sH4s", self.serial, b"KDC101", 44, b"\x01\x00\x02\x00")
            self.reply(0x0006, info.ljust(76, b"\0") + struct.pack("<HHHH", 6, 1, 0, 1))
        elif kind == 0x0429:
            word = 0x80000000 | {"unhomed": 0, "homing": 0x200, "moving": 0x410, "ready": 0x400}[self.state]
            self.reply(0x042A, struct.pack("<HI", 1, word | self.bits))
        elif kind == 0x0411:
            self.reply(0x0412, struct.pack("<Hi", 1, self.at))
        elif kind == 0x0414:
            self.reply(0x0415, struct.pack("<Hiii", 1, *self.velocity))
        elif kind == 0x0413:
            self.velocity = struct.unpack("<Hiii", data)[1:]
        elif kind == 0x0443:
            self.at, self.state, self.until = 0, "homing", now + self.home_time
        elif kind == 0x0453:
            self.at, self.state, self.until = struct.unpack("<Hi", data)[1], "moving", now + 0.005
        elif kind == 0x0465:
            self.state = "ready" if self.state == "moving" else self.state
        elif kind not in (0x0012,):
            self.unknown.append(hex(kind))


def kinesis_motor(cubes):
    """`KinesisMotor` of pylablib, over connections in memory to the cubes by their serial numbers."""
    from pylablib.core.devio import comm_backend
    from pylablib.devices import Thorlabs

    class InMemory(comm_backend.IDeviceCommBackend):
        Error = comm_backend.DeviceBackendError
        _backend = "memory"

        def __init__(
            self, conn, timeout=None, term_write=None, term_read=None, datatype="auto", reraise_error=None
        ):
            super().__init__(conn, term_write=term_write, term_read=term_read, datatype=datatype)
            self.cube = cubes[conn]
            self.conn = {"port": conn}

        def open(self):
            pass

        def close(self):
            pass

        def is_opened(self):
            return True

        def set_timeout(self, timeout):
            pass

        def get_timeout(self):
            return 1.0

        def read(self, size=None):
            try:
                return self.cube.read(size)
            except TimeoutError as error:
                raise comm_backend.DeviceBackendError(error) from error

        def write(self, data, flush=True, read_echo=False):
            self.cube.write(data)

    class Motor(Thorlabs.KinesisMotor):
        _cycle_rts = staticmethod(lambda instr: None)  # there is no such line here

        def __init__(self, conn, **options):
            if conn not in cubes:
                raise RuntimeError("DEVICE_NOT_FOUND")
            super().__init__((InMemory, conn), **options)

    return Motor


def seabreeze_sts(answer):
    """A device of seabreeze's pure-Python backend, an STS, over a transport in memory to `answer(frame)`."""
    from seabreeze.pyseabreeze import devices, protocol, types

    class Transport(types.PySeaBreezeTransport):
        is_open = False
        default_timeout_ms = 1000
        is_lost = False
        protocol = None

        def __init__(self):
            self.protocol = protocol.OBPProtocol(self)
            self.replies = b""

        def open_device(self, device):
            self.is_open = True

        def close_device(self):
            self.is_open = False

        @classmethod
        def list_devices(cls):
            return []

        @classmethod
        def register_model(cls, model_name, **_):
            pass

        @classmethod
        def supported_model(cls, device):
            return "STS"

        @classmethod
        def specialize(cls, model_name, **_):
            return cls

        @classmethod
        def initialize(cls, **_):
            pass

        @classmethod
        def shutdown(cls, **_):
            pass

        def write(self, data, timeout_ms=None, **_):
            if self.is_lost:
                raise OSError(19, "No such device (it may have been disconnected)")
            self.replies = answer(bytes(data))
            return len(data)

        def read(self, size=None, timeout_ms=None, **_):
            size = len(self.replies) if size is None else size
            data, self.replies = self.replies[:size], self.replies[size:]
            return data

    device = object.__new__(devices.STS)
    device._raw_device, device._transport, device._cached_features = "memory", Transport(), None
    device._transport.is_open = True
    device._serial_number = device.get_serial_number()
    device._transport.is_open = False
    return device
