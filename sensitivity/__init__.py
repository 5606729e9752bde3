"""Which parameters matter where: variance-based, screening and derivative-based sensitivity.

    import sensitivity, twin

    space = twin.ParameterSpace([twin.Parameter("slide_mass", "kg", 160, 240), ...])
    indices = sensitivity.sobol(first_frequency, space, model=axis, n=1024, seed=1)

Shares of the variance: `sobol`; in steps `sobol_samples`, `evaluate`, `sobol_indices`. Few runs: `morris`.
Exact slopes: `derivative_measures`; in steps `derivative_samples`, `measures_from_derivatives`, `screen`.
`partition` says which parameters each output needs, so that one large problem becomes several small ones.
Pictures: `plots`. A name is loaded when it is first used, so that `import sensitivity` costs nothing.
"""

from typing import TYPE_CHECKING

from twin._lazy_names import load_lazily

if TYPE_CHECKING:
    from sensitivity import plots as plots
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

load_lazily(
    __name__,
    {
        "sobol": "sensitivity.sobol",
        "sobol_samples": "sensitivity.sobol_design",
        "evaluate": "sensitivity.evaluation",
        "sobol_indices": "sensitivity.sobol",
        "morris": "sensitivity.morris",
        "derivative_measures": "sensitivity.derivative",
        "derivative_samples": "sensitivity.derivative",
        "measures_from_derivatives": "sensitivity.derivative",
        "screen": "sensitivity.derivative",
        "partition": "sensitivity.partition",
        "SobolSamples": "sensitivity.sobol_design",
        "SobolIndices": "sensitivity.sobol_result",
        "ElementaryEffects": "sensitivity.morris",
        "DerivativeMeasures": "sensitivity.derivative_result",
        "Partition": "sensitivity.partition",
    },
    modules=("plots",),
)
