"""Run the examples of the pages, compare what they print, or write it anew: `python docs/examples.py`.

A block ```console``` holds commands after `$ ` and below each what it printed; a line `…` stands for lines
that are left out. Numbers are not compared, words are. Blocks ```python``` of a page run as one program.
Files that a page takes for granted are made (scan.h5) or must be named with `--data FOLDER`.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

DOCS = Path(__file__).parent
BLOCK = re.compile(r"^```(console|python)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LEFT_OUT = "…"
KEPT = 14
"""Lines of an output that a page shows at most, the rest is left out."""

SCENE = """
[surface]
model = "ggx+lambert"
parameters = { "ggx.alpha" = 0.2, "ggx.F0" = 0.05, "ggx.F90" = 1.0, "lambert.rho" = 0.3 }

[directions]
theta_i = [15, 35, 55, 70]
theta_r = { start = 0, stop = 80, step = 4 }
phi_r = [0, 180]

[wavelength]
start = 500
stop = 600
step = 50

[effects]
shot_noise = true
"""


@dataclass(frozen=True)
class Ran:
    """A command of a page: what the page says that it prints, and what it printed."""

    command: str
    told: list[str]
    printed: list[str]
    exit_status: int


def commands(block: str) -> list[tuple[str, list[str]]]:
    """Return the commands of a block, each with the lines below it."""
    found: list[tuple[str, list[str]]] = []
    for line in block.splitlines():
        if line.startswith("$ "):
            found.append((line[2:], []))
        elif line.startswith("> "):
            command, told = found[-1]
            found[-1] = (command + " " + line[2:], told)
        else:
            found[-1][1].append(line)
    return found


def run(command: list[str], folder: Path) -> tuple[list[str], int]:
    """Run one in a folder, 100 columns wide; return what it printed and its exit status."""
    environment = {**os.environ, "COLUMNS": "100", "PYTHONUTF8": "1"}
    done = subprocess.run(
        command,
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return [line.rstrip() for line in done.stdout.splitlines()], done.returncode


def run_page(page: Path, folder: Path) -> list[Ran]:
    """Run everything of a page in a folder, in order."""
    text, ran = page.read_text(encoding="utf-8"), []
    if "scan.h5" in text:
        (folder / "made.toml").write_text(SCENE, encoding="utf-8")
        run([sys.executable, "-m", "clbrdf.cli", "simulate", "made.toml", "-o", "scan.h5"], folder)
    blocks = BLOCK.findall(text)
    for kind, block in blocks:
        for command, told in commands(block) if kind == "console" else []:
            words = command.split()
            if words[0] != "clbrdf":
                continue  # what fetches files is done by whoever runs the page
            printed, status = run([sys.executable, "-m", "clbrdf.cli", *words[1:]], folder)
            ran.append(Ran(command, told, printed, status))
    program = "\n".join(block for kind, block in blocks if kind == "python")
    if program:
        (folder / "program.py").write_text(program, encoding="utf-8")
        printed, status = run([sys.executable, "program.py"], folder)
        ran.append(Ran("the Python of the page", [], printed, status))
    return ran


def words_of(line: str) -> str:
    """Return a line without numbers, lines of tables, and the space between columns."""
    line = re.sub(r"[-+−]?\d[\d.,]*(e[-+]?\d+)?", "#", line)
    return re.sub(r"[\s─]+", " ", line).strip()


def missing(ran: Ran) -> list[str]:
    """Return what a page says that a command prints, but it did not, in this order."""
    printed, place, lost = [words_of(line) for line in ran.printed], 0, []
    for line in ran.told:
        words = words_of(line)
        if not words or words == LEFT_OUT:
            continue
        try:
            place = printed.index(words, place) + 1
        except ValueError:
            lost.append(line)
    return lost


def renewed(ran: Ran) -> list[str]:
    """Return the lines below a command as they are now: those that the page chose, or the first ones."""
    printed = [line for line in ran.printed if line]
    if not ran.told:
        return [*printed[:KEPT], *([LEFT_OUT] if len(printed) > KEPT else [])]
    words, place, lines = [words_of(line) for line in printed], 0, []
    for line in ran.told:
        if line == LEFT_OUT:
            lines.append(line)
        elif (told := words_of(line)) in words[place:]:
            place = words.index(told, place) + 1
            lines.append(printed[place - 1])
    return lines


def write_anew(page: Path, ran: list[Ran]) -> None:
    """Put what was printed into the page, in place of what stood there."""
    outcomes = iter(ran)

    def block(match: re.Match[str]) -> str:
        if match[1] == "python":
            return match[0]
        lines = []
        for command, told in commands(match[2]):
            own = renewed(next(outcomes)) if command.startswith("clbrdf") else told
            lines += [f"$ {command}", *own]
        return "```console\n" + "\n".join(lines) + "\n```"

    page.write_text(BLOCK.sub(block, page.read_text(encoding="utf-8")), encoding="utf-8")


def main() -> int:
    """Run pages; say what differs, or write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pages", nargs="*", type=Path)
    parser.add_argument("--data", type=Path, help="folder with the files that pages fetch")
    parser.add_argument("--write", action="store_true", help="write into the pages what the commands print")
    settings, wrong = parser.parse_args(), 0
    for page in settings.pages or sorted(DOCS.glob("*.md")):
        with tempfile.TemporaryDirectory() as name:
            if settings.data is not None:
                shutil.copytree(settings.data, name, dirs_exist_ok=True)
            ran = run_page(page, Path(name))
        for each in ran:
            lost = [] if settings.write else missing(each)
            if each.exit_status or lost:
                wrong += 1
                print(f"{page.name}: {each.command}", *(lost or each.printed[-5:]), sep="\n    ")
        if settings.write:
            write_anew(page, ran)
    return min(wrong, 1)


if __name__ == "__main__":
    sys.exit(main())
