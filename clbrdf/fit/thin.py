"""A problem on some of its directions, for a search that only has to rank, or to come near."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from clbrdf.fit.problem import Problem
from clbrdf.fit.sample import DirectionSample
from clbrdf.observation import ForwardModel


def thin_sample(problem: Problem, most: int) -> DirectionSample:
    """Return at most so many directions of a problem.

    Half of them are the nearest to the mirror direction, where lobes have their tops; the others are spread
    evenly over the rest, which they stand for with a larger weight.
    """
    n = problem.size[1]
    if n <= most:
        return DirectionSample(np.arange(n), np.ones(n))
    near = np.argsort(problem.mirror, kind="stable")[: most // 2]
    rest = np.setdiff1d(np.arange(n), near)
    spread = rest[np.linspace(0, len(rest) - 1, most - len(near)).round().astype(np.intp)]
    weight = np.ones(n)
    weight[spread] = len(rest) / len(spread)
    kept = np.sort(np.concatenate([near, spread]))
    return DirectionSample(kept, weight[kept])


def thinned(problem: Problem, most: int) -> Problem:
    """Return the problem on at most so many of its directions (`thin_sample`), which then are points."""
    if problem.size[1] <= most:
        return problem
    points = replace(problem, seen=ForwardModel(problem.model, problem.features))
    return on_sample(points, thin_sample(problem, most))


def measured_enough(problem: Problem, few: Problem, least: int) -> npt.NDArray[np.bool_]:
    """Return at which wavelengths (W,) so many of some directions are measured, or as many as of all."""
    in_all, in_few = (np.count_nonzero(p.scale, axis=1) for p in (problem, few))
    return np.asarray(in_few >= np.minimum(in_all, least))


def on_sample(problem: Problem, sample: DirectionSample) -> Problem:
    """Return the problem on some of its directions."""
    kept, root = sample.places, np.sqrt(sample.weight)
    group = np.searchsorted(problem.starts, kept, side="right")
    return replace(
        problem,
        features=problem.features[kept],
        seen=problem.seen.take(kept),
        mirror=problem.mirror[kept],
        order=problem.order[kept],
        target=problem.target[:, kept] * root,
        scale=problem.scale[:, kept] * root,
        starts=np.append(0, np.cumsum(np.unique(group, return_counts=True)[1])).astype(np.uint32),
        sample=None,
    )
