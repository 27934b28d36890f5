"""What is to be done with every scan of a batch."""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from clbrdf.choose import Choice, choose
from clbrdf.errors import InputError
from clbrdf.fit import Fit, fit
from clbrdf.fit.methods import get_method
from clbrdf.fit.montecarlo import check_draws
from clbrdf.fit.requests import check_together
from clbrdf.fit.through import POINT, SCAN, check_bandwidth
from clbrdf.models import get_model
from clbrdf.objective import WEIGHTS
from clbrdf.parallel.executor import Executor
from clbrdf.scan import Scan
from clbrdf.storage.provenance import Input, choose_options, fit_options, made_by
from clbrdf.version import __version__


@dataclass(frozen=True)
class InstrumentFile:
    """An instrument file as it travels: its name without a folder, and its bytes."""

    name: str
    content: bytes

    @classmethod
    def read(cls, path: Path, smooth: bool) -> InstrumentFile:
        """Read the instrument file of fits that are smooth or not.

        Raises
        ------
        InputError
            As `clbrdf.instrument.settings.load_instrument`; a bandwidth for fits that are not smooth.
        """
        from clbrdf.instrument.settings import load_instrument

        check_bandwidth(load_instrument(path), path.name, smooth)
        return cls(path.name, path.read_bytes())

    @property
    def sha256(self) -> str:
        """Of the file, in hexadecimal."""
        return hashlib.sha256(self.content).hexdigest()

    @contextmanager
    def on_disk(self) -> Iterator[Path]:
        """Give the path of a copy under its own name, for as long as the block runs."""
        with tempfile.TemporaryDirectory(prefix="clbrdf-batch-") as folder:
            path = Path(folder) / self.name
            path.write_bytes(self.content)
            yield path


@dataclass(frozen=True)
class Request:
    """The settings of `clbrdf fit`, or of `clbrdf choose`, for all scans; plain values that travel.

    Attributes
    ----------
    model, method, weights, seed, smooth, rtol, force
        As of the command.
    bounds : mapping of str to (float, float)
    fix : mapping of str to float
    bounds_text, fix_text, shared_text : tuple of str
        The same as the user wrote them, for the record.
    shared : tuple of str
    choose : bool
        Choose a model for each scan.
    models, wavelengths : str or None
        Of the choice.
    through : InstrumentFile or None
    point, monte_carlo, gls, profile
        As of the command.
    version : str
        Of the program that asks; workers have to run it, too.
    """

    model: str
    method: str
    weights: str | None
    seed: int
    bounds: Mapping[str, tuple[float, float]]
    fix: Mapping[str, float]
    shared: tuple[str, ...]
    smooth: float | None
    rtol: float | None
    force: bool
    bounds_text: tuple[str, ...] = ()
    fix_text: tuple[str, ...] = ()
    shared_text: tuple[str, ...] = ()
    choose: bool = False
    models: str | None = None
    wavelengths: str = ""
    through: InstrumentFile | None = None
    point: bool = False
    monte_carlo: int | None = None
    gls: bool = False
    profile: bool = False
    version: str = __version__

    def __post_init__(self) -> None:
        """Look at what is the same for all scans.

        Raises
        ------
        InputError
            An unknown model, method or kind of weights, limits that the model does not take, or options that
            do not go together.
        """
        if self.weights is not None and self.weights not in WEIGHTS:
            raise InputError(f"--weights {self.weights!r}: a batch takes {', '.join(WEIGHTS)}")
        if not self.choose:
            chosen = get_model(self.model, force=self.force)
            chosen.bounds(self.bounds)
            get_method(self.method, chosen, given=frozenset(chosen.by_full_name(self.fix)))
            check_draws(self.monte_carlo)
            check_together(
                self.weights or WEIGHTS[0],
                bool(self.shared),
                smooth=self.smooth,
                rtol=self.rtol,
                monte_carlo=self.monte_carlo,
                gls=self.gls,
                profile=self.profile,
            )

    @property
    def in_blocks(self) -> bool:
        """Whether the wavelengths of a scan are solved block by block, each for itself."""
        return not self.choose and not self.shared and self.rtol is None

    def identity(self) -> dict[str, Any]:
        """Return what tells this request from others, as plain values."""
        values = asdict(self)
        for name in ("bounds_text", "fix_text", "shared_text"):
            del values[name]
        if self.through is not None:
            values["through"] = f"{self.through.name} of SHA-256 {self.through.sha256}"
        # As JSON gives it back.
        return dict(json.loads(json.dumps(values)))

    def digest(self) -> str:
        """Return the SHA-256 of `identity`, in hexadecimal."""
        return hashlib.sha256(json.dumps(self.identity(), sort_keys=True).encode()).hexdigest()

    def fit(self, scan: Scan, executor: Executor | None = None) -> Fit:
        """Fit a scan."""
        with self._behind() as told:
            return fit(
                scan,
                model=get_model(self.model, force=self.force),
                method=self.method,
                seed=self.seed,
                weights=self.weights or WEIGHTS[0],
                bounds=dict(self.bounds),
                fix=dict(self.fix),
                shared=self.shared,
                smooth=self.smooth,
                through=told,
                rtol=self.rtol,
                monte_carlo=self.monte_carlo,
                gls=self.gls,
                profile=self.profile,
                executor=executor,
            )

    def choice(self, scan: Scan) -> Choice:
        """Choose a model for a scan."""
        with self._behind() as told:
            return choose(
                scan,
                self.models,
                weights=self.weights,
                fix=dict(self.fix),
                wavelengths=None if self.wavelengths == "all" else int(self.wavelengths),
                method=self.method,
                seed=self.seed,
                through=told,
                force=self.force,
            )

    @contextmanager
    def _behind(self) -> Iterator[str | Path]:
        """Give what a fit is told of the instrument."""
        if self.through is None:
            yield POINT if self.point else SCAN
        else:
            with self.through.on_disk() as path:
                yield path

    def made(self, source: Input, fitted: Fit, weights: str) -> dict[str, str]:
        """Return the provenance of a fit: that which `clbrdf fit` or `clbrdf choose` gives it."""
        through = None if self.through is None else self.through.name
        hashes = {} if self.through is None else {"through_sha256": self.through.sha256}
        told = {**hashes, **fitted.provenance, "weights": weights}
        if self.choose:
            options = choose_options(
                models=self.models,
                weights=self.weights,
                fix=self.fix_text,
                wavelengths=self.wavelengths,
                method=self.method,
                seed=self.seed,
                force=self.force,
                through=through,
                point=self.point,
            )
            return made_by("choose", [source], options, told)
        options = fit_options(
            method=self.method,
            seed=self.seed,
            weights=weights,
            bounds=self.bounds_text,
            model=self.model,
            fix=[f"{name}={value}" for name, value in self.fix.items()],
            shared=self.shared_text,
            smooth=self.smooth,
            rtol=self.rtol,
            through=through,
            point=self.point,
            monte_carlo=self.monte_carlo,
            gls=self.gls,
            profile=self.profile,
        )
        return made_by("fit", [source], options, told)
