"""Controls that a reader can trust a fit by: data that were held back, and data that were shuffled."""

from fitting.controls.held_back import HeldBack, held_back, held_back_share
from fitting.controls.permuted import Permuted, permuted_control, shuffled
from fitting.controls.split import Split, hold_back

Control = HeldBack | Permuted
"""What a control returns: each has a name, a sentence, and whether it passed."""

__all__ = [
    "Control",
    "HeldBack",
    "Permuted",
    "Split",
    "held_back",
    "held_back_share",
    "hold_back",
    "permuted_control",
    "shuffled",
]
