"""From a plan and a rig file to a scan file: lock, connect, acquire, join, calibrate, save."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clbrdf import __version__
from clbrdf.errors import InputError, advice
from clbrdf.progress import Report, silent
from clbrdf.rig.acquire import CHANGED, Acquisition, ignore, undisturbed
from clbrdf.rig.adaptive.candidates import CandidatePoints, make_candidates
from clbrdf.rig.adaptive.observe import StoredRows
from clbrdf.rig.adaptive.planner import DOUBTED, ENDED, AdaptivePlanner
from clbrdf.rig.budget import Budget
from clbrdf.rig.calibrate import calibrate, grid_and_weights, save_calibrated
from clbrdf.rig.connection import nobody
from clbrdf.rig.errors import InstrumentError, go_on
from clbrdf.rig.eventlog import Event, EventLog, now_text
from clbrdf.rig.instruments import Instruments, make_instruments
from clbrdf.rig.lamplines import corrected
from clbrdf.rig.live import Live, Snapshot
from clbrdf.rig.planfile import Plan, load_plan
from clbrdf.rig.planner import FixedRoute, Planner
from clbrdf.rig.rawscan import RawScan, read_raw, read_settings
from clbrdf.rig.rigfile import Rig, load_rig
from clbrdf.rig.route import Route, plan_route
from clbrdf.rig.row import REFERENCES, SKIPPED, Row
from clbrdf.rig.sanity import check_nonlinearity, check_wavelengths
from clbrdf.rig.segment import Columns, read_header, read_rows
from clbrdf.rig.store import Lock, Store, log_path, run_folder, segments
from clbrdf.scan import Scan
from clbrdf.storage.files import check_output


@dataclass(frozen=True)
class MeasurementOutcome:
    """What a measurement came to.

    Attributes
    ----------
    points : int
        In the scan.
    skipped : int
        Of them, at a limit switch.
    left_out : int
        Of the plan, because they cannot be reached.
    events : int
        Lines in the log.
    values : int
        Points times wavelengths.
    flagged : mapping of str to int
        Values by what is wrong with them; one value may count under several names.
    masked : int
        Values that are no measurement at all.
    changes : tuple of str
        What the log says of a direct beam that was not what it was before.
    end, doubt : str
        Why an adaptive plan ended and what it reached: in `end` where all is well, in `doubt` where the
        target was not reached or the model does not describe the surface; else "".
    """

    points: int
    skipped: int
    left_out: int
    events: int
    values: int
    flagged: dict[str, int]
    masked: int
    changes: tuple[str, ...]
    end: str = ""
    doubt: str = ""


@dataclass(frozen=True)
class Hooks:
    """What a measurement calls while it runs; as `measure` takes them."""

    report: Report
    check: Callable[[], None]
    ask: Callable[[str], str]
    pause: Callable[[Callable[[], None]], bool]
    live: Callable[[Snapshot], None] | None

    def seen(self, plan: Plan, rig: Rig, store: Store, budget: Budget) -> Callable[[Row], None]:
        """Return what is told each point as it is committed."""
        if self.live is None:
            return ignore
        total = int(store.header["points"] or 0)
        return Live(plan, rig, store, total, budget, self.live).point


def never() -> None:
    """Nobody asks to stop."""


def measure(
    plan_path: str | Path,
    rig_path: str | Path,
    output: str | Path,
    *,
    resume: bool = False,
    overwrite: bool = False,
    budget: Budget | None = None,
    report: Report = silent,
    show: Callable[[Event], None] | None = None,
    check: Callable[[], None] = never,
    ask: Callable[[str], str] = nobody,
    pause: Callable[[Callable[[], None]], bool] = undisturbed,
    live: Callable[[Snapshot], None] | None = None,
) -> MeasurementOutcome:
    """Measure a plan on a rig and write the absolute scan.

    Parameters
    ----------
    plan_path, rig_path : path
        TOML files.
    output : path
        The scan file; while it runs, its rows are in the folder `<output>.run`.
    resume : bool
        Go on with an interrupted measurement (or begin, where there is none).
    overwrite : bool
        Replace an existing scan file, or a measurement that was begun and not resumed.
    budget : Budget, optional
        For the uncertainties; the paper's if not given.
    report, show : callable
        Told the points done and in all; told each event of the log.
    check : callable
        Called between exchanges; raises `StoppedError` to stop cleanly.
    ask : callable
        Puts a question to a person and returns the answer, for what is done by hand.
    pause : callable
        Called between points with what makes the rig safe; True where it has waited.
    live : callable, optional
        Told each point, calibrated, as it comes.

    Raises
    ------
    InputError
        Files that cannot be used, before anything moves.
    InstrumentError
        An instrument that cannot be used; all rows so far are safe.
    StorageError
        The disk is full; all rows so far are safe.
    StoppedError
        From `check`.
    """
    plan, rig = load_plan(plan_path), load_rig(rig_path)
    try:
        work = _work(plan, rig)
    except InputError as error:
        raise InputError(f"{plan_path}: {error}") from error
    chosen = budget or Budget()
    target = check_output(output, overwrite=True)
    with Lock(target):
        folder = run_folder(target)
        _tidy(target)
        if resume and target.exists() and not overwrite:
            return _finished(target, plan, rig, work, folder)
        check_output(target, overwrite)
        if folder.exists() and not resume:
            if not overwrite:
                raise InputError(
                    f"{folder}: holds a measurement that was interrupted; {go_on()},"
                    f" or start again with {advice('overwrite=True', '--overwrite')}"
                )
            _discard(folder)
        folder.mkdir(exist_ok=True)
        log = EventLog(log_path(folder), show)
        word = "resumed" if segments(folder) else "new"
        log.add("rig", "start", f"clbrdf {__version__}, {_size(work)}, {word}")
        for reason, count in work.unreachable.items():
            log.add("rig", "left out", f"{count} points {reason}")
        _acquire(plan, rig, work, folder, log, Hooks(report, check, ask, pause, live), chosen)
        raw = join(folder)
        calibrated = calibrate(raw, chosen)
        try:
            save_calibrated(target, raw, calibrated, chosen, overwrite)
        except InputError as error:
            raise InputError(f"{error}; all rows are safe in {folder}: then {go_on()}") from error
        _discard(folder)
    return _outcome(raw, calibrated, work)


Work = Route | CandidatePoints
"""What is measured: all of it, or what a planner chooses from it."""


def _work(plan: Plan, rig: Rig) -> Work:
    return plan_route(plan, rig) if plan.adaptive is None else make_candidates(plan, rig)


def _size(work: Work) -> str:
    return f"{len(work)} points" if isinstance(work, Route) else f"adaptive, {len(work)} directions"


def _planner(plan: Plan, rig: Rig, work: Work, store: Store, log: EventLog, budget: Budget) -> Planner:
    if isinstance(work, Route):
        return FixedRoute(work)
    assert plan.adaptive is not None
    observer = StoredRows(plan, rig, store, budget)
    return AdaptivePlanner(plan.adaptive, work, rig, observer, partial(log.add, "planner"))


def _outcome(raw: RawScan, scan: Scan, work: Work) -> MeasurementOutcome:
    mark, lines = f": {CHANGED}: ", raw.log.splitlines()
    return MeasurementOutcome(
        len(scan.theta_i),
        int(np.count_nonzero(raw.rows["flags"] & SKIPPED)),
        work.planned - len(work),
        len(lines),
        scan.brdf.size,
        scan.flag_counts(),
        int(np.count_nonzero(scan.mask)),
        tuple(line.partition(mark)[2] for line in lines if mark in line),
        _last_said(lines, f" planner: {ENDED}: "),
        _last_said(lines, f" planner: {DOUBTED}: "),
    )


def _last_said(lines: list[str], mark: str) -> str:
    return next((line.partition(mark)[2] for line in reversed(lines) if mark in line), "")


def _finished(target: Path, plan: Plan, rig: Rig, work: Work, folder: Path) -> MeasurementOutcome:
    """Nothing is left to do: killed between saving the scan and removing its folder, or resumed twice."""
    raw = read_raw(target)
    wanted = _header(plan, rig)
    for key in ("plan", "rig"):
        if raw.provenance.get(f"{key}_sha256") != wanted[f"{key}_fingerprint"]:
            raise InputError(f"{target}: exists and was measured with another {key}; choose another name")
    if folder.exists():
        _discard(folder)
    return _outcome(raw, Scan.open(target), work)


def _tidy(target: Path) -> None:
    """Remove what a killed process left half done; the lock is held, so nobody works on it."""
    for part in target.parent.glob(f".{target.name}.*.part"):
        part.unlink()
    old = _old(run_folder(target))
    if old.exists():
        shutil.rmtree(old)


def _old(folder: Path) -> Path:
    return folder.with_name(f".{folder.name}.old")


def _acquire(
    plan: Plan,
    rig: Rig,
    work: Work,
    folder: Path,
    log: EventLog,
    hooks: Hooks,
    budget: Budget,
) -> None:
    """Connect and measure what is missing."""
    points = str(len(work)) if isinstance(work, Route) else ""
    store = Store(folder, {**_header(plan, rig), "points": points}, rig.storage.keep_free)
    planner = _planner(plan, rig, work, store, log, budget)
    for row in store.points:
        planner.tell(row)
    if planner.ask() is None and store.last is not None and store.last.kind in REFERENCES:
        return
    instruments = make_instruments(rig, log, hooks.check, hooks.ask)
    try:
        store.header.update(_connect(instruments))
        _check_same_spectrometer(store)
        wavelength = np.array(json.loads(store.header["wavelength"]))
        window = _window(wavelength, plan, instruments.spectrometer.is_discrete)
        seen = hooks.seen(plan, rig, store, budget)
        acquisition = Acquisition(
            instruments, plan, planner, store, log, window, hooks.check, hooks.pause, seen, hooks.ask
        )
        acquisition.run(hooks.report)
        instruments.stages.park()
    except InstrumentError as error:
        if not segments(folder):
            raise
        done = f"{len(store.points)} of {planner.total or 'the'} points are safe"
        raise InstrumentError(f"{error}; {done}, {go_on()}") from error
    finally:
        instruments.make_safe()
        instruments.close()
        store.close()
        if not segments(folder):
            _discard(folder)


def _connect(instruments: Instruments) -> dict[str, str]:
    """Connect, and return what the instruments say of themselves, for the header of a segment."""
    identity = instruments.connect()
    spectrometer, settings = instruments.spectrometer, instruments.rig.spectrometer
    wavelength = spectrometer.get_wavelengths()
    check_wavelengths(wavelength)
    wavelength = corrected(wavelength, settings.wavelength_correction)
    full_scale = min(spectrometer.full_scale, settings.full_scale or spectrometer.full_scale)
    nonlinearity = spectrometer.get_nonlinearity_coefficients()
    check_nonlinearity(nonlinearity, full_scale)
    return {
        "instruments": identity,
        "wavelength": json.dumps(wavelength.tolist()),
        "nonlinearity": json.dumps(nonlinearity.tolist()),
        "full_scale": str(full_scale),
        "is_discrete": str(int(spectrometer.is_discrete)),
        "begun": now_text(),
    }


def _check_same_spectrometer(store: Store) -> None:
    """Raise InputError where the segments before came from another spectrometer."""
    for path in segments(store.folder)[:1]:
        found = read_header(path)
        if any(found.get(key) != store.header[key] for key in ("wavelength", "nonlinearity")):
            raise InputError(
                f"{store.folder}: was begun with another spectrometer; connect that one, then {go_on()}"
            )


def _window(wavelength: npt.NDArray[np.float64], plan: Plan, is_discrete: bool) -> slice:
    """Pixels that the plan's grid uses; raises InputError where the spectrometer lacks some."""
    _, weights = grid_and_weights(wavelength, plan.wavelength, is_discrete)
    used = np.nonzero(weights.sum(axis=0))[0]
    return slice(int(used[0]), int(used[-1]) + 1)


