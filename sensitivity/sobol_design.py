"""The samples of a Sobol study, and how they are built from two base matrices."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sensitivity._unit_cube import from_unit, require_bounds, require_power_of_two, require_seed
from twin._checks import InputError
from twin.io.npz_file import NpzFile
from twin.parameters import ParameterSpace

_FILE = NpzFile(
    kind="Sobol design",
    writer="SobolSamples.save",
    version=1,
    arrays=("values",),
    plain=("n", "seed", "groups", "second_order"),
)


class DistinctSamples(NamedTuple):
    """The samples that a function of some of the parameters has to be evaluated at."""

    values: np.ndarray
    """Samples (distinct, parameters), SI."""
    back: np.ndarray
    """For each sample of the design, the row above with the same values of these parameters (rows,)."""


@dataclasses.dataclass(frozen=True, repr=False)
class SobolSamples:
    """Saltelli's design: for each of n base points the rows A, AB of every parameter, BA of every parameter where
    second-order indices are wanted, and B. AB is A with the parameter (or group) taken from B, BA the other way round.
    """

    space: ParameterSpace
    """The parameters."""
    values: np.ndarray
    """Samples (rows, parameters), SI, in SALib's order: the rows of the first base point, of the second, and so on."""
    n: int
    """Base points, a power of two."""
    seed: int
    """Seed of the scrambling, at least 1."""
    groups: tuple[str, ...]
    """Name of the group of each parameter; its own path where it stands alone (parameters,)."""
    second_order: bool
    """Whether the rows BA are there."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what is ranked: groups, or parameters where they stand alone."""
        return tuple(dict.fromkeys(self.groups))

    @property
    def step(self) -> int:
        """Rows of one base point."""
        return (2 if self.second_order else 1) * len(self.names) + 2

    def __len__(self) -> int:
        return len(self.values)

    def __repr__(self) -> str:
        return f"SobolSamples: {self.n} base points x {self.step} rows = {len(self)} samples of {', '.join(self.names)}"

    def blocks(self, of: Any = None) -> dict[str, np.ndarray]:
        """The design's blocks, without copying.

        Args:
            of: an array with one row per sample, such as the outputs; by default the samples themselves.

        Returns:
            "A" and "B" (n, columns), "AB" and, if there, "BA" (n, names, columns).
        """
        rows = np.asarray(self.values if of is None else of)
        if rows.shape[:1] != (len(self),):
            raise InputError(
                f"An array of the shape {rows.shape} does not have a row for each of the {len(self)} samples."
            )
        return self.split(rows)

    def split(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """As `blocks`, of the first rows of the design.

        Args:
            rows: array (rows, columns) of some whole base points.
        """
        count = len(self.names)
        cube = rows.reshape(-1, self.step, *rows.shape[1:])
        found = {"A": cube[:, 0], "B": cube[:, -1], "AB": cube[:, 1 : 1 + count]}
        return found | ({"BA": cube[:, 1 + count : -1]} if self.second_order else {})

    def distinct(self, paths: Iterable[str]) -> DistinctSamples:
        """The samples that differ in some parameters: where nothing else matters, no other need be evaluated.

        Modes do not depend on dampers, say: solve them at `distinct(stiffnesses).values` and spread the results over
        all samples by `results[back]`.

        Args:
            paths: the parameters that matter.

        Raises:
            InputError: a path that is not in the space.
        """
        matter = set(self.space.subset([paths] if isinstance(paths, str) else paths).paths)
        moved = {group for group, path in zip(self.groups, self.space.paths, strict=True) if path in matter}
        index = np.arange(len(self)).reshape(self.n, self.step)
        same = index.copy()
        count = len(self.names)
        for i, name in enumerate(self.names):
            if name not in moved:
                same[:, 1 + i] = index[:, 0]
                if self.second_order:
                    same[:, 1 + count + i] = index[:, -1]
        kept, back = np.unique(same.ravel(), return_inverse=True)
        return DistinctSamples(self.values[kept], back)

    def save(self, path: str | Path) -> None:
        """Write the design to a file, without pickle: another version of SciPy may draw other points from the seed.

        Args:
            path: file; the ending .npz is added if missing.
        """
        _FILE.write(path, self)

    @classmethod
    def load(cls, path: str | Path) -> "SobolSamples":
        """Read what `save` wrote.

        Args:
            path: file; the ending .npz may be left out.

        Raises:
            InputError: file missing, damaged, of another kind or of another version.
        """
        found = _FILE.read(path)
        found["groups"] = tuple(found["groups"])
        return cls(**found)


def sobol_samples(
    space: ParameterSpace,
    n: int = 1024,
    *,
    seed: int,
    second_order: bool = False,
    groups: Mapping[str, Sequence[str]] | None = None,
) -> SobolSamples:
    """SALib's samples for Sobol indices, from a scrambled Sobol sequence of two dimensions per parameter.

    Each parameter is uniform between its bounds on its own scale: in the value, or in its logarithm.

    Args:
        space: parameters with finite bounds.
        n: base points, a power of two (at least 8); there are n·(names + 2) samples, or n·(2·names + 2).
        seed: seed of the scrambling, from 1 (SALib takes 0 for "no seed" in places).
        second_order: sample what second-order indices need.
        groups: paths by group name; the parameters of a group are changed together and have one index. Those in no
            group stand alone.

    Raises:
        InputError: naming what is wrong.

    References:
        A. Saltelli, Computer Physics Communications 145 (2002) 280-297.
    """
    require_bounds(space)
    require_seed(seed)
    require_power_of_two(n)
    membership = _membership(space, groups)
    from SALib.sample import sobol as salib

    problem = {"num_vars": len(space), "names": list(space.paths), "bounds": [[0.0, 1.0]] * len(space)}
    if groups:
        problem["groups"] = list(membership)
    unit = salib.sample(problem, n, calc_second_order=second_order, seed=seed)
    return SobolSamples(space, from_unit(space, unit), int(n), int(seed), membership, second_order)


def _membership(space: ParameterSpace, groups: Mapping[str, Sequence[str]] | None) -> tuple[str, ...]:
    if not groups:
        return space.paths
    membership = dict.fromkeys(space.paths, "")
    for name, members in groups.items():
        if isinstance(members, str) or not members:
            raise InputError(f"Group {name!r} must be a list of paths, but is {members!r}.")
        for path in members:
            if path not in membership:
                raise InputError(
                    f"Group {name!r} names {path!r}, but the space has {', '.join(space.paths)}. Correct the path."
                )
            if membership[path]:
                raise InputError(
                    f"{path!r} is in the groups {membership[path]!r} and {name!r}. Leave it in one of them."
                )
            membership[path] = name
        if name in space.paths and list(members) != [name]:
            raise InputError(f"Group {name!r} has the name of a parameter. Give it another.")
    named = tuple(name or path for path, name in membership.items())
    if len(set(named)) < 2:
        raise InputError(f"All parameters are in the one group {named[0]!r}, whose index is 1. Make two or more.")
    return named
