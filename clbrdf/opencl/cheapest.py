"""From a tolerance to the cheapest arithmetic that keeps it, as measured on this device."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from clbrdf.errors import InputError
from clbrdf.geometry import Directions
from clbrdf.models import DEFAULT_MODEL, Model, Page, get_model
from clbrdf.opencl.answers import keep_answer, read_answer
from clbrdf.opencl.device import Device, usable_device
from clbrdf.opencl.precision import PRECISIONS, Precision
from clbrdf.opencl.values import evaluate_directions

TOPIC = "costs"
MEASURED_DIRECTIONS = 1 << 16
REPEATS = 3


@dataclass(frozen=True)
class ChosenPrecision:
    """A precision chosen for a tolerance.

    Attributes
    ----------
    precision : Precision
        The cheapest whose bound is within the tolerance.
    nanoseconds : float
        What one value costs with it, geometry included; NaN where costs have not been measured.
    better : Precision or None
        The cheapest that is more exact.
    better_nanoseconds : float
        What one value costs with that.
    """

    precision: Precision
    nanoseconds: float
    better: Precision | None
    better_nanoseconds: float

    def __str__(self) -> str:
        text = f"precision {self.precision.name} (within {self.precision.bound:g})"
        if np.isfinite(self.nanoseconds):
            text += f", {self.nanoseconds:.3g} ns a value"
        if self.better is not None:
            text += f"; the next better is {self.better.name} (within {self.better.bound:g})"
            if np.isfinite(self.better_nanoseconds):
                text += f", {self.better_nanoseconds:.3g} ns a value"
        return text


def choose_precision(
    rtol: float,
    *,
    device: Device | str | None = None,
    model: str | Model | Page = DEFAULT_MODEL,
    measure: bool = True,
) -> ChosenPrecision:
    """Return the cheapest precision that keeps a relative tolerance of model values.

    Parameters
    ----------
    rtol : float
        Largest relative error wherever f > 1e-30, at least the bound of double precision.
    device : Device or str, optional
    model : str, Model or Page
    measure : bool
        Measure the costs (a few seconds, once a device and model) where they are not known; else take the
        less exact for the cheaper.

    Raises
    ------
    InputError
        A tolerance that no precision keeps.
    DeviceError
        No usable OpenCL device.
    """
    if not rtol > 0.0:
        raise InputError(f"rtol is {rtol:g}; give a positive number, such as 1e-3")
    chosen = usable_device(device)
    able = [p for p in PRECISIONS.values() if p.dtype is np.float32 or chosen.has_double]
    kept = [p for p in able if p.bound <= rtol]
    if not kept:
        best = min(p.bound for p in able)
        raise InputError(f"rtol is {rtol:g}, and {best:g} is the best here; ask for precision 'reference'")
    judged = get_model(model)
    costs = known_costs(chosen, judged) or (measure_costs(chosen, judged, able) if measure else {})

    def cost(p: Precision) -> tuple[float, float]:
        return costs.get(p.name, np.inf if costs else 0.0), -p.bound

    precision = min(kept, key=cost)
    better = [p for p in able if p.bound < precision.bound]
    following = min(better, key=cost) if better else None
    unknown = float("nan")
    return ChosenPrecision(
        precision,
        costs.get(precision.name, unknown),
        following,
        costs.get(following.name, unknown) if following else unknown,
    )


def known_costs(device: Device, model: Model) -> dict[str, float]:
    """Return nanoseconds a value by precision, {} where a device has not been measured with a model."""
    try:
        kept = read_answer(device, TOPIC, model.kernel())
        return {name: float(value) for name, value in kept.items()}
    except (TypeError, ValueError):
        return {}


def measure_costs(device: Device, model: Model, precisions: list[Precision]) -> dict[str, float]:
    """Measure nanoseconds a value, geometry included, interleaved; keep and return them by precision."""
    rng = np.random.default_rng(1)
    n = MEASURED_DIRECTIONS
    directions = Directions.relative(
        rng.uniform(0.0, 85.0, n), rng.uniform(0.0, 85.0, n), rng.uniform(0.0, 360.0, n)
    )
    parameters = model.defaults[None, :]
    times: dict[str, list[float]] = {p.name: [] for p in precisions}
    for round_ in range(REPEATS + 1):
        for p in precisions:
            start = time.perf_counter()
            evaluate_directions(model, parameters, directions, p, device)
            if round_:  # the first one compiles
                times[p.name].append(time.perf_counter() - start)
    costs = {name: 1e9 * float(np.median(values)) / n for name, values in times.items()}
    keep_answer(device, TOPIC, costs, model.kernel())
    return costs