def _header(plan: Plan, rig: Rig) -> dict[str, str]:
    return {
        "software": f"clbrdf {__version__}",
        "plan": plan.model_dump_json(),
        "rig": rig.model_dump_json(),
        "plan_fingerprint": _hash(plan.model_dump_json()),
        "rig_fingerprint": _hash(rig.fingerprint()),
    }


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _discard(folder: Path) -> None:
    """Remove a folder; a kill half-way leaves it under a name that means nothing."""
    folder.rename(_old(folder))
    shutil.rmtree(_old(folder))


def join(folder: Path) -> RawScan:
    """Return all segments of a measurement as one record.

    Raises
    ------
    InputError
        A segment is damaged.
    """
    paths = segments(folder)
    header = read_header(paths[0])
    tables = [read_rows(path) for path in paths]
    rows: Columns = {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
    plan, rig = read_settings(header["plan"], header["rig"], paths[0])
    return RawScan(
        plan,
        rig,
        np.array(json.loads(header["wavelength"])),
        np.array(json.loads(header["nonlinearity"])),
        int(header["full_scale"]),
        header["is_discrete"] == "1",
        rows,
        log_path(folder).read_text(encoding="utf-8"),
        {
            "software": header["software"],
            "command": "measure",
            "plan_sha256": header["plan_fingerprint"],
            "rig_sha256": header["rig_fingerprint"],
            "instruments": header["instruments"],
            "begun": header["begun"],
            "segments": str(len(paths)),
        },
    )
