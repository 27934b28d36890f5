"""`clbrdf batch`: many scans, on Dask."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from clbrdf.batch.request import InstrumentFile, Request
from clbrdf.batch.tasks import Source
from clbrdf.choose import RANKED_WAVELENGTHS
from clbrdf.cli.console import print_table, progress_bar
from clbrdf.cli.instrument import told_instrument
from clbrdf.cli.options import JsonFile, Seed, fixed_map, name_list, pair_map
from clbrdf.errors import InputError
from clbrdf.fit import METHODS
from clbrdf.models import DEFAULT_MODEL
from clbrdf.storage.files import check_apart, check_output, split_entry, whole_text

if TYPE_CHECKING:
    from distributed import Client

    from clbrdf.batch.run import Outcome

Texts = Annotated[list[str], Parameter(negative_iterable="")]
Flag = Annotated[bool, Parameter(negative="")]


def command(
    *scans: Path,
    output: Annotated[Path, Parameter(name=["--output", "-o"], help="folder of the catalogue")],
    model: str = DEFAULT_MODEL,
    choose: Flag = False,
    models: str | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    resume: Flag = False,
    method: str = METHODS[0],
    seed: Seed = 0,
    weights: str | None = None,
    bounds: Texts = [],  # noqa: B006 (cyclopts needs a list)
    fix: Texts = [],  # noqa: B006
    shared: Texts = [],  # noqa: B006
    smooth: float | None = None,
    through: Path | None = None,
    point: Flag = False,
    rtol: float | None = None,
    monte_carlo: int | None = None,
    gls: Flag = False,
    profile: Flag = False,
    wavelengths: str = str(RANKED_WAVELENGTHS),
    force: Flag = False,
    json: JsonFile = None,
) -> int:
    """Fit many scans on all cores, or on a cluster; one file a scan, and a table of everything.

    The folder gets NAME.h5 for every scan, byte for byte what 'clbrdf fit' or 'clbrdf choose' writes, and
    index.parquet, a row for every scan and wavelength. A scan that cannot be fitted costs a line, and exit
    status 1.

    Parameters
    ----------
    scans
        scan files; of a file of several scans, name one as in file.h5::name
    model
        of the fit, as 'clbrdf fit' takes it
    choose
        choose a model for each scan, as 'clbrdf choose' does
    models
        candidates of the choice
    scheduler
        address of a Dask scheduler, as in tcp://host:8786; without it, processes on this machine
    workers
        how many processes on this machine; as many as cores if not given
    resume
        go on with the batch in the folder; what is done stays
    method
        of the fits: auto, dictionary, lookup, anneal-separable, tempering or anneal
    seed
        of the random numbers
    weights
        none, relative (1/f²) or sigma (1/σ² of the scan)
    bounds
        name=lower:upper in place of the model's limits, as often as needed
    fix
        name=value for a parameter that is not fitted, as often as needed
    shared
        names of parameters that are one number for all wavelengths of a scan
    smooth
        tie neighbouring wavelengths, as 'clbrdf fit' does
    through
        instrument file of all scans, as 'clbrdf fit' reads it; by default what each scan tells of its
        own
    point
        take every direction as a point, whatever the scans say
    rtol
        take the cheapest search that brings E within this share of the optimum
    monte_carlo
        fit so many draws of what the values could have been, as 'clbrdf fit' does
    gls
        let the correlations of the scans' uncertainties count as weights, too, as 'clbrdf fit' does
    profile
        find intervals of the parameters by profile likelihood, as 'clbrdf fit' does
    wavelengths
        at how many wavelengths a choice is made, or all
    force
        allow sums of whole surfaces
    """
    from clbrdf.batch.cluster import load_dask, local_cluster, look_at_workers, remote_cluster
    from clbrdf.batch.folder import open_catalogue
    from clbrdf.batch.run import run_batch

    if json is not None:
        check_apart([json], [*scans, *([] if through is None else [through])])
        check_output(json, overwrite=True)
    if workers is not None and workers < 1:
        raise InputError(f"--workers {workers}: give 1 or more")
    if workers is not None and scheduler is not None:
        raise InputError("--workers counts processes on this machine; leave it out, or --scheduler")
    of_fit = {"--shared": shared, "--smooth": smooth, "--rtol": rtol, "--bounds": bounds}
    of_fit |= {"--monte-carlo": monte_carlo, "--gls": gls or None, "--profile": profile or None}
    _check_choice(choose, models, wavelengths, of_fit)
    told_instrument(through, point)
    sources = _sources(scans)
    request = Request(
        model="" if choose else model,
        method=method,
        weights=weights if choose or weights else "none",
        seed=seed,
        bounds=pair_map(bounds),
        fix=_fixed(fix),
        shared=name_list(shared),
        smooth=smooth,
        rtol=rtol,
        force=force,
        bounds_text=tuple(bounds),
        fix_text=tuple(fix),
        shared_text=tuple(shared),
        choose=choose,
        models=models,
        wavelengths=wavelengths if choose else "",
        through=None if through is None else InstrumentFile.read(through, smooth is not None),
        point=point,
        monte_carlo=monte_carlo,
        gls=gls,
        profile=profile,
    )
    load_dask()
    begun = time.perf_counter()
    with ExitStack() as stack:
        if scheduler is not None:
            client = stack.enter_context(_quietly(remote_cluster(scheduler)))
            catalogue = stack.enter_context(open_catalogue(output, request, resume))
        else:
            catalogue = stack.enter_context(open_catalogue(output, request, resume))
            client = stack.enter_context(_quietly(local_cluster(workers)))
        good, bad = look_at_workers(client, request.version)
        for address, reason in bad.items():
            _say(f"worker {address} is left out: {reason}")
        print(f"dashboard: {client.dashboard_link}", file=sys.stderr, flush=True)
        with progress_bar("scans") as report:
            outcome = run_batch(client, sources, catalogue, len(good), bad=bad, report=report, tell=_say)
    _print_outcome(output, outcome, time.perf_counter() - begun)
    if json is not None:
        content = {"fitted": outcome.fitted, "done_before": outcome.kept, "failed": outcome.failed}
        content |= {
            "wavelengths": dict(outcome.wavelengths),
            "tasks": outcome.tasks,
            "bytes_sent": outcome.sent,
        }
        whole_text(json, content, overwrite=True)
    return int(bool(outcome.failed))


def _sources(scans: Sequence[Path]) -> list[Source]:
    """Return the scans of a batch with the names of their files.

    Raises
    ------
    InputError
        There are none, or two of the same name.
    """
    if not scans:
        raise InputError("no scans; name their files, as in clbrdf batch *.h5 -o catalogue")
    sources: dict[str, Source] = {}
    for path in scans:
        file, entry = split_entry(path)
        stem = file.stem + (f"-{entry}" if entry else "")
        whole = f"{file.absolute()}::{entry}" if entry else str(file.absolute())
        if stem in sources:
            other = sources[stem].path
            told = "is given twice" if other == whole else f"and {other} would both be {stem}.h5; rename one"
            raise InputError(f"{whole} {told}")
        sources[stem] = Source(whole, stem)
    return list(sources.values())


def _fixed(texts: list[str]) -> dict[str, float]:
    values = {}
    for name, value in fixed_map(texts).items():
        if isinstance(value, Path):
            raise InputError(f"--fix {name}={value}: a batch takes a number here, which holds for all scans")
        values[name] = value
    return values


def _check_choice(choose: bool, models: str | None, wavelengths: str, others: Mapping[str, object]) -> None:
    """Raise InputError where options of a choice and of a fit are mixed."""
    if not choose and models is not None:
        raise InputError("--models names the candidates of a choice; add --choose, or give one --model")
    for name, value in others.items():
        if choose and value not in (None, []):
            raise InputError(f"{name} is of a fit; leave it out with --choose")
    if not (
        wavelengths == "all" or (wavelengths.isascii() and wavelengths.isdigit() and int(wavelengths) > 0)
    ):
        raise InputError(f"--wavelengths {wavelengths!r}: give a whole number of 1 or more, or all")


@contextmanager
def _quietly(cluster: object) -> Iterator[Client]:
    """Run a cluster without the warnings that Dask has for programmers."""
    import warnings
    from contextlib import AbstractContextManager
    from typing import cast

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with cast("AbstractContextManager[Client]", cluster) as client:
            yield client


def _say(text: str) -> None:
    print(f"clbrdf: {' '.join(text.split())}", file=sys.stderr, flush=True)


def _print_outcome(output: Path, outcome: Outcome, seconds: float) -> None:
    rows = [
        ["scans fitted", str(outcome.fitted)],
        *([["scans done before", str(outcome.kept)]] if outcome.kept else []),
        *([["failed", str(len(outcome.failed))]] if outcome.failed else []),
        *([f"  wavelengths {status}", str(count)] for status, count in outcome.wavelengths.most_common()),
        ["tasks", str(outcome.tasks)],
        ["seconds", f"{seconds:.0f}"],
    ]
    print_table("", (f"{output}", "count"), rows)
