"""What is to be done with every scan of a batch."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from clbrdf.choose import Choice, choose
from clbrdf.errors import InputError
from clbrdf.fit import Fit, fit
from clbrdf.fit.methods import get_method
from clbrdf.models import get_model
from clbrdf.objective import WEIGHTS
from clbrdf.parallel.executor import Executor
from clbrdf.scan import Scan
from clbrdf.storage.provenance import Input, choose_options, fit_options, made_by
from clbrdf.version import __version__


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
    version: str = __version__

    def __post_init__(self) -> None:
        """Look at what is the same for all scans.

        Raises
        ------
        InputError
            An unknown model, method or kind of weights, or limits that the model does not take.
        """
        if self.weights is not None and self.weights not in WEIGHTS:
            raise InputError(f"--weights {self.weights!r}: a batch takes {', '.join(WEIGHTS)}")
        if not self.choose:
            chosen = get_model(self.model, force=self.force)
            chosen.bounds(self.bounds)
            get_method(self.method, chosen, given=frozenset(chosen.by_full_name(self.fix)))

    @property
    def in_blocks(self) -> bool:
        """Whether the wavelengths of a scan are solved block by block, each for itself."""
        return not self.choose and not self.shared and self.rtol is None

    def identity(self) -> dict[str, Any]:
        """Return what tells this request from others, as plain values."""
        values = asdict(self)
        for name in ("bounds_text", "fix_text", "shared_text"):
            del values[name]
        # As JSON gives it back.
        return dict(json.loads(json.dumps(values)))

    def digest(self) -> str:
        """Return the SHA-256 of `identity`, in hexadecimal."""
        return hashlib.sha256(json.dumps(self.identity(), sort_keys=True).encode()).hexdigest()

    def fit(self, scan: Scan, executor: Executor | None = None) -> Fit:
        """Fit a scan."""
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
            rtol=self.rtol,
            executor=executor,
        )

    def choice(self, scan: Scan) -> Choice:
        """Choose a model for a scan."""
        return choose(
            scan,
            self.models,
            weights=self.weights,
            fix=dict(self.fix),
            wavelengths=None if self.wavelengths == "all" else int(self.wavelengths),
            method=self.method,
            seed=self.seed,
            force=self.force,
        )

    def made(self, source: Input, fitted: Fit, weights: str) -> dict[str, str]:
        """Return the provenance of a fit: that which `clbrdf fit` or `clbrdf choose` gives it."""
        if self.choose:
            options = choose_options(
                models=self.models,
                weights=self.weights,
                fix=self.fix_text,
                wavelengths=self.wavelengths,
                method=self.method,
                seed=self.seed,
                force=self.force,
            )
            return made_by("choose", [source], options, {**fitted.provenance, "weights": weights})
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
        )
        return made_by("fit", [source], options, {**fitted.provenance, "weights": weights})
