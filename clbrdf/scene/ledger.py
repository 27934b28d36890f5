"""What each effect of a scene costs, and how far it moves the result.

Effects are added one after the other in the order of the light's path. An effect's seconds are those that
it adds to the ones before it, and its move is the relative change of the values that it adds: |f with it /
f without − 1|. Integrals over aperture, beam and slit multiply each other's nodes, so their seconds depend
on that order. The parts and the whole are timed in turn, block by block, after everything has been built
once.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from clbrdf.progress import Report, silent
from clbrdf.scene.block import Block
from clbrdf.scene.scenefile import EFFECTS
from clbrdf.scene.simulate import BLOCK_VALUES, Setting, blocks, raw_blocks, set_up
from clbrdf.scene.steps import BACK, COUNTS, STEPS, steps
from clbrdf.scene.surface import Surface

BEFORE_VALUES = tuple(name for name in EFFECTS if name not in STEPS)
"""Effects that change which directions and wavelengths the surface is asked for."""

FEWEST_BLOCKS = 12
"""Parts and whole take turns this often, or more; one more before the clock starts builds the kernels."""


@dataclass
class Entry:
    """One line of the ledger.

    Attributes
    ----------
    name : str
    seconds : float
        What it added.
    largest : float
        Largest relative change, over all values.
    """

    name: str
    seconds: float = 0.0
    largest: float = 0.0
    _squares: float = 0.0
    _count: int = 0

    @property
    def rms(self) -> float:
        """Root mean square of the relative changes; 0 where nothing was compared."""
        return float(np.sqrt(self._squares / max(1, self._count)))

    def compare(self, before: npt.NDArray[np.floating], after: npt.NDArray[np.floating]) -> None:
        """Count how far some values have moved; values that were 0 or not finite are left aside."""
        good = np.isfinite(before) & np.isfinite(after) & (before != 0.0)
        change = np.abs(after[good].astype(np.float64) / before[good] - 1.0)
        self.largest = max(self.largest, float(change.max(initial=0.0)))
        self._squares += float(np.square(change).sum())
        self._count += change.size


@dataclass(frozen=True)
class Ledger:
    """The account of one scene.

    Attributes
    ----------
    surface : float
        Seconds of the surface alone, without any effect.
    effects : dict of str to Entry
        In the order of the light's path.
    counts : float
        Seconds of the way from BRDF to counts and back, 0 where no effect needs counts.
    whole : float
        Seconds of the scene with all its effects, measured beside the parts.
    values : int
        How many values were compared.
    """

    surface: float
    effects: dict[str, Entry]
    counts: float
    whole: float
    values: int

    @property
    def parts(self) -> float:
        """Sum of the parts, s."""
        return self.surface + self.counts + sum(entry.seconds for entry in self.effects.values())


@dataclass
class _Timed:
    """Blocks, and the seconds that it takes to make them."""

    source: Iterator[Block]
    surface: Surface
    seconds: float = 0.0

    def next(self) -> Block | None:
        start = time.perf_counter()
        block = next(self.source, None)
        self.surface.finish()  # what is computed ahead is this run's, too
        self.seconds += time.perf_counter() - start
        return block


@dataclass
class _Account:
    ledger: dict[str, Entry] = field(default_factory=dict)
    counts: float = 0.0
    values: int = 0


def keep_ledger(setting: Setting, report: Report = silent, block_values: int = BLOCK_VALUES) -> Ledger:
    """Run a scene with more and more of its effects, and account for each; nothing is written.

    Raises
    ------
    InputError, DeviceError
        As `set_up`.
    """
    rows = min(block_values // len(setting.scene.wavelength), -(-len(setting.places) // FEWEST_BLOCKS))
    rows = max(1, rows)
    first = set_up(setting.scene, setting.surface, places=setting.places[:rows])
    block_values = rows * len(setting.scene.wavelength)
    _keep(first, silent, block_values)
    return _keep(setting, report, block_values)


def _keep(setting: Setting, report: Report, block_values: int) -> Ledger:
    scene = setting.scene
    early = [name for name in BEFORE_VALUES if getattr(scene.effects, name) is not None]
    account = _Account({name: Entry(name) for name in scene.effects.on()})
    runs = []
    for count in range(len(early) + 1):
        absent = tuple(name for name in EFFECTS if name not in early[:count])
        start = time.perf_counter()
        part = scene.model_copy(update={"effects": scene.effects.without(absent)})
        run = raw_blocks(set_up(part, setting.surface, places=setting.places), block_values)
        runs.append(_Timed(run, setting.surface, time.perf_counter() - start))
    start = time.perf_counter()
    again = set_up(scene, setting.surface, places=setting.places)
    whole = _Timed(blocks(again, block_values), setting.surface, time.perf_counter() - start)
    done = 0
    while (block := _next_block(runs, early, account)) is not None:
        for name, step in steps(scene):
            start = time.perf_counter()
            after = step(scene, block)
            spent = time.perf_counter() - start
            if name in (COUNTS, BACK):
                account.counts += spent
            else:
                account.ledger[name].seconds += spent
                account.ledger[name].compare(block.values, after.values)
            block = after
        whole.next()
        done += len(block.places)
        account.values += block.values.size
        report(done, len(setting.places))
    for name, before, with_it in zip(early, runs[:-1], runs[1:], strict=True):
        account.ledger[name].seconds = max(0.0, with_it.seconds - before.seconds)  # below the noise of times
    return Ledger(runs[0].seconds, account.ledger, account.counts, whole.seconds, account.values)


def _next_block(runs: list[_Timed], early: list[str], account: _Account) -> Block | None:
    """Take the next block of each run, the ones with more effects later; return the last."""
    before = runs[0].next()
    for name, run in zip(early, runs[1:], strict=True):
        block = run.next()
        if before is not None and block is not None:
            account.ledger[name].compare(before.values, block.values)
        before = block
    return before
