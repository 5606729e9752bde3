"""The searched quantities of a modal fit: poles and participations, with bounds about where they start."""

import equinox as eqx
import numpy as np
from jaxtyping import Array, Complex, Float, Int

from twin._checks import as_array
from twin.parameters import Parameter, ParameterSpace

# A searched damping ratio stays within these [-].
_DAMPING = (1e-6, 0.7)
# How far a frequency may move: in half-widths of its resonance, and in lines.
_WIDTHS, _LINES = 3.0, 4.0
# A participation is searched up to this size: beyond, the strongest excitation was taken for one that hardly drives the
# mode, and the search would run away.
_LARGEST = 1e3


class ModalPoles(eqx.Module):
    """Poles and participations of the modes of measured responses."""

    frequency: Float[Array, "modes"] = eqx.field(converter=as_array)
    """Natural frequencies [Hz]."""
    damping_ratio: Float[Array, "modes"] = eqx.field(converter=as_array)
    """Damping ratios [-]."""
    participation: Float[Array, "parts"] = eqx.field(converter=as_array)
    """Participations of all excitations but the strongest, as a share of that: of each mode all real parts, then all
    imaginary parts [-]."""
    strongest: tuple[int, ...] = eqx.field(static=True)
    """The excitation of each mode whose participation is 1."""
    inputs: int = eqx.field(static=True)
    """Number of excitations."""

    @classmethod
    def of(cls, poles: np.ndarray, participation: np.ndarray) -> "ModalPoles":
        """From poles and participations of any scale.

        Args:
            poles: λ (modes,) [rad/s].
            participation: L (modes, inputs).
        """
        strongest = np.argmax(np.abs(participation), axis=1)
        modes, inputs = participation.shape
        scaled = participation / participation[np.arange(modes), strongest][:, None]
        rest = scaled[np.arange(inputs) != strongest[:, None]].reshape(modes, inputs - 1)
        return cls(
            np.abs(poles) / (2 * np.pi),
            np.clip(-np.real(poles) / np.abs(poles), 2 * _DAMPING[0], 0.9 * _DAMPING[1]),
            np.stack([rest.real, rest.imag], axis=1).ravel(),
            tuple(int(i) for i in strongest),
            inputs,
        )

    @property
    def poles(self) -> Complex[np.ndarray, "modes"]:
        """λ [rad/s]."""
        ratio = np.asarray(self.damping_ratio)
        return 2 * np.pi * np.asarray(self.frequency) * (-ratio + 1j * np.sqrt(1 - ratio**2))

    @property
    def others(self) -> Int[np.ndarray, "modes rest"]:
        """The excitations of each mode whose participations are free."""
        every = np.arange(self.inputs)
        return np.array([every[every != one] for one in self.strongest], dtype=int).reshape(
            len(self.strongest), self.inputs - 1
        )

    @property
    def participations(self) -> Complex[np.ndarray, "modes inputs"]:
        """L, 1 at the strongest excitation of each mode."""
        modes = len(self.strongest)
        parts = np.asarray(self.participation).reshape(modes, 2, self.inputs - 1)
        full = np.ones((modes, self.inputs), dtype=complex)
        np.put_along_axis(full, self.others, parts[:, 0] + 1j * parts[:, 1], axis=1)
        return full

    def moved(self, values: Float[np.ndarray, "parameters"]) -> "ModalPoles":
        """The same modes at other values.

        Args:
            values: frequencies, damping ratios, participations, in the order of `space`.
        """
        modes = len(self.strongest)
        return ModalPoles(values[:modes], values[modes : 2 * modes], values[2 * modes :], self.strongest, self.inputs)

    def space(self, line: float) -> ParameterSpace:
        """All of them free, with bounds about where they are.

        Args:
            line: distance of two lines [Hz].
        """
        found = []
        for i, (f, ratio) in enumerate(zip(np.asarray(self.frequency), np.asarray(self.damping_ratio), strict=True)):
            reach = min(max(_WIDTHS * f * ratio, _LINES * line), 0.5 * f)
            width = float(max(f * ratio, 1e-3 * line))
            found.append(Parameter(f"frequency.{i}", "Hz", float(f - reach), float(f + reach), size=width))
        found += [Parameter(f"damping_ratio.{i}", "1", *_DAMPING, scale="log") for i in range(len(self.strongest))]
        found += [
            Parameter(f"participation.{i}", "1", -_LARGEST, _LARGEST, size=1.0) for i in range(self.participation.size)
        ]
        return ParameterSpace(found)
