"""Modes identified from measured frequency responses."""

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
import numpy as np

from fitting.identification.modal_shapes import ScaledShapes
from fitting.identification.modal_stabilisation import StabilisationDiagram
from fitting.result import FitResult
from twin.correlation.collinearity import phase_collinearity, real_shapes
from twin.frf import FRF
from twin.modal import ReferenceModes

if TYPE_CHECKING:
    import pandas as pd

# Most and usual number of digits behind the point.
_MOST_DIGITS, _DIGITS = 9, 5


def counted(number: int, what: str) -> str:
    """A number with its noun, as "1 mode" or "2 modes".

    Args:
        number: how many.
        what: the noun, singular.
    """
    return f"{number} {what}{'' if number == 1 else 's'}"


@dataclasses.dataclass(frozen=True, repr=False)
class ModalAnalysis:
    """Modes of a structure from its measured frequency responses. Shows itself as a table in a notebook."""

    measured: FRF
    """The responses within the band."""
    synthesised: FRF
    """The responses of the modes, with the terms for modes outside of the band."""
    fit: FitResult
    """Frequencies, damping ratios and participations with their covariance."""
    scaled: ScaledShapes
    """Shapes with their errors, and by what they are scaled."""
    diagram: StabilisationDiagram
    """The poles of all orders that the modes were chosen from."""
    share: np.ndarray
    """Power of each mode's own responses as a share of that of all responses (modes,) [-]; modes that work against each
    other add up to more than 1."""
    verdict: tuple[str, ...]
    """"good", or what may be wrong with each mode."""
    reciprocal: bool
    """Whether excitations and responses were swapped: then outputs are the points that were hit."""
    warnings: tuple[str, ...]
    """What a reader has to know before all else, with the cure."""
    remarks: tuple[str, ...]
    """What was taken, what was left out, and why."""

    @property
    def frequency(self) -> np.ndarray:
        """Natural frequencies (modes,) [Hz]."""
        return np.asarray(self.fit.model.frequency)

    @property
    def frequency_error(self) -> np.ndarray:
        """Their standard errors [Hz]."""
        return self.fit.standard_errors[: self.frequency.size]

    @property
    def damping_ratio(self) -> np.ndarray:
        """Damping ratios (modes,) [-]."""
        return np.asarray(self.fit.model.damping_ratio)

    @property
    def damping_error(self) -> np.ndarray:
        """Their standard errors [-]."""
        return self.fit.standard_errors[self.frequency.size : 2 * self.frequency.size]

    @property
    def intervals(self) -> np.ndarray:
        """95 % confidence intervals of the frequencies [Hz], then of the damping ratios [-], (2, modes, 2)."""
        return self.fit.intervals()[: 2 * self.frequency.size].reshape(2, -1, 2)

    @property
    def poles(self) -> np.ndarray:
        """Poles λ (modes,) [rad/s]."""
        return self.fit.model.poles

    @property
    def shapes(self) -> np.ndarray:
        """Complex shapes (outputs, modes): mass-normalised [1/√kg] if a driving point was measured, else 1 at the
        largest row."""
        return self.scaled.shapes

    @property
    def shape_errors(self) -> np.ndarray:
        """Standard errors of the shapes' entries, both parts together (outputs, modes)."""
        return self.scaled.errors

    @property
    def mass_normalised(self) -> bool:
        """Whether the shapes are mass-normalised."""
        return bool(self.scaled.driving_points)

    @property
    def participation(self) -> np.ndarray:
        """How strongly each excitation drives each mode, 1 for the strongest (modes, inputs) [-]."""
        return np.abs(self.fit.model.participations) / np.max(
            np.abs(self.fit.model.participations), axis=1, keepdims=True
        )

    @property
    def phase_collinearity(self) -> np.ndarray:
        """Modal phase collinearity of the shapes, 1 for a standing wave (modes,) [-]."""
        return phase_collinearity(self.shapes)

    @property
    def error(self) -> float:
        """Root of the power that the modes do not explain, as a share of that of all responses [-]."""
        measured, modes = np.asarray(self.measured.values), np.asarray(self.synthesised.values)
        return float(np.linalg.norm(measured - modes) / np.linalg.norm(measured))

    @property
    def success(self) -> bool:
        """Whether the fit converged."""
        return self.fit.success

    @property
    def message(self) -> str:
        """What was found, how well it explains the responses, and what to do."""
        scale = (
            "mass-normalised" if self.mass_normalised else "of unknown scale (without a driving point that can be used)"
        )
        low, high = float(self.measured.frequency[0]), float(self.measured.frequency[-1])
        outputs, inputs, lines = self.measured.values.shape
        if self.reciprocal:
            outputs, inputs = inputs, outputs
        return " ".join(
            [
                f"{counted(self.frequency.size, 'mode')} from {low:g} to {high:g} Hz, in",
                f"{counted(outputs, 'response')} to {counted(inputs, 'excitation')} at {lines} lines;",
                f"shapes are {scale}. They explain the responses but for {100 * self.error:.2g} % (rms).",
                self.fit.message,
                *self.warnings,
                *self.remarks,
            ]
        )

    def to_modes(self, *, real: bool = True) -> ReferenceModes:
        """The modes as `identify_machine` and the criteria of `twin.correlation` take them.

        Args:
            real: turn each shape by its phase and keep the real part, as undamped models have it.
        """
        shapes = real_shapes(self.shapes) if real else self.shapes
        return ReferenceModes(
            jnp.asarray(self.frequency), jnp.asarray(self.damping_ratio), jnp.asarray(shapes), self.measured.outputs
        )

    def to_dataframe(self) -> "pd.DataFrame":
        """Table of the modes, with standard errors."""
        import pandas as pd

        return pd.DataFrame(
            {
                "frequency [Hz]": self.frequency,
                "standard error [Hz]": self.frequency_error,
                "damping ratio": self.damping_ratio,
                "standard error of damping ratio": self.damping_error,
                "phase collinearity": self.phase_collinearity,
                "share of response": self.share,
                "verdict": list(self.verdict),
            },
            index=pd.Index(np.arange(1, self.frequency.size + 1), name="mode"),
        )

    def shapes_dataframe(self) -> "pd.DataFrame":
        """Table of the complex shapes, one row for each response, one column for each mode."""
        import pandas as pd

        columns = pd.Index([f"{f:.5g} Hz" for f in self.frequency], name="mode")
        return pd.DataFrame(self.shapes, index=pd.Index(self.measured.outputs, name="response"), columns=columns)

    def _repr_html_(self) -> str:
        table = self.to_dataframe().to_html(formatters=self._formats())
        return f"<div><p><b>Modal analysis</b>: {self.message}</p>{table}</div>"

    def __repr__(self) -> str:
        return f"{self.to_dataframe().to_string(formatters=self._formats())}\n{self.message}"

    def _formats(self) -> Any:
        """As many digits in a column as the smallest of its errors supports."""
        frequency, ratio = (_fixed(error) for error in (self.frequency_error, self.damping_error))
        return {
            "frequency [Hz]": frequency,
            "standard error [Hz]": frequency,
            "damping ratio": ratio,
            "standard error of damping ratio": ratio,
            "phase collinearity": "{:.3f}".format,
            "share of response": "{:.4f}".format,
        }


def _fixed(errors: np.ndarray) -> Callable[[float], str]:
    known = errors[np.isfinite(errors) & (errors > 0)]
    digits = _DIGITS if known.size == 0 else int(np.clip(1 - np.floor(np.log10(known.min())), 0, _MOST_DIGITS))
    return f"{{:.{digits}f}}".format
