"""The C source of a model: its functions, its start values, and where each variable lies."""

import jax.numpy as jnp
from jaxtyping import Array

from twin.export.c_code import c_function
from twin.export.c_code.value import literal
from twin.export.fmu.variables import Layout, plant_state
from twin.export.one_step import OneStep

_HEADER = """\
/* Translated from the twin's own step. Where the variables lie, and what the model can do. */

#ifndef MODEL_H
#define MODEL_H

#define MODEL_TOKEN "{token}"

/* Length of a step [s]. */
#define MODEL_PERIOD {period}

/* Places of the first parameter, initial state, ...; place 0 is the time. */
#define MODEL_PARAMETERS {parameters}
#define MODEL_INITIAL {initial}
#define MODEL_INPUTS {inputs}
#define MODEL_OUTPUTS {outputs}
#define MODEL_STATES {states}
#define MODEL_VALUES {count}
#define MODEL_STATE_COUNT {state_count}
#define MODEL_STATE_ROOM {state_room}

enum {{ DT_READ_ONLY, DT_FIXED, DT_FREE }};

extern const double model_start[MODEL_VALUES];
extern const char model_access[MODEL_VALUES];

/* Parameters and initial states to the state at the start. */
void model_initial(const double *p, const double *given, double *result);

/* Parameters, states, inputs and time to the states one period later. */
void model_step(const double *p, const double *x, const double *u, const double *t, double *result);

/* Parameters, states, inputs and time to the outputs. */
void model_outputs(const double *p, const double *x, const double *u, const double *t, double *result);

#endif
"""


def model_header(step: OneStep, places: Layout, token: str) -> str:
    """Text of model.h.

    Args:
        step: the step.
        places: its variables.
        token: what library and description know each other by.
    """
    count = len(places.variables)
    return _HEADER.format(
        token=token,
        period=repr(step.period),
        parameters=places.parameters,
        initial=places.initial,
        inputs=places.inputs,
        outputs=places.outputs,
        states=places.states,
        count=count,
        state_count=count - places.states,
        state_room=max(count - places.states, 1),
    )


def model_source(step: OneStep, places: Layout) -> str:
    """Text of model.c.

    Args:
        step: the step.
        places: its variables.

    Raises:
        InputError: an operation that has no translation to C.
    """
    p, x, u, t = step.parameters.arrays, step.states.arrays, step.inputs.arrays, [jnp.zeros(())]
    begin = plant_state(step)

    def initial(parameters: list[Array], given: list[Array]) -> list[Array]:
        chosen = dict(zip(places.settable, given, strict=True))
        computed = step.plant_state(parameters)
        return step.initial(parameters, [chosen.get(i, own) for i, own in enumerate(computed)])

    def advance(p: list[Array], x: list[Array], u: list[Array], t: list[Array]) -> list[Array]:
        return step.advance(p, x, u, t[0])

    def observe(p: list[Array], x: list[Array], u: list[Array], t: list[Array]) -> list[Array]:
        return step.observe(p, x, u, t[0])

    groups = (("p", p), ("x", x), ("u", u), ("t", t))
    functions = [
        c_function("model_initial", initial, (("p", p), ("given", [begin[i] for i in places.settable]))),
        c_function("model_step", advance, groups),
        c_function("model_outputs", observe, groups),
    ]
    starts = ",\n    ".join(
        f"{literal(0.0 if v.start is None else v.start, 'float64')} /* {_comment(v.name)} */" for v in places.variables
    )
    kinds = {"fixed": "DT_FIXED", "tunable": "DT_FREE"}
    access = ", ".join(
        "DT_FREE" if v.causality == "input" else kinds[v.variability] if v.causality == "parameter" else "DT_READ_ONLY"
        for v in places.variables
    )
    head = "/* Translated from the twin's own step by drivetwin. */\n\n"
    head += '#include "model.h"\n\n#include "arithmetic.h"\n\n'
    head += f"const double model_start[MODEL_VALUES] = {{\n    {starts}\n}};\n\n"
    head += f"const char model_access[MODEL_VALUES] = {{ {access} }};\n\n"
    return head + "\n".join(function.text for function in functions)


def _comment(text: str) -> str:
    return text.replace("*/", "* /")
