"""What instruments are connected to this computer, driver by driver."""

from __future__ import annotations

from typing import Any

from clbrdf.cli.console import print_table
from clbrdf.rig.drivers import driver_names, get_driver
from clbrdf.rig.errors import InstrumentError


def print_rig_devices() -> None:
    """Print every driver, what it finds, or why it cannot look; and the serial ports."""
    rows = []
    for name in driver_names():
        driver = get_driver("", name)
        roles = ", ".join(driver.ROLES)
        if not hasattr(driver, "find"):
            rows.append([name, roles, "–", "by hand" if name == "manual" else "on a serial port, see below"])
            continue
        try:
            found = driver.find()
        except InstrumentError as error:
            rows.append([name, roles, "–", str(error)])
            continue
        if not found:
            rows.append([name, roles, "–", "none connected"])
        rows += [[name, roles, one.address, one.what] for one in found]
    print_table("Drivers of the rig, and what is connected", ("driver", "plays", "address", ""), rows, left=4)
    ports = [[port.device, port.description or "–"] for port in _serial_ports()]
    if ports:
        print_table("Serial ports", ("port", "what the system says"), ports, left=2)
    else:
        print("no serial ports")


def _serial_ports() -> list[Any]:
    from serial.tools import list_ports

    return sorted(list_ports.comports(), key=lambda port: str(port.device))
