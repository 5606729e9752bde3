"""What a drive is and does: models of feed drives and machines in JAX, simulated, linearised, varied, differentiated.

    import jax
    jax.config.update("jax_enable_x64", True)  # stiffnesses in N/m need double precision
    import twin

    axis = twin.drives.mauro_axis()
    print(twin.modes(axis.second_order()).frequency)

Models: `drives` (one plant each), `laws` (friction, stiffness, backlash), `control` (controllers and loops),
`references` (what a loop is told to do), `structure` (machines from component models).
What they do: `simulate`, `linearise`, `frequency_response`, `modes`; `performance`, `correlation`, `modal`.
Their numbers: `Parameter`, `ParameterSpace`, `set_leaves`. What if: `sweep`, `batched`, `executors`.
Measured data: `Record`, `read_measurement`, `prepare`, `read_csv`, `io`. Pictures: `plots`.
Faster starts: `compile_cache`.

Units are SI, frequencies Hz, angles rad. A name is loaded when it is first used, so that `import twin` costs nothing.
`fitting` goes from data to parameters, `sensitivity` says which parameters matter.
"""

from typing import TYPE_CHECKING

from twin._lazy_names import load_lazily

if TYPE_CHECKING:
    from twin import compile_cache as compile_cache
    from twin import control as control
    from twin import correlation as correlation
    from twin import drives as drives
    from twin import executors as executors
    from twin import io as io
    from twin import laws as laws
    from twin import modal as modal
    from twin import performance as performance
    from twin import plots as plots
    from twin import references as references
    from twin import structure as structure
    from twin.batch import batched as batched
    from twin.io.csv import read_csv as read_csv
    from twin.io.measurement import read_measurement as read_measurement
    from twin.io.prepare import prepare as prepare
    from twin.linear import frequency_response as frequency_response
    from twin.linear import linearise as linearise
    from twin.modal import modes as modes
    from twin.parameters import Parameter as Parameter
    from twin.parameters import ParameterSpace as ParameterSpace
    from twin.paths import set_leaves as set_leaves
    from twin.record import Record as Record
    from twin.simulation import simulate as simulate
    from twin.sweep import sweep as sweep

load_lazily(
    __name__,
    {
        "simulate": "twin.simulation",
        "linearise": "twin.linear",
        "frequency_response": "twin.linear",
        "modes": "twin.modal",
        "sweep": "twin.sweep",
        "batched": "twin.batch",
        "set_leaves": "twin.paths",
        "Parameter": "twin.parameters",
        "ParameterSpace": "twin.parameters",
        "Record": "twin.record",
        "read_measurement": "twin.io.measurement",
        "prepare": "twin.io.prepare",
        "read_csv": "twin.io.csv",
    },
    modules=(
        "compile_cache",
        "control",
        "correlation",
        "drives",
        "executors",
        "io",
        "laws",
        "modal",
        "performance",
        "plots",
        "references",
        "structure",
    ),
)
