"""`clbrdf measure`: run a plan on the rig."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from clbrdf.cli.console import print_table, progress_bar
from clbrdf.cli.live_view import live_view
from clbrdf.cli.options import Overwrite
from clbrdf.errors import InputError
from clbrdf.parallel.ending import exit_status
from clbrdf.progress import Report, silent
from clbrdf.rig.adaptive.candidates import CandidatePoints, make_candidates
from clbrdf.rig.budget import load_budget
from clbrdf.rig.errors import StoppedError
from clbrdf.rig.eventlog import Event
from clbrdf.rig.interrupt import StopRequest
from clbrdf.rig.live import Snapshot
from clbrdf.rig.measure import MeasurementOutcome, measure
from clbrdf.rig.planfile import Plan, load_plan
from clbrdf.rig.rigfile import Rig, load_rig
from clbrdf.rig.route import Route, plan_route
from clbrdf.rig.store import run_folder
from clbrdf.rig.terminal import make_ask

DOUBTFUL = 1
MANY = 0.1
"""Share of flagged values from which a scan is called doubtful."""

SHOWN = (
    "target out of reach",
    "recovery",
    "point skipped",
    "lamp out of band",
    "lamp back",
    "replugged",
    "check point",
    "left out",
    "not settled",
    "light below dark",
    "rungs disagree",
    "direct beam changed",
)
"""Events that are worth a line while it runs; the log has all."""


def command(
    plan: Path,
    *,
    rig: Path,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    resume: Annotated[bool, Parameter(negative="")] = False,
    dry_run: Annotated[bool, Parameter(negative="")] = False,
    live: Annotated[bool, Parameter(negative="")] = False,
    budget: Path | None = None,
    overwrite: Overwrite = False,
) -> int:
    """Run a measurement plan and write the absolute scan, raw counts included.

    While it runs, rows are safe in the folder OUTPUT.run. Ctrl-C once finishes the exchange and stops;
    twice stops at once, with lamp shutter and stages made safe. --resume goes on after any stop. Ctrl-Z
    pauses after the point; 'fg' goes on, with a check point first.

    Parameters
    ----------
    plan
        plan file (TOML): directions, order, integration time
    rig
        rig file (TOML): instruments, geometry, limits
    output
        scan file to write
    resume
        go on with an interrupted measurement
    dry_run
        only print points, reachable share and estimated time
    live
        show each point as it comes: its spectrum, its value, and the time left
    budget
        budget file (TOML) for the uncertainties; the paper's budget if not given
    """
    if dry_run:
        _print_route(plan, load_plan(plan), load_rig(rig))
        return 0
    if output is None:
        raise InputError("no output file; add -o scan.h5, or --dry-run to see the plan")
    with _watching(live) as (report, snapshot), StopRequest(_tell_stop, _tell_pause) as stop:
        try:
            outcome = measure(
                plan,
                rig,
                output,
                resume=resume,
                overwrite=overwrite,
                budget=load_budget(budget),
                report=report,
                show=_show,
                check=stop.check,
                ask=make_ask(stop.check),
                pause=stop.pause,
                live=snapshot,
            )
        except StoppedError:
            folder = run_folder(output)
            where = (
                f"rows are safe in {folder}; go on with --resume"
                if folder.exists()
                else "nothing was measured"
            )
            print(f"clbrdf: stopped; {where}", file=sys.stderr)
            return exit_status(stop.number)
        except KeyboardInterrupt:
            print(
                "clbrdf: stopped at once, stages and shutter made safe; go on with --resume", file=sys.stderr
            )
            return exit_status(stop.number)
    _print_outcome(output, outcome)
    return _verdict(outcome)


def _print_outcome(output: Path, outcome: MeasurementOutcome) -> None:
    rows = [
        ["points", f"{outcome.points}"],
        ["left out, out of reach", f"{outcome.left_out}"],
        ["skipped at limit switches", f"{outcome.skipped}"],
        ["values", f"{outcome.values}"],
        *([f"  flagged {name}", f"{count}"] for name, count in outcome.flagged.items()),
        ["  of them no measurement", f"{outcome.masked}"],
        ["lines in the log", f"{outcome.events}"],
    ]
    print_table(f"{output}: measured", ("quantity", "value"), rows)
    if outcome.end:
        print(f"the plan ended: {outcome.end}")


def _verdict(outcome: MeasurementOutcome) -> int:
    """Say loudly what makes a scan doubtful; 1 where something does."""
    complaints = [f"the direct beam was {text}" for text in outcome.changes]
    if outcome.doubt:
        complaints.append(f"the plan ended in doubt: {outcome.doubt}")
    worst = max(outcome.flagged.values(), default=0)
    if worst > MANY * outcome.values:
        names = ", ".join(f"{name} {count / outcome.values:.0%}" for name, count in outcome.flagged.items())
        complaints.append(
            f"many of the {outcome.values} values are flagged ({names}): look at them before use"
        )
    for text in complaints:
        print(f"clbrdf: {text}", file=sys.stderr)
    return DOUBTFUL if complaints else 0


def _tell_stop() -> None:
    # Only async-signal-safe work here: a print could meet a print.
    os.write(2, b"\nstopping after this exchange; once more to stop at once\n")


def _tell_pause() -> None:
    os.write(2, b"\npausing after this point; 'fg' goes on\n")


@contextmanager
def _watching(live: bool) -> Iterator[tuple[Report, Callable[[Snapshot], None] | None]]:
    """Give what shows progress: a bar, or the running measurement itself."""
    if live:
        with live_view() as show:
            yield silent, show
    else:
        with progress_bar("measuring") as report:
            yield report, None


def _show(event: Event) -> None:
    if event.kind in SHOWN and sys.stderr.isatty():
        print(f"{event.where}: {event.kind}: {event.text}", file=sys.stderr)


def _print_route(path: Path, plan: Plan, rig: Rig) -> None:
    try:
        if plan.adaptive is not None:
            _print_candidates(path, plan, make_candidates(plan, rig))
            return
        route = plan_route(plan, rig)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    reached = len(route) / route.planned
    rows = [
        ["points in the plan", f"{route.planned}"],
        *([f"  left out: {reason}", f"{count}"] for reason, count in route.unreachable.items()),
        ["points to measure", f"{len(route)}"],
        ["reachable share", f"{reached:.1%}"],
        ["repeats of each direction", f"{plan.repeats}"],
        ["wavelengths", _wavelengths(plan)],
        ["estimated time", _duration(route)],
    ]
    print_table(f"{path}: dry run, nothing moves", ("quantity", "value"), rows)


def _print_candidates(path: Path, plan: Plan, candidates: CandidatePoints) -> None:
    settings = plan.adaptive
    assert settings is not None
    target = (
        f"{settings.what()} {settings.target:.2%}" if settings.target is not None else "as much as possible"
    )
    limits = f"{settings.points} points"
    if settings.time is not None:
        limits += f", {settings.time:g} s of the rig"
    rows = [
        ["directions in the plan", f"{candidates.planned}"],
        *([f"  left out: {reason}", f"{count}"] for reason, count in candidates.unreachable.items()),
        ["directions to choose from", f"{len(candidates)}"],
        ["model", settings.model],
        ["target", target],
        ["at most", limits],
        ["start, then batches of", f"{settings.start}, {settings.batch}"],
        ["  of each kept for validation", f"{settings.validation}"],
        ["wavelengths", _wavelengths(plan)],
        ["  of them fitted while measuring", f"at most {settings.wavelengths}"],
    ]
    print_table(f"{path}: dry run of an adaptive plan, nothing moves", ("quantity", "value"), rows)


def _wavelengths(plan: Plan) -> str:
    grid = plan.wavelength
    return f"{grid.start:g} to {grid.stop:g} nm, every {grid.step:g} nm"


def _duration(route: Route) -> str:
    minutes, seconds = divmod(round(route.seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min {seconds:02d} s"
