"""From data to parameters: fits by gradients within bounds, with error bars, and what they are worth.

    import fitting, twin

    evidence = fitting.TrajectoryResidual.create(record, reference, {"position": 1e-6})
    space = twin.ParameterSpace([twin.Parameter("plant.mass", "kg", 10, 1000, scale="log")])
    result = fitting.fit(evidence, loop, space)

Evidence: `TrajectoryResidual` (records over time), `FrequencyResponseResidual`; residuals add up to joint fits.
Search: `fit` from one start, `multistart` from many, `output_error` straight from a record; `constraints`.
Worth: `identifiability` (what the data tell), `profile` (intervals that need no linear theory); pictures: `plots`.
The other way round: `design` finds the gains or the move that cost least within limits.

Further procedures have a file of their own, such as `fitting.posterior`, `fitting.gain_design` and those of
`fitting.identification`. A name is loaded when it is first used, so that `import fitting` costs nothing.
"""

from typing import TYPE_CHECKING

from twin._lazy_names import load_lazily

if TYPE_CHECKING:
    from fitting import constraints as constraints
    from fitting import plots as plots
    from fitting.fit import fit as fit
    from fitting.identifiability import identifiability as identifiability
    from fitting.identification.output_error import output_error as output_error
    from fitting.multistart import multistart as multistart
    from fitting.optimal_design import design as design
    from fitting.profile import profile as profile
    from fitting.residuals.frequency_response import FrequencyResponseResidual as FrequencyResponseResidual
    from fitting.residuals.trajectory import TrajectoryResidual as TrajectoryResidual

load_lazily(
    __name__,
    {
        "fit": "fitting.fit",
        "multistart": "fitting.multistart",
        "output_error": "fitting.identification.output_error",
        "TrajectoryResidual": "fitting.residuals.trajectory",
        "FrequencyResponseResidual": "fitting.residuals.frequency_response",
        "identifiability": "fitting.identifiability",
        "profile": "fitting.profile",
        "design": "fitting.optimal_design",
    },
    modules=("constraints", "plots"),
)
