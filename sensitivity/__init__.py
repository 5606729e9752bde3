"""Which parameters matter where: variance-based, screening and derivative-based sensitivity."""

from sensitivity.evaluation import evaluate as evaluate
from sensitivity.sobol import sobol as sobol
from sensitivity.sobol import sobol_indices as sobol_indices
from sensitivity.sobol_design import SobolSamples as SobolSamples
from sensitivity.sobol_design import sobol_samples as sobol_samples
from sensitivity.sobol_result import SobolIndices as SobolIndices
