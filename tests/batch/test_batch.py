"""The batch: the bytes of single fits, what is kept when something is lost, and mistakes."""

from __future__ import annotations

import json
import os
import shutil
import signal
import threading
import time
import warnings
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest

from clbrdf import Fit, Scan
from clbrdf.batch import tasks
from clbrdf.batch.cluster import look_at_workers
from clbrdf.batch.folder import open_catalogue
from clbrdf.batch.request import Request
from clbrdf.batch.run import run_batch
from clbrdf.batch.tasks import Source
from clbrdf.cli import main
from clbrdf.errors import ClbrdfError

pytestmark = pytest.mark.filterwarnings("ignore:.*:ResourceWarning")


@pytest.fixture
def run(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")

    def run(*words):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            status = main([str(word) for word in words])
        out, err = capsys.readouterr()
        return status, out, "".join(line for line in err.splitlines(True) if "dashboard" not in line)

    return run


def request(**changes):
    plain = {"model": "wang2013", "method": "auto", "weights": "none", "seed": 0, "bounds": {}, "fix": {}}
    plain |= {"shared": (), "smooth": None, "rtol": None, "force": False}
    return Request(**{**plain, **changes})


def files_of(folder):
    return sorted(path.name for path in folder.iterdir() if not path.name.startswith("."))


@pytest.mark.parametrize(
    "options",
    [
        ("--weights", "sigma", "--seed", "5"),
        (
            "--model",
            "ggx+lambert",
            "--fix",
            "ggx.F90=1",
            "--bounds",
            "ggx.alpha=0.05:0.9",
            "--smooth",
            "0.01",
        ),
        ("--model", "ggx+lambert", "--shared", "ggx.alpha"),
        ("--model", "ggx+lambert", "--fix", "ggx.F90=1", "--profile", "--monte-carlo", "100"),
    ],
)
def test_files_are_those_of_single_fits_byte_for_byte(run, scans, address, tmp_path, options):
    folder = tmp_path / "catalogue"
    status, out, err = run("batch", *scans[:2], "-o", folder, "--scheduler", address, *options)
    assert (status, err) == (0, "")
    assert "scans fitted" in out
    for scan in scans[:2]:
        assert run("fit", scan, "-o", tmp_path / scan.name, *options)[0] == 0
        assert (folder / scan.name).read_bytes() == (tmp_path / scan.name).read_bytes()


@pytest.fixture(scope="module")
def telling(scans, tmp_path_factory):
    """A scan that tells of its receiver's solid angle, that of a cone of 4 degrees."""
    scan = Scan.open(scans[0])
    scan = scan.rows(scan.theta_r < 80.0)
    path = tmp_path_factory.mktemp("telling") / "telling.h5"
    replace(scan, solid_angle=np.full(len(scan), np.pi * np.sin(np.deg2rad(2.0)) ** 2)).save(path)
    return path


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "the scan file"),
        (("--through", "{file}"), "instrument.toml"),
        (("--through", "{slit}", "--smooth", "0.01"), "slit.toml"),
        (("--point",), None),
        (
            ("--choose", "--models", "lambert,ggx+lambert", "--wavelengths", "1", "--through", "{file}"),
            "instrument.toml",
        ),
    ],
)
def test_fits_through_the_instrument_are_single_fits_byte_for_byte(
    run, telling, address, tmp_path, options, said
):
    (tmp_path / "instrument.toml").write_text("[aperture]\nangle = 3.0\n[footprint]\nbeam = 4\nfield = 12\n")
    (tmp_path / "slit.toml").write_text("[aperture]\nangle = 3.0\n[bandwidth]\nwidth = 100.0\n")
    names = {"file": tmp_path / "instrument.toml", "slit": tmp_path / "slit.toml"}
    options = [word.format(**names) for word in options]
    folder = tmp_path / "catalogue"
    model = () if "--choose" in options else ("--model", "ggx+lambert")
    status, _, err = run("batch", telling, "-o", folder, "--scheduler", address, *model, *options)
    assert (status, err) == (0, "")
    single = [word for word in options if word != "--choose"]
    command = "choose" if "--choose" in options else "fit"
    assert run(command, telling, "-o", tmp_path / "one.h5", *model, *single)[0] == 0
    assert (folder / "telling.h5").read_bytes() == (tmp_path / "one.h5").read_bytes()
    behind = Fit.open(folder / "telling.h5").through
    assert (None if behind is None else behind.source) == said


