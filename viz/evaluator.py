"""Model values on a lobe mesh; of models that form their features on the device, all stays there."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt

from clbrdf.geometry import Directions
from clbrdf.models import Model
from clbrdf.opencl.device import Device, open_queue, usable_device
from clbrdf.opencl.precision import Precision, get_precision
from clbrdf.opencl.program import Variant, build, upload
from clbrdf.opencl.values import Launcher, features_in_parts
from clbrdf.viz.directions import angles_of
from clbrdf.viz.mesh import LobeMesh

Array = npt.NDArray[np.float64]
Single = npt.NDArray[np.float32]


class MeshEvaluator(Protocol):
    """Evaluates one model on the points of one mesh for an incident zenith that moves."""

    theta_i: float
    views: Single

    def move(self, theta_i: float) -> None:
        """Set the incident zenith, degrees."""

    def values(self, parameters: Array) -> Single:
        """BRDF of one parameter set (P,) on what the mesh evaluates, 1/sr."""


def mesh_evaluator(
    model: Model,
    mesh: LobeMesh,
    device: Device | None = None,
    precision: Precision | None = None,
    phi_i: float = 0.0,
) -> MeshEvaluator:
    """Return the evaluator that suits a model.

    Parameters
    ----------
    model : Model
    mesh : LobeMesh
    device : Device, optional
        The preferred one if not given.
    precision : Precision, optional
        Double where the device has it, at little cost here, else "fast:5".
    phi_i : float
        Incident azimuth, degrees, for models that tell azimuths apart; the mesh shows φ = φr − φi.
    """
    where = usable_device(device)
    chosen = precision or get_precision("double" if where.has_double else "fast:5")
    if "geometry_of_direction" in model.kernel():
        return DeviceMesh(model, mesh, where, chosen)
    return HostMesh(model, mesh, where, chosen, phi_i)


class HostMesh:
    """Evaluates any model: a new incident zenith forms its features on the host, in fp64."""

    def __init__(
        self, model: Model, mesh: LobeMesh, device: Device, precision: Precision, phi_i: float = 0.0
    ) -> None:
        self.model, self.mesh, self.device, self.precision = model, mesh, device, precision
        self.phi_i = phi_i
        self.theta_i = float("nan")
        self.views: Single = np.empty((4, *mesh.shape), dtype=np.float32)
        self._features: Array = np.empty((0, 0))

    def move(self, theta_i: float) -> None:
        """Set the incident zenith, degrees.

        Raises
        ------
        InputError
            It lies beyond the mesh.
        """
        if theta_i == self.theta_i:
            return
        self.views = self.mesh.views(theta_i)
        vectors = self.views[:3].reshape(3, -1).T.astype(np.float64)
        zenith, azimuth = angles_of(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
        directions = Directions(
            np.full(len(zenith), theta_i), np.full(1, self.phi_i), zenith, azimuth + self.phi_i
        )
        self._features = features_in_parts(self.model, directions, self.precision)
        self.theta_i = theta_i

    def values(self, parameters: Array) -> Single:
        """BRDF of one parameter set (P,) on what the mesh evaluates, 1/sr."""
        launcher = Launcher(self.model, parameters[None], self.precision, self.device)
        out = np.empty((len(self._features), 1))
        launcher.finish(launcher.begin(self._features), out)
        with np.errstate(over="ignore"):  # too large to draw becomes infinite, and the picture says so
            return out.reshape(self.mesh.shape).astype(np.float32)


class DeviceMesh:
    """Evaluates a model that forms its features on the device.

    A new wavelength costs one launch; a new incident zenith also makes and uploads the view vectors.
    Directions are in single precision.
    """

    def __init__(self, model: Model, mesh: LobeMesh, device: Device, precision: Precision) -> None:
        import pyopencl as cl

        self.mesh = mesh
        self.device = device
        variant = Variant.on(self.device, "mesh", model, precision, ("direction",))
        self._dtype = precision.dtype
        self._kernel = cl.Kernel(build(self.device, variant), "mesh")
        count = int(np.prod(mesh.shape))
        self._groups = -(-count // variant.lanes.width)
        self._padded = self._groups * variant.lanes.width
        self._rows = np.full((4, self._padded), 0.5, dtype=self._dtype)
        self._values = np.empty(self._padded, dtype=self._dtype)
        context = open_queue(self.device).context
        self._views_buffer = cl.Buffer(context, cl.mem_flags.READ_ONLY, self._rows.nbytes)
        self._out_buffer = cl.Buffer(context, cl.mem_flags.WRITE_ONLY, self._values.nbytes)
        self.theta_i = float("nan")
        self.views: Single = np.empty((4, *mesh.shape), dtype=np.float32)

    def move(self, theta_i: float) -> None:
        """Set the incident zenith, degrees.

        Raises
        ------
        InputError
            It lies beyond the mesh.
        """
        import pyopencl as cl

        if theta_i == self.theta_i:
            return
        self.views = self.mesh.views(theta_i)
        self._rows[:, : self.views[0].size] = self.views.reshape(4, -1)
        cl.enqueue_copy(open_queue(self.device), self._views_buffer, self._rows)
        self.theta_i = theta_i

    def values(self, parameters: Array) -> Single:
        """BRDF of one parameter set (P,) on what the mesh evaluates, 1/sr."""
        import pyopencl as cl

        queue = open_queue(self.device)
        angle = np.deg2rad(self.theta_i)
        self._kernel(
            queue,
            (self._groups,),
            None,
            self._views_buffer,
            np.uint64(self._padded),
            self._dtype(np.cos(angle)),
            self._dtype(np.sin(angle)),
            upload(self.device, parameters, self._dtype),
            self._out_buffer,
        )
        cl.enqueue_copy(queue, self._values, self._out_buffer)
        shape = self.mesh.shape
        with np.errstate(over="ignore"):  # too large to draw becomes infinite, and the picture says so
            return self._values[: shape[0] * shape[1]].reshape(shape).astype(np.float32)
