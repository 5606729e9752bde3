"""Which parameters matter where: variance-based, screening and derivative-based sensitivity."""

from sensitivity.derivative import derivative_measures as derivative_measures
from sensitivity.derivative import derivative_samples as derivative_samples
from sensitivity.derivative import measures_from_derivatives as measures_from_derivatives
from sensitivity.derivative import screen as screen
from sensitivity.derivative_result import DerivativeMeasures as DerivativeMeasures
from sensitivity.evaluation import evaluate as evaluate
from sensitivity.morris import ElementaryEffects as ElementaryEffects
from sensitivity.morris import morris as morris
from sensitivity.partition import Partition as Partition
from sensitivity.partition import partition as partition
from sensitivity.sobol import sobol as sobol
from sensitivity.sobol import sobol_indices as sobol_indices
from sensitivity.sobol_design import SobolSamples as SobolSamples
from sensitivity.sobol_design import sobol_samples as sobol_samples
from sensitivity.sobol_result import SobolIndices as SobolIndices