def test_an_instrument_file_that_changes_makes_another_batch(run, telling, address, tmp_path):
    path, folder = tmp_path / "instrument.toml", tmp_path / "catalogue"
    words = ("batch", telling, "-o", folder, "--scheduler", address, "--resume", "--through", path)
    path.write_text("[aperture]\nangle = 3.0\n")
    assert run(*words, "--model", "lambert")[0] == 0
    status, out, _ = run(*words, "--model", "lambert")
    assert status == 0
    assert "scans done before" in out
    path.write_text("[aperture]\nangle = 3.5\n")
    status, _, err = run(*words, "--model", "lambert")
    assert (status, err.count("\n")) == (2, 1)
    assert "holds another batch, with through 'instrument.toml of SHA-256" in err
    status, _, err = run(*words[:-2], "--model", "lambert", "--point")
    assert (status, err.count("\n")) == (2, 1)
    assert "another batch, with through" in err


def test_choices_are_those_of_single_choices(run, scans, address, tmp_path):
    options = ("--models", "lambert,ggx+lambert", "--wavelengths", "2")
    folder = tmp_path / "catalogue"
    words = ("batch", scans[0], "-o", folder, "--scheduler", address, "--choose", *options)
    assert run(*words)[0] == 0
    assert run("choose", scans[0], "-o", tmp_path / "one.h5", *options)[0] == 0
    assert (folder / scans[0].name).read_bytes() == (tmp_path / "one.h5").read_bytes()


def test_the_index_holds_a_row_for_every_scan_and_wavelength(run, scans, address, tmp_path):
    folder = tmp_path / "catalogue"
    assert run("batch", *scans, "-o", folder, "--scheduler", address)[0] == 0
    table = pq.read_table(folder / "index.parquet")
    assert len(table) == 24
    rows = table.to_pylist()
    assert [row["scan"] for row in rows[::6]] == ["foil0", "foil1", "foil2", "foil3"]
    fit = Fit.open(folder / "foil2.h5")
    for k, row in enumerate(rows[12:18]):
        assert row["ks"] == fit.parameters["ks"][k]
        np.testing.assert_equal(row["d_sigma"], fit.sigma["d"][k])
        assert (row["status"], row["E"]) == (fit.status[k], fit.objective[k])
        assert row["wavelength_nm"] == fit.wavelength[k]
        assert 0.0 < row["milliseconds"] < 1e5
        assert row["scan_sha256"] == fit.provenance["input_0_sha256"]
    for name, read in (("pandas", "read_parquet"), ("polars", "read_parquet")):
        try:
            module = __import__(name)
        except ImportError:
            continue
        assert getattr(module, read)(folder / "index.parquet").shape[0] == 24


def test_resume_does_what_is_left_or_has_changed(run, scans, address, tmp_path):
    folder, own = tmp_path / "catalogue", [shutil.copy(scan, tmp_path / scan.name) for scan in scans[:3]]
    words = ("batch", *own, "-o", folder, "--scheduler", address)
    assert run(*words[:2], *words[4:])[0] == 0
    first = (folder / "foil0.h5").stat().st_mtime_ns
    status, _, err = run(*words)
    assert (status, err) == (
        2,
        f"clbrdf: {folder}: holds this batch already; add --resume to go on, or name another folder\n",
    )
    assert run(*words, "--resume", "--json", tmp_path / "told.json")[0] == 0
    told = json.loads((tmp_path / "told.json").read_text())
    assert (told["fitted"], told["done_before"]) == (2, 1)
    assert (folder / "foil0.h5").stat().st_mtime_ns == first
    shutil.copy(scans[3], own[1])
    (folder / "foil2.h5").write_bytes(b"cut")
    assert run(*words, "--resume", "--json", tmp_path / "told.json")[0] == 0
    told = json.loads((tmp_path / "told.json").read_text())
    assert (told["fitted"], told["done_before"]) == (2, 1)
    assert len(pq.read_table(folder / "index.parquet")) == 18
    assert Fit.open(folder / "foil1.h5").scan.sample == "foil 3"


def test_a_scan_that_fails_costs_a_line(run, scans, address, tmp_path):
    (tmp_path / "text.h5").write_text("no HDF5")
    (tmp_path / "cut.h5").write_bytes(scans[0].read_bytes()[:5000])
    bad = [tmp_path / "text.h5", tmp_path / "cut.h5", tmp_path / "missing.h5"]
    folder = tmp_path / "catalogue"
    status, out, err = run("batch", scans[0], *bad, scans[1], "-o", folder, "--scheduler", address)
    assert status == 1
    assert err.count("\n") == 3
    for path in bad:
        assert f"clbrdf: {path}: " in err
    assert "not an HDF5 file" in err
    assert f"{tmp_path / 'missing.h5'}: no such file" in err
    assert "failed" in out
    assert files_of(folder) == ["batch.json", "foil0.h5", "foil1.h5", "index.parquet", "rows"]


