"""What-if sweeps as labelled results: tables, xarray, one-line plots."""

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from twin._checks import InputError
from twin.parameters import Parameter

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

_POINT = "point"


@dataclasses.dataclass(frozen=True, repr=False)
class Sweep:
    """Results over a grid or a list of parameter values. Shows itself as a table in a notebook."""

    parameters: tuple[Parameter, ...]
    """What was varied."""
    values: tuple[np.ndarray, ...]
    """Values of each, SI, or factors on the present value where the sweep is relative."""
    present: tuple[float, ...]
    """Value of each in the model itself, SI."""
    relative: bool
    """Whether the values are factors."""
    results: dict[str, np.ndarray]
    """Results by name, each (values of the first, values of the second, ..., axes of its own) over a grid, (points,
    axes of its own) over a list; NaN where a lane failed."""
    units: dict[str, str]
    """Units of the results that have one given."""
    grid: bool = True
    """Whether the points are all combinations of the values; else the values are those of the points in turn."""
    messages: dict[int, str] = dataclasses.field(default_factory=dict)
    """What the points that raised said, by the number of the point."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the grid, or the number of points of a list."""
        return tuple(axis.size for axis in self.values) if self.grid else (self.values[0].size,)

    @property
    def failed(self) -> np.ndarray:
        """Where any of the results is NaN, in the shape of the grid."""
        return np.asarray(np.any([self._missing(name) for name in self.results], axis=0))

    def __getitem__(self, name: str) -> np.ndarray:
        """One result, in the shape of the grid first.

        Raises:
            InputError: if there is no result of that name.
        """
        if name not in self.results:
            raise InputError(f"The sweep has no result {name!r}; it has {', '.join(self.results)}.")
        return self.results[name]

    def label(self, name: str) -> str:
        """Name and unit of a result."""
        self[name]
        return f"{name} [{self.units[name]}]" if self.units.get(name) else name

    def axis_label(self, axis: int) -> str:
        """Name and unit of a swept parameter; over its present value in a relative sweep."""
        parameter = self.parameters[axis]
        return f"{parameter.path} / ({self._now(axis)})" if self.relative else parameter.label

    def plot(self, name: str | None = None, *, ax: "Axes | None" = None) -> "Axes":
        """Picture of one result over one parameter, or a map over two; see `twin.plots.plot_sweep`."""
        from twin.plots import plot_sweep

        return plot_sweep(self, name, ax=ax)

    def to_xarray(self) -> "xr.Dataset":
        """The results by name, labelled by the values of the parameters (SI, or factors) and with their units.

        Over a list the only axis is "point", and the parameters are its labels. The axes of results that are arrays
        are called after the result and numbered. A result that has the name of a swept parameter is called
        "NAME (result)".
        """
        import xarray as xr

        dims = tuple(p.path for p in self.parameters) if self.grid else (_POINT,)
        coordinates = {}
        for axis, (parameter, values) in enumerate(zip(self.parameters, self.values, strict=True)):
            about: dict[str, str | float] = {"long_name": parameter.path, "units": parameter.unit}
            if self.relative:
                about = {"long_name": self.axis_label(axis), "units": ""}
            about["present"] = self.present[axis]
            coordinates[parameter.path] = (parameter.path if self.grid else _POINT, values, about)
        variables = {}
        for name, values in self.results.items():
            inner = tuple(f"{name}.{i}" for i in range(values.ndim - len(self.shape)))
            about = {"long_name": name, "units": self.units.get(name, "")}
            # A result may be called as a parameter is, but not its label.
            variables[f"{name} (result)" if name in coordinates else name] = ((*dims, *inner), values, about)
        return xr.Dataset(variables, coordinates)

    def to_dataframe(self) -> "pd.DataFrame":
        """Table with one row per point: the parameters in SI, the factors of a relative sweep, the results that are
        single numbers, and a remark where a result is NaN."""
        import pandas as pd

        points = self._points()
        table = {}
        for parameter, values, now in zip(self.parameters, points, self.present, strict=True):
            table[parameter.label] = values * now if self.relative else values
            if self.relative:
                table[f"{parameter.path} [relative]"] = values
        for name, values in self.results.items():
            if values.shape == self.shape:
                table[self.label(name)] = values.ravel()
        missing = {name: self._missing(name).ravel() for name in self.results}
        remarks = []
        for point in range(points[0].size):
            names = ", ".join(name for name, where in missing.items() if where[point])
            remarks.append(self.messages.get(point, f"NaN: {names}" if names else ""))
        table["remark"] = remarks
        return pd.DataFrame(table)

    def _points(self) -> list[np.ndarray]:
        return [axis.ravel() for axis in np.meshgrid(*self.values, indexing="ij")] if self.grid else list(self.values)

    def _missing(self, name: str) -> np.ndarray:
        values = self.results[name]
        return np.asarray(np.isnan(values).any(axis=tuple(range(len(self.shape), values.ndim))))

    def _now(self, axis: int) -> str:
        return f"{self.present[axis]:g} {self.parameters[axis].unit}".strip()

    def _facts(self) -> str:
        names = " and ".join(f"{p.path} (now {self._now(i)})" for i, p in enumerate(self.parameters))
        lost = int(np.count_nonzero(self.failed))
        failed = f" {lost} of {self.failed.size} points have a result that is NaN." if lost else ""
        return f"Sweep of {names}: {self.failed.size} points.{failed}"

    def _repr_html_(self) -> str:
        table = self.to_dataframe().to_html(index=False, float_format=lambda x: f"{x:.6g}", max_rows=60)
        return f"<div><p>{self._facts()}</p>{table}</div>"

    def __repr__(self) -> str:
        table = self.to_dataframe().to_string(index=False, float_format=lambda x: f"{x:.6g}", max_rows=60)
        return f"{table}\n{self._facts()}"
