"""The cut through lobes in the plane of incidence, as a flat chart that follows the sliders."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.viz.curves import seen_along, signed_view_zenith
from clbrdf.viz.lettering import FONT_FROM_FILE, font_file
from clbrdf.viz.lobes import MARGIN
from clbrdf.viz.panel import LobeRequest
from clbrdf.viz.radius import fine_steps, nice_step, tick_text
from clbrdf.viz.style import BLACK, SERIES

Array = npt.NDArray[np.float64]

SAMPLES = 241


def cut_angles(theta_i: float, limit: float, width: float) -> Array:
    """Signed view zeniths (degrees), increasing, close together around the mirror direction θi."""
    t = np.linspace(-1.0, 1.0, SAMPLES)
    reach = np.where(t < 0.0, limit + theta_i, limit - theta_i)
    scale = np.rad2deg(width)
    return np.asarray(theta_i + scale * np.sinh(t * np.arcsinh(reach / scale)))


class Cut:
    """A chart of measured points, error bars and model curves in one renderer.

    Parameters
    ----------
    renderer : pyvista.Renderer
    limit : float
        View zenith where curves end, degrees.
    size : int
        Height of letters, pixels.
    """

    def __init__(self, renderer: Any, limit: float, size: int) -> None:
        import pyvista as pv

        self.limit = limit
        self.chart = pv.Chart2D(x_label="θr (°), forward > 0", y_label="BRDF (1/sr)")
        self.chart.SetInteractive(False)
        self.chart.x_range = [-limit, limit]
        self.chart.background_color = "white"
        for axis in (self.chart.x_axis, self.chart.y_axis):
            for shape in (axis.GetTitleProperties(), axis.GetLabelProperties()):
                shape.SetFontFamily(FONT_FROM_FILE)
                shape.SetFontFile(font_file())
                shape.BoldOff()
        self.resize(size)
        renderer.add_chart(self.chart)
        self.series: list[tuple[Array, Array]] = []
        self.log = False

    def resize(self, size: int) -> None:
        """Give letters another height, pixels."""
        for axis in (self.chart.x_axis, self.chart.y_axis):
            for shape in (axis.GetTitleProperties(), axis.GetLabelProperties()):
                shape.SetFontSize(size)

    def show(self, requests: list[LobeRequest], widths: list[float], log: bool) -> None:
        """Draw requests with the half widths of their lobes (rad), on a logarithmic or linear axis."""
        self.chart.clear()
        self.series = []
        self.log = log
        behind = any(e.subject.sees for e in requests)
        self.chart.y_label = "BRDF as seen (1/sr)" if behind else "BRDF (1/sr)"
        alone = len(requests) == 1
        drawn = []
        for k, (request, width) in enumerate(zip(requests, widths, strict=True)):
            colour = SERIES[k % len(SERIES)]
            drawn += self._parts(request, width, colour, BLACK if alone else colour)
        # What lies beyond the measured zeniths makes no scale.
        reach = max((e.subject.reach(e.theta_i) for e in requests), default=90.0) + MARGIN
        kept = [y[np.isfinite(y) & (y > 0.0) & (np.abs(x) <= reach)] for x, y in self.series]
        values = np.concatenate(kept or [np.ones(1)])
        top = float(values.max(initial=1e-12))
        low = max(float(values.min(initial=top)), 1e-4 * top)
        for kind, x, y, colour in drawn:
            height = np.log10(np.maximum(y, 1e-3 * low)) if log else y
            if kind == "points":
                self.chart.scatter(x, height, color=colour, size=5.0, style="o")
            elif len(x):
                line = self.chart.line(x, height, color=colour, width=2.0 if kind == "curve" else 1.0)
                line.SetPolyLine(kind == "curve")  # bars are pairs of ends
        self._scale_axis(low, top)
        self.chart.x_range = [-self.limit, self.limit]

    def _scale_axis(self, low: float, top: float) -> None:
        """Set range and ticks; a logarithmic axis carries log10 of the values and labels of their own."""
        axis = self.chart.y_axis
        if self.log:
            first, last = np.log10(0.7 * low), np.log10(1.6 * top)
            stride = max(1.0, np.ceil((last - first) / 6.0))
            shown = [float(10.0**k) for k in np.arange(np.ceil(first), last, stride)]
            if len(shown) < 3:
                shown = fine_steps(10.0**first, 10.0**last)
            axis.tick_locations, axis.tick_labels = (
                [np.log10(v) for v in shown],
                [tick_text(v) for v in shown],
            )
            self.chart.y_range = [first, last]
            return
        step = nice_step(top)
        values = np.arange(0.0, 1.0001 * top, step)
        axis.tick_locations, axis.tick_labels = list(values), [tick_text(v) for v in values]
        self.chart.y_range = [0.0, 1.08 * top]

    def _parts(
        self, request: LobeRequest, width: float, line: str, mark: str
    ) -> list[tuple[str, Array, Array, str]]:
        """Curve, points and error bars of a request: kind, θr, values and colour."""
        subject, column = request.subject, request.column
        out = []
        if subject.fit is not None and subject.parameters(column) is not None:
            x = cut_angles(request.theta_i, self.limit, width)
            y = plane_values(subject, column, request.theta_i, x)
            x, y = x[np.isfinite(y)], y[np.isfinite(y)]
            self.series.append((x, y))
            out.append(("curve", x, y, line))
        scan = subject.scan
        zenith = signed_view_zenith(scan)
        rows = subject.rows(request.theta_i)
        rows = rows[np.isfinite(zenith[rows]) & ~scan.mask[rows, column]]
        if len(rows) == 0:
            return out
        x, y = zenith[rows], scan.brdf[rows, column]
        self.series.append((x, y))
        out.append(("points", x, y, mark))
        if scan.sigma is not None:
            sigma = np.nan_to_num(scan.sigma[rows, column])
            ends = np.stack([np.maximum(y - sigma, 1e-3 * y), y + sigma], axis=-1)[sigma > 0.0]
            out.append(("bars", np.repeat(x[sigma > 0.0], 2), ends.ravel(), mark))
        return out


def plane_values(subject: Any, column: int, theta_i: float, signed_zenith: Array) -> Array:
    """Fitted BRDF (K,), 1/sr, as the detector sees it in the plane of incidence, at signed view zeniths.

    All angles are in degrees.
    """
    side = np.where(signed_zenith < 0.0, 0.0, 180.0)
    return seen_along(subject.fit, subject.directions([theta_i], np.abs(signed_zenith), side), column)
