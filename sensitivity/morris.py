"""Morris' elementary effects: a cheap ranking, from trajectories that move one parameter at a time."""

import dataclasses
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sensitivity._bootstrap import bootstrap_weights, require_interval, weighted, with_interval
from sensitivity._tables import long_table, number_of, shown_html, shown_text
from sensitivity._unit_cube import from_unit, require_bounds, require_seed
from sensitivity.evaluation import evaluate, named_columns, require_finite
from twin._checks import InputError
from twin.io.npz_file import NpzFile
from twin.parameters import ParameterSpace

if TYPE_CHECKING:
    import pandas as pd

_MEASURES = ("mu", "mu_conf", "mu_star", "mu_star_conf", "sigma", "sigma_conf")
_FILE = NpzFile(
    kind="Morris study",
    writer="ElementaryEffects.save",
    version=1,
    arrays=_MEASURES,
    plain=("outputs", "trajectories", "levels", "seed", "confidence"),
)


@dataclasses.dataclass(frozen=True, repr=False)
class ElementaryEffects:
    """Statistics of the elementary effects, each the change of an output for a parameter moved over its whole range, as
    far as the step of the design tells. Shows itself as a table in a notebook."""

    space: ParameterSpace
    """The parameters, with their bounds."""
    outputs: tuple[str, ...]
    """Names of the outputs."""
    mu: np.ndarray
    """Mean μ of the effects [the output's unit] (outputs, parameters)."""
    mu_conf: np.ndarray
    """Half widths of its confidence intervals."""
    mu_star: np.ndarray
    """Mean μ* of the effects' magnitudes [the output's unit] (outputs, parameters): it ranks."""
    mu_star_conf: np.ndarray
    """Half widths of its confidence intervals."""
    sigma: np.ndarray
    """Standard deviation σ of the effects [the output's unit] (outputs, parameters): non-linear or interacting."""
    sigma_conf: np.ndarray
    """Half widths of its confidence intervals."""
    trajectories: int
    """Effects per parameter."""
    levels: int
    """Levels of each parameter's grid."""
    seed: int
    """Seed of samples and intervals."""
    confidence: float
    """Probability that the intervals are made for."""

    @property
    def names(self) -> tuple[str, ...]:
        """Paths of the parameters."""
        return self.space.paths

    def index(self, output: str | int) -> int:
        """Number of an output.

        Args:
            output: its name, or its number.

        Raises:
            InputError: no such output.
        """
        return number_of(output, self.outputs)

    def to_dataframe(self) -> "pd.DataFrame":
        """Measures and half widths, one row per output and parameter."""
        return long_table(self.outputs, self.names, {name: getattr(self, name) for name in _MEASURES})

    def save(self, path: str | Path) -> None:
        """Write the study to a file, without pickle.

        Args:
            path: file; the ending .npz is added if missing.
        """
        _FILE.write(path, self)

    @classmethod
    def load(cls, path: str | Path) -> "ElementaryEffects":
        """Read what `save` wrote.

        Args:
            path: file; the ending .npz may be left out.

        Raises:
            InputError: file missing, damaged, of another kind or of another version.
        """
        found = _FILE.read(path)
        found["outputs"] = tuple(found["outputs"])
        return cls(**found)

    def _repr_html_(self) -> str:
        return shown_html(self.to_dataframe(), "Elementary effects", self._facts())

    def __repr__(self) -> str:
        return shown_text(self.to_dataframe(), "Elementary effects", self._facts())

    def _facts(self) -> str:
        return f"{self.trajectories} trajectories on {self.levels} levels, seed {self.seed}"


def morris(
    fn: Callable[..., Any],
    space: ParameterSpace,
    *,
    seed: int,
    model: Any = None,
    trajectories: int = 32,
    levels: int = 4,
    outputs: Sequence[str] | None = None,
    chunk: int = 256,
    confidence: float = 0.95,
    resamples: int = 100,
    store: str | Path | None = None,
    executor: Executor | None = None,
    progress: bool = True,
) -> ElementaryEffects:
    """Elementary effects on every output of a function, at SALib's trajectories.

    Args:
        fn: JAX function, as in `sobol`.
        space: parameters with finite bounds; each moves on its own scale.
        seed: seed of samples and intervals, from 1.
        model: as in `sobol`.
        trajectories: effects per parameter; `fn` is evaluated trajectories·(parameters + 1) times.
        levels: levels of each parameter's grid, even.
        outputs: names of the outputs, in order.
        chunk: samples evaluated at once.
        confidence: probability that the intervals are made for.
        resamples: bootstrap samples, of whole trajectories, that the intervals come from.
        store: folder that keeps what was evaluated, so that a study that was killed goes on.
        executor: where it is evaluated, see `twin.batch.batched`; None for this process.
        progress: show a bar.

    Returns:
        Means and standard deviations of the effects.

    Raises:
        InputError: bounds missing, an output that is not finite at some sample, and so on.

    References:
        M. D. Morris, Technometrics 33 (1991) 161-174.
        F. Campolongo, J. Cariboni and A. Saltelli, Environmental Modelling & Software 22 (2007) 1509-1518 (μ*).
    """
    require_bounds(space)
    require_seed(seed)
    require_interval(confidence, resamples)
    if trajectories < 2:
        raise InputError(f"trajectories must be at least 2, but is {trajectories}. 10 to 50 are usual.")
    if levels < 2 or levels % 2:
        raise InputError(f"levels must be an even number of at least 2, but is {levels}. 4 is usual.")
    from SALib.sample import morris as salib

    problem = {"num_vars": len(space), "names": list(space.paths), "bounds": [[0.0, 1.0]] * len(space)}
    unit = salib.sample(problem, trajectories, num_levels=levels, seed=seed)
    values = from_unit(space, unit)
    found = evaluate(
        fn, space, values, model=model, chunk=chunk, seed=seed, store=store, executor=executor, progress=progress
    )
    matrix, names = named_columns(found, outputs, len(values))
    require_finite(matrix, names, space, values)
    effects = _effects(unit.reshape(trajectories, -1, len(space)), matrix.reshape(trajectories, -1, len(names)))
    weights = bootstrap_weights(trajectories, resamples, seed)
    mu = weighted(weights, effects)
    spread = np.maximum(weighted(weights, effects**2) - mu**2, 0.0) * trajectories / (trajectories - 1)
    measures = (mu, weighted(weights, np.abs(effects)), np.sqrt(spread))
    pairs = [array for measure in measures for array in with_interval(measure, confidence)]
    return ElementaryEffects(
        space, names, *pairs, trajectories=trajectories, levels=levels, seed=int(seed), confidence=confidence
    )


def _effects(unit: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Effects (trajectories, parameters, outputs) of trajectories of points (trajectories, parameters + 1, ...)."""
    steps = np.diff(unit, axis=1)
    moved = np.argmax(np.abs(steps), axis=2)
    size = np.take_along_axis(steps, moved[..., None], axis=2)
    slopes = np.diff(values, axis=1) / size
    return np.take_along_axis(slopes, np.argsort(moved, axis=1)[..., None], axis=1)
