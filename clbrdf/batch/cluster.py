"""The workers of a batch: Dask's local cluster, or those of a scheduler that is named."""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from typing import TYPE_CHECKING, Any

from clbrdf.batch.tasks import Able, able
from clbrdf.errors import ClbrdfError, InputError
from clbrdf.parallel.ending import scratch_folder, signals_later, undone_at_end
from clbrdf.parallel.executor import usable_cores
from clbrdf.parallel.processes import start_tracker
from clbrdf.parallel.threads import ONE_THREAD

if TYPE_CHECKING:
    from distributed import Client

ANSWER_TIME = 15.0
"""Seconds in which a scheduler has to answer, and to have a worker."""


def load_dask() -> None:
    """Load Dask.

    Raises
    ------
    InputError
        It, or what writes the index, is not installed.
    """
    try:
        import distributed
        import pyarrow.parquet
    except ImportError as error:
        raise InputError(
            f"a batch needs Dask and Arrow, and {error.name} is not installed: pip install 'clbrdf[cluster]'"
        ) from error
    del distributed, pyarrow
    # What Dask tells of workers that come and go is told by the batch in its own words.
    for name in ("asyncio", "bokeh", *list(logging.root.manager.loggerDict)):  # some have levels of their own
        if name.partition(".")[0] in ("distributed", "tornado", "asyncio", "bokeh"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)


@contextmanager
def local_cluster(workers: int | None) -> Iterator[Client]:
    """Give a client of a cluster of processes on this machine, each with one thread; all end with the block.

    Without `workers` as many as the cores that this process may use.
    """
    import dask
    from distributed import Client, LocalCluster

    settings = {
        # Without Dask's MALLOC_TRIM_THRESHOLD_: memory that goes back to the system after every array costs
        # a search twice its time.
        "distributed.nanny.pre-spawn-environ": dict(ONE_THREAD),
        "distributed.worker.profile.enabled": False,
        "distributed.admin.log-format": "%(message)s",
    }
    made: list[LocalCluster] = []

    def end() -> None:
        for each in made:
            for nanny in list(each.workers.values()):
                with suppress(Exception):  # else it starts a worker anew that this process does not outlive
                    nanny.close_gracefully()
        _kill_children()

    with ExitStack() as stack:
        folder = stack.enter_context(scratch_folder("clbrdf-dask-"))
        stack.enter_context(undone_at_end(end))
        stack.enter_context(dask.config.set(settings))
        start_tracker()
        # What starts in here does not hear Ctrl-C; its own threads start the workers, later ones, too.
        with signals_later():
            cluster = LocalCluster(
                n_workers=workers or usable_cores(),
                threads_per_worker=1,
                processes=True,
                dashboard_address="127.0.0.1:0",
                local_directory=str(folder),
                silence_logs=logging.CRITICAL + 1,
                host="127.0.0.1",
            )
            made.append(cluster)
            client = Client(cluster)
        try:
            yield client
        except BaseException:
            end()
            raise
        finally:
            with suppress(Exception):
                client.close(timeout=5)
            with suppress(Exception):
                cluster.close(timeout=10)


@contextmanager
def remote_cluster(address: str) -> Iterator[Client]:
    """Give a client of a scheduler.

    Raises
    ------
    InputError
        Nobody answers at the address, or the scheduler has no workers.
    """
    from distributed import Client

    # Asked here first: a client that cannot connect tells so once more, in a traceback, when it is collected.
    if not _listens(address):
        raise InputError(_NO_SCHEDULER.format(address))
    try:
        client = Client(address, timeout=ANSWER_TIME, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(_NO_SCHEDULER.format(address)) from error
    try:
        try:
            client.wait_for_workers(1, timeout=ANSWER_TIME)
        except TimeoutError as error:
            raise InputError(
                f"--scheduler {address}: has no workers; start some with 'dask worker {address} --nthreads 1'"
            ) from error
        yield client
    finally:
        with suppress(Exception):
            client.close(timeout=5)


_NO_SCHEDULER = (
    "--scheduler {}: no Dask scheduler answers there; start one with 'dask scheduler',"
    " or leave the option out"
)


def _listens(address: str) -> bool:
    """Whether something takes connections at the address of a scheduler."""
    from distributed.comm import get_address_host_port

    try:
        host, port = get_address_host_port(address)
        with socket.create_connection((host, port), timeout=ANSWER_TIME):
            return True
    except (OSError, ValueError, UnicodeError):
        return False


def look_at_workers(client: Client, version: str) -> tuple[dict[str, Able], dict[str, str]]:
    """Return the workers that can take part, by address, and why others cannot.

    Raises
    ------
    ClbrdfError
        None can.
    """
    answers: Mapping[str, Any] = client.run(able, on_error="return")
    good: dict[str, Able] = {}
    bad: dict[str, str] = {}
    for address, answer in answers.items():
        if isinstance(answer, ModuleNotFoundError):
            bad[address] = f"does not have this version of clbrdf ({answer}); install clbrdf {version} there"
        elif isinstance(answer, BaseException):
            bad[address] = f"fails: {type(answer).__name__}: {answer}"
        elif answer.version != version:
            bad[address] = f"runs clbrdf {answer.version}, not {version}"
        elif answer.failure:
            bad[address] = answer.failure
        else:
            good[address] = answer
    if not good:
        address, reason = next(iter(bad.items()))
        raise ClbrdfError(f"none of the {len(bad)} workers can take part; {address}: {reason}")
    return good, bad


def _kill_children() -> None:
    """End all processes below this one, and wait until they have gone.

    All but the one that removes semaphores (`start_tracker`), which ends when nobody needs it any more.
    """
    import psutil

    for _ in range(3):  # a nanny's thread may start a worker in the meantime
        every = psutil.Process(os.getpid()).children(recursive=True)
        children = [child for child in every if not _is_tracker(child)]
        for child in children:
            with suppress(psutil.Error):
                child.kill()
        psutil.wait_procs(children, timeout=5)


def _is_tracker(process: Any) -> bool:
    import psutil

    try:
        return "multiprocessing.resource_tracker" in " ".join(process.cmdline())
    except psutil.Error:
        return False
