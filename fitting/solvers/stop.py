"""Why a solver stopped, and what to do then."""

import equinox as eqx


class Stop(eqx.Enumeration):
    """Why a solver stopped; `Stop[reason]` is a sentence on what to do."""

    running = "Still running."
    converged = "Converged: no step of the linearised problem would reduce the cost noticeably."
    at_precision = (
        "Converged to the precision of the objective: what is left of the gradient is rounding or integration error."
    )
    stalled = (
        "No step reduces the cost, yet the gradient is not zero. The residual is not smooth, or its derivative is less "
        "accurate than it should be: tighten the integration tolerance, widen smoothing, or start elsewhere."
    )
    not_finite = (
        "The residual or its Jacobian is not finite at the start. Simulate the start model and look at its status."
    )
    too_many_steps = "Out of steps: it was still on its way. Raise max_steps, or go on from where it stopped."
    infeasible = (
        "No point near here satisfies the constraints: this is the least infeasible point found. Check the constraints "
        "against each other and against the bounds, or start elsewhere."
    )


STOPS = ("running", "converged", "at_precision", "stalled", "not_finite", "too_many_steps", "infeasible")
"""Names of the reasons, in the order of their numbers."""
CONVERGED = ("converged", "at_precision")
"""Names of the reasons that are a success."""