def test_what_workers_do_not_see_is_sent_and_comes_back(client, scans, tmp_path):
    """Names that only this process has stand for disks that only this machine has."""
    reader = os.open(scans[0], os.O_RDONLY)
    (tmp_path / "catalogue").mkdir()
    folder = os.open(tmp_path / "catalogue", os.O_RDONLY)
    try:
        os.dup2(reader, 900)
        os.dup2(folder, 901)
        from pathlib import Path

        with open_catalogue(Path("/proc/self/fd/901"), request(), resume=False) as catalogue:
            outcome = run_batch(client, [Source("/proc/self/fd/900", "foil0")], catalogue, 2)
    finally:
        for number in (reader, folder, 900, 901):
            os.close(number)
    assert (outcome.failed, outcome.sent) == ({}, scans[0].stat().st_size)
    fit = Fit.open(tmp_path / "catalogue" / "foil0.h5")
    assert fit.scan.sample == "foil 0"
    assert not list((tmp_path / "catalogue").glob(".*.part"))


def test_a_lost_worker_costs_a_retry(client, scans, tmp_path):
    """Killed at random while it works; the bytes are those of a batch that nobody disturbed."""
    with open_catalogue(tmp_path / "calm", request(), resume=False) as catalogue:
        run_batch(client, [Source(str(scan), scan.stem) for scan in scans], catalogue, 2)

    def kill():
        time.sleep(0.3)
        pid = next(iter(client.run(os.getpid).values()))
        killed.append(pid)
        os.kill(pid, signal.SIGKILL)

    killed = []
    thread = threading.Thread(target=kill)
    with open_catalogue(tmp_path / "disturbed", request(), resume=False) as catalogue:
        thread.start()
        outcome = run_batch(client, [Source(str(scan), scan.stem) for scan in scans], catalogue, 2)
        thread.join()
    assert killed
    assert (outcome.fitted, outcome.failed) == (4, {})
    for scan in scans:
        assert (tmp_path / "disturbed" / scan.name).read_bytes() == (
            tmp_path / "calm" / scan.name
        ).read_bytes()
    client.wait_for_workers(2, timeout=60)


def test_workers_that_cannot_take_part(client, scans, tmp_path, monkeypatch):
    with pytest.raises(
        ClbrdfError, match=r"none of the 2 workers can take part; tcp://.*: runs clbrdf .*, not 99"
    ):
        look_at_workers(client, "99")
    told = []
    later = request(version="99")
    monkeypatch.setattr("clbrdf.batch.run.ANSWER_TIME", 0.5)
    with (
        open_catalogue(tmp_path / "catalogue", later, resume=False) as catalogue,
        pytest.raises(ClbrdfError, match=r"no worker is left that can take part; tcp://.*: runs clbrdf"),
    ):
        run_batch(client, [Source(str(scans[0]), "foil0")], catalogue, 2, tell=told.append)
    assert len(told) == 2
    assert all("is left out: runs clbrdf" in text for text in told)


