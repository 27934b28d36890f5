"""`clbrdf fit`: the model at every wavelength."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter

from clbrdf.cli.check import NO_CHECK, check_count, run_check, verdict_content
from clbrdf.cli.console import progress_bar
from clbrdf.cli.instrument import told_instrument
from clbrdf.cli.options import (
    CsvFile,
    DeviceName,
    JsonFile,
    Output,
    Overwrite,
    Seed,
    at_wavelengths,
    fix_words,
    fixed_map,
    name_list,
    pair_map,
)
from clbrdf.cli.summary import print_fit
from clbrdf.cli.uncertainty_tables import uncertainty_content
from clbrdf.errors import InputError
from clbrdf.fit import METHODS, AnnealSettings, Fit, fit
from clbrdf.fit.remarks import Remark
from clbrdf.fit.weights_file import read_weights
from clbrdf.fit.words import remark_words
from clbrdf.models import DEFAULT_MODEL, get_model
from clbrdf.objective import WEIGHTS
from clbrdf.opencl.device import choose_device
from clbrdf.optimizers.check import TIED, tolerance_of
from clbrdf.scan import Scan
from clbrdf.storage.files import check_apart, check_output, sha256, whole_text
from clbrdf.storage.provenance import fit_options, made_by


def command(
    scan: Path,
    /,
    *,
    output: Output,
    method: str = METHODS[0],
    seed: Seed = 0,
    weights: str = WEIGHTS[0],
    bounds: Annotated[list[str], Parameter(negative_iterable="")] = [],  # noqa: B006 (cyclopts needs a list)
    model: str = DEFAULT_MODEL,
    fix: Annotated[list[str], Parameter(negative_iterable="")] = [],  # noqa: B006
    shared: Annotated[list[str], Parameter(negative_iterable="")] = [],  # noqa: B006
    force: Annotated[bool, Parameter(negative="")] = False,
    smooth: float | None = None,
    through: Path | None = None,
    point: Annotated[bool, Parameter(negative="")] = False,
    rtol: float | None = None,
    monte_carlo: int | None = None,
    gls: Annotated[bool, Parameter(negative="")] = False,
    profile: Annotated[bool, Parameter(negative="")] = False,
    chains: int | None = None,
    levels: int | None = None,
    device: DeviceName = None,
    json: JsonFile = None,
    csv: CsvFile = None,
    all_rows: Annotated[bool, Parameter(negative="")] = False,
    check: Annotated[bool, Parameter(negative="")] = False,
    check_wavelengths: str | None = None,
    overwrite: Overwrite = False,
) -> int:
    """Fit the model at every wavelength of a scan; print the table and write the fit.

    Parameters
    ----------
    scan
        scan file
    method
        auto, dictionary, lookup, anneal-separable, tempering or anneal
    seed
        of the random numbers; the same seed gives the same file, byte for byte
    weights
        none (as the paper), relative (1/f²), sigma (1/σ² of the scan), or a CSV file with columns
        theta_i_deg, theta_r_deg, dphi_deg, weight
    bounds
        name=lower:upper in place of the model's limits, as often as needed
    model
        name of the model, or a sum such as ggx+minnaert; clbrdf models lists them
    fix
        name=value or name=FILE.csv (wavelength in nm, value) for a parameter that is not fitted, as often as
        needed
    shared
        names of parameters that are one number for all wavelengths, such as ggx.alpha or, where only one part
        of the model has it, alpha
    force
        allow a sum of models that are whole surfaces each, such as hapke+rpv
    smooth
        tie neighbouring wavelengths: the share of its range by which a parameter is expected to change in
        10 nm, for instance 0.01; off by default
    through
        instrument file: aperture, beam, footprint, misalignment, bandwidth as in a scene's [effects]; what is
        fitted is then what the detector sees. By default what the scan tells of its own instrument
    point
        take every direction as a point, whatever the scan says
    rtol
        take the cheapest search that brings E within this share of the optimum, measured on a sample of the
        wavelengths; from 1e-9
    monte_carlo
        fit so many draws of what the values could have been, 1000 for instance, and tell intervals that know
        of limits and curvature; every wavelength by itself
    gls
        let the correlations of the scan's uncertainty count as weights, too (generalised least squares); this
        takes the model for exact
    profile
        find intervals of the parameters by profile likelihood; they hold at limits, too
    chains
        annealing chains a wavelength (--method anneal and anneal-separable)
    levels
        temperature levels (--method anneal and anneal-separable)
    all_rows
        print every wavelength, however many
    check
        search the optimum again with two independent optimizers at a sample of wavelengths and print a
        verdict for each; exit status 1 where the fit is worse
    check_wavelengths
        how many of them, 8 if not given, or all; means --check
    """
    fixed = fixed_map(fix)
    spectra = [value for value in fixed.values() if isinstance(value, Path)]
    behind = told_instrument(through, point)
    instrument = [] if through is None else [through]
    check_apart([output, json, csv], [scan, *spectra, *instrument])
    target = check_output(output, overwrite)
    for extra in (json, csv):
        if extra is not None:
            check_output(extra, overwrite)
    checked = check_count(check, check_wavelengths)
    if checked != NO_CHECK and smooth is not None:
        raise InputError(f"--check: {TIED}")
    if checked != NO_CHECK and gls:
        raise InputError(
            "--check searches the optimum of E (13), and --gls minimises another sum; leave one out"
        )
    chosen = get_model(model, force=force)
    measured = Scan.open(scan)
    with progress_bar(f"fitting {len(measured.wavelength)} wavelengths") as report:
        result = fit(
            measured,
            method=method,
            seed=seed,
            weights=weights if weights in WEIGHTS else read_weights(Path(weights), measured),
            bounds=pair_map(bounds),
            model=chosen,
            fix=at_wavelengths(fixed, measured),
            shared=name_list(shared),
            smooth=smooth,
            through=behind,
            rtol=rtol,
            monte_carlo=monte_carlo,
            gls=gls,
            profile=profile,
            settings=_settings(method, chains, levels),
            device=choose_device(device),
            report=report,
        )
    options = fit_options(
        method=method,
        seed=seed,
        weights=weights,
        bounds=bounds,
        model=model,
        fix=fix_words(fixed),
        shared=shared,
        smooth=smooth,
        rtol=rtol,
        through=None if through is None else through.name,
        point=point,
        monte_carlo=monte_carlo,
        gls=gls,
        profile=profile,
    )
    hashes = {f"spectrum_{k}_sha256": sha256(path) for k, path in enumerate(spectra)}
    hashes |= {} if through is None else {"through_sha256": sha256(through)}
    made = made_by("fit", [scan], options, {**hashes, **result.provenance, "weights": weights})
    result = replace(result, provenance=made)
    result.save(target, overwrite)
    if csv is not None:
        result.to_csv(csv, overwrite)
    print_fit(str(target), result, all_rows)
    verdicts = run_check(result, checked)
    if json is not None:
        told = {"check": verdict_content(verdicts, tolerance_of(result))} if verdicts else {}
        whole_text(json, {**fit_content(result), **told}, overwrite)
    return int(any(verdict.word == "worse" for verdict in verdicts))


def _settings(method: str, chains: int | None, levels: int | None) -> AnnealSettings | None:
    """Return settings of an annealing method, None where nothing is asked for.

    Raises
    ------
    InputError
        Settings of annealing for a method that does not anneal.
    """
    if chains is None and levels is None:
        return None
    if method not in ("anneal", "anneal-separable"):
        name = "chains" if chains is not None else "levels"
        raise InputError(f"--{name} is for annealing; add --method anneal, or leave it out")
    usual = AnnealSettings()
    return AnnealSettings(
        chains=usual.chains if chains is None else chains,
        levels=usual.levels if levels is None else levels,
    )


def remark_content(remark: Remark) -> dict[str, Any]:
    """Return a remark as plain values for JSON, with its words."""
    return {**asdict(remark), "words": remark_words(remark)}


def fit_content(fit: Fit) -> dict[str, Any]:
    """Return a fit as plain values for JSON; NaN and infinite values become null there."""
    scan = fit.scan
    return {
        "sample": scan.sample,
        "model": fit.model.name,
        "method": fit.setup.method,
        "seed": fit.setup.seed,
        "given": list(fit.given),
        "shared": list(fit.shared),
        "device": fit.search.device,
        "seconds": fit.search.seconds,
        "provenance": dict(fit.provenance),
        "bounds": dict(zip(fit.model.names, fit.setup.bounds.tolist(), strict=True)),
        "incident_angles": scan.incident_angles.tolist(),
        "wavelength": scan.wavelength.tolist(),
        "parameters": {name: values.tolist() for name, values in fit.parameters.items()},
        "sigma": {name: values.tolist() for name, values in fit.sigma.items()},
        "uncertainty": uncertainty_content(fit),
        "intervals": {name: values.tolist() for name, values in fit.intervals.items()},
        "objective": fit.objective.tolist(),
        "relative_rms": fit.relative_rms.tolist(),
        "relative_rms_by_incident_angle": fit.goodness.relative_rms_by_incident_angle.T.tolist(),
        "degrees_of_freedom": fit.goodness.degrees.tolist(),
        "chi2_reduced": fit.chi2_reduced.tolist(),
        "scatter": fit.goodness.scatter.tolist(),
        "lag_one_correlation": fit.goodness.lag_one.tolist(),
        "lack_of_fit": fit.goodness.lack_of_fit.tolist(),
        "misfit": fit.misfit.tolist(),
        "status": fit.status.tolist(),
        "at_bound": fit.estimate.at_bound.tolist(),
        "correlation": fit.correlation.tolist(),
        "condition": fit.estimate.condition.tolist(),
        "remarks": [[remark_content(remark) for remark in remarks] for remarks in fit.remarks],
        "starts": fit.search.starts.tolist(),
        "agreeing": fit.search.agreeing.tolist(),
        "evaluations": fit.search.evaluations.tolist(),
        "acceptance": fit.search.acceptance.tolist(),
        "not_finite": fit.search.not_finite.tolist(),
        "masked": np.count_nonzero(scan.mask, axis=0).tolist(),
    }
