"""The cut through lobes in the plane of incidence, as a flat chart that follows the sliders."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions
from clbrdf.viz.curves import signed_view_zenith
from clbrdf.viz.lettering import font_file
from clbrdf.viz.panel import Entry
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
                shape.SetFontFamily(4)
                shape.SetFontFile(font_file())
                shape.SetFontSize(size)
                shape.BoldOff()
        renderer.add_chart(self.chart)
        self.series: list[tuple[Array, Array]] = []

    def show(self, entries: list[Entry], widths: list[float], log: bool) -> None:
        """Draw entries with the half widths of their lobes (rad), on a logarithmic or linear axis."""
        self.chart.clear()
        self.series = []
        for k, (entry, width) in enumerate(zip(entries, widths, strict=True)):
            alone = len(entries) == 1
            self._show_one(entry, width, SERIES[k % len(SERIES)], BLACK if alone else SERIES[k % len(SERIES)])
        values = np.concatenate([y[np.isfinite(y)] for _, y in self.series] or [np.ones(1)])
        positive = values[values > 0.0]
        top = float(positive.max()) if len(positive) else 1.0
        self.chart.y_axis.log_scale = log
        low = max(float(positive.min()) if len(positive) else top, 1e-4 * top)
        self.chart.y_range = [0.7 * low, 1.6 * top] if log else [0.0, 1.08 * top]
        self.chart.x_range = [-self.limit, self.limit]

    def _show_one(self, entry: Entry, width: float, line: str, mark: str) -> None:
        subject, column = entry.subject, entry.column
        parameters = subject.parameters(column)
        if subject.fit is not None and parameters is not None:
            x = cut_angles(entry.theta_i, self.limit, width)
            y = plane_values(subject, column, entry.theta_i, x)
            self.series.append((x, y))
            self.chart.line(x, y, color=line, width=2.0)
        scan = subject.scan
        zenith = signed_view_zenith(scan)
        rows = subject.rows(entry.theta_i)
        rows = rows[np.isfinite(zenith[rows]) & ~scan.mask[rows, column]]
        if len(rows) == 0:
            return
        x, y = zenith[rows], scan.brdf[rows, column]
        self.series.append((x, y))
        self.chart.scatter(x, y, color=mark, size=5.0, style="o")
        if scan.sigma is not None:
            sigma = np.nan_to_num(scan.sigma[rows, column])
            for place, value, error in zip(x, y, sigma, strict=True):
                ends = [max(value - error, 1e-3 * value), value + error]
                self.chart.line([place, place], ends, color=mark, width=1.0)


def plane_values(subject: Any, column: int, theta_i: float, signed_zenith: Array) -> Array:
    """Fitted BRDF, 1/sr, at signed view zeniths (K,) in the plane of incidence; all in degrees."""
    fit = subject.fit
    directions = Directions(
        np.array([theta_i]), np.abs(signed_zenith), np.where(signed_zenith < 0.0, 0.0, 180.0)
    )
    return np.asarray(fit.model.brdf(fit.vector[column][None, :], fit.model.features(directions))).reshape(-1)