def test_a_worker_without_a_device_is_left_out(scans, tmp_path):
    from distributed import Client, Nanny, Scheduler, SpecCluster

    options = {"nthreads": 1, "local_directory": str(tmp_path), "silence_logs": 60}
    blind = {**options, "env": {"OCL_ICD_VENDORS": str(tmp_path / "none")}}
    workers = {"able": {"cls": Nanny, "options": options}, "blind": {"cls": Nanny, "options": blind}}
    scheduler = {"cls": Scheduler, "options": {"dashboard": False, "port": 0}}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with (
            SpecCluster(workers=workers, scheduler=scheduler, silence_logs=60) as cluster,
            Client(cluster) as client,
        ):
            client.wait_for_workers(2, timeout=60)
            good, bad = look_at_workers(client, request().version)
            assert (len(good), len(bad)) == (1, 1)
            assert "no OpenCL platform found" in next(iter(bad.values()))
            told = []
            with open_catalogue(tmp_path / "catalogue", request(), resume=False) as catalogue:
                sources = [Source(str(scan), scan.stem) for scan in scans]
                outcome = run_batch(client, sources, catalogue, 2, tell=told.append)
            assert (outcome.fitted, outcome.failed) == (4, {})
            assert all("is left out: no OpenCL" in text for text in told)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "no scans; name their files"),
        (("{scan}", "{scan}"), "is given twice"),
        (("{scan}", "--scheduler", "tcp://127.0.0.1:9"), "no Dask scheduler answers there"),
        (("{scan}", "--scheduler", "tcp://127.0.0.1:9", "--workers", "2"), "leave it out, or --scheduler"),
        (("{scan}", "--workers", "0"), "--workers 0: give 1 or more"),
        (("{scan}", "--model", "soap"), "soap"),
        (("{scan}", "--method", "guess"), "no method is called 'guess'"),
        (("{scan}", "--weights", "w.csv"), "--weights 'w.csv': a batch takes none, relative, sigma"),
        (("{scan}", "--fix", "n=n.csv"), "a batch takes a number here"),
        (("{scan}", "--choose", "--smooth", "0.1"), "--smooth is of a fit"),
        (("{scan}", "--models", "ggx"), "add --choose"),
        (("{scan}", "--through", "{absent}"), "absent.toml: no such file"),
        (("{scan}", "--through", "{empty}"), "empty.toml: no geometry in it; name an effect"),
        (
            ("{scan}", "--through", "{slit}"),
            "slit.toml: bandwidth ties neighbouring wavelengths; add --smooth",
        ),
        (("{scan}", "--through", "{slit}", "--point"), "--point and --through say two things"),
        (("{scan}", "--through", "{slit}", "--json", "{slit}"), "slit.toml"),
        (("{scan}", "--monte-carlo", "5"), "monte_carlo is 5; give 100 to"),
        (("{scan}", "--profile", "--smooth", "0.1"), "profile asks each wavelength at its optimum"),
        (("{scan}", "--choose", "--profile"), "--profile is of a fit"),
        (("{scan}", "-o", "{full}"), "holds other files"),
        (("{scan}", "-o", "{scan}"), "is a file; name a folder"),
    ],
)
def test_mistakes(run, scans, tmp_path, words, said, monkeypatch):
    monkeypatch.setattr("clbrdf.batch.cluster.ANSWER_TIME", 1.0)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "letter.txt").write_text("mine")
    (tmp_path / "empty.toml").write_text("")
    (tmp_path / "slit.toml").write_text("[bandwidth]\nwidth = 2.4\n")
    names = {name: tmp_path / f"{name}.toml" for name in ("absent", "empty", "slit")}
    names |= {"scan": scans[0], "full": tmp_path / "full"}
    words = [word.format(**names) for word in words]
    output = () if "-o" in words else ("-o", tmp_path / "catalogue")
    status, out, err = run("batch", *words, *output)
    assert (status, out) == (2, "")
    assert err.startswith("clbrdf: ")
    assert err.count("\n") == 1
    assert said in err
    assert not (tmp_path / "catalogue").exists()


def test_another_batch_and_another_process(run, scans, tmp_path):
    folder = tmp_path / "catalogue"
    with open_catalogue(folder, request(), resume=False):
        status, _, err = run("batch", scans[0], "-o", folder, "--resume")
        assert (status, err) == (2, f"clbrdf: {folder}: another batch is at work in it; wait for its end\n")
    status, _, err = run("batch", scans[0], "-o", folder, "--resume", "--seed", "1")
    assert (status, err.count("\n")) == (2, 1)
    assert "holds another batch, with seed 0 and not 1" in err


def test_a_result_that_cannot_be_written_costs_a_line(client, scans, tmp_path):
    told = []
    with open_catalogue(tmp_path / "catalogue", request(), resume=False) as catalogue:
        shutil.rmtree(tmp_path / "catalogue" / "rows")
        sources = [Source(str(scan), scan.stem) for scan in scans[:2]]
        outcome = run_batch(client, sources, catalogue, 2, tell=told.append)
    assert (outcome.fitted, len(outcome.failed)) == (0, 2)
    assert len(told) == 2
    (tmp_path / "catalogue" / "index.parquet").mkdir(exist_ok=True)
    with open_catalogue(tmp_path / "catalogue", request(), resume=True) as catalogue:
        outcome = run_batch(client, sources, catalogue, 2, tell=told.append)
    assert outcome.fitted == 2
    assert list(outcome.failed) == [str(tmp_path / "catalogue" / "index.parquet")]
    assert "is a folder" in told[2]


def test_tasks_tell_what_they_cannot_see(tmp_path):
    with pytest.raises(tasks.UnseenError):
        tasks._scan(Source(str(tmp_path / "none.h5"), "none"), None)
