"""Problems 71 to 81 of Hock and Schittkowski, Test Examples for Nonlinear Programming Codes, 1981."""

import jax.numpy as jnp
import numpy as np

from tests.problems.nonlinear_programme import NonlinearProgramme, spelled_out


def generators(name, limit, optimum, solution) -> NonlinearProgramme:
    """Problems 74 and 75: power from two generators, with a limit on the phase angles."""
    return spelled_out(
        name,
        lambda x1, x2, x3, x4: 3 * x1 + 1e-6 * x1**3 + 2 * x2 + 2e-6 / 3 * x2**3,
        [0, 0, 0, 0],
        lower=[0, 0, -limit, -limit],
        upper=[1200, 1200, limit, limit],
        equality=lambda x1, x2, x3, x4: [
            1000 * jnp.sin(-x3 - 0.25) + 1000 * jnp.sin(-x4 - 0.25) + 894.8 - x1,
            1000 * jnp.sin(x3 - 0.25) + 1000 * jnp.sin(x3 - x4 - 0.25) + 894.8 - x2,
            1000 * jnp.sin(x4 - 0.25) + 1000 * jnp.sin(x4 - x3 - 0.25) + 1294.8,
        ],
        inequality=lambda x1, x2, x3, x4: [x4 - x3 + limit, x3 - x4 + limit],
        optimum=optimum,
        solution=solution,
    )


def four_variables() -> tuple[NonlinearProgramme, ...]:
    """Problems 71 to 76."""

    def protein_and_risk(x1, x2, x3, x4):
        spread = jnp.sqrt(0.28 * x1**2 + 0.19 * x2**2 + 20.5 * x3**2 + 0.62 * x4**2)
        return [
            2.3 * x1 + 5.6 * x2 + 11.1 * x3 + 1.3 * x4 - 5,
            12 * x1 + 11.9 * x2 + 41.8 * x3 + 52.1 * x4 - 21 - 1.645 * spread,
        ]

    return (
        spelled_out(
            "HS71",
            lambda x1, x2, x3, x4: x1 * x4 * (x1 + x2 + x3) + x3,
            [1, 5, 5, 1],
            lower=1,
            upper=5,
            equality=lambda x1, x2, x3, x4: [x1**2 + x2**2 + x3**2 + x4**2 - 40],
            inequality=lambda x1, x2, x3, x4: [x1 * x2 * x3 * x4 - 25],
            optimum=17.0140172892,
            solution=[1, 4.742999637264, 3.821149984185, 1.379408293173],
        ),
        # The source prints 727.67937, right to seven digits.
        spelled_out(
            "HS72",
            lambda x1, x2, x3, x4: 1 + x1 + x2 + x3 + x4,
            [1, 1, 1, 1],
            lower=0.001,
            upper=[4e5, 3e5, 2e5, 1e5],
            inequality=lambda x1, x2, x3, x4: [
                0.0401 - 4 / x1 - 2.25 / x2 - 1 / x3 - 0.25 / x4,
                0.010085 - 0.16 / x1 - 0.36 / x2 - 0.64 / x3 - 0.64 / x4,
            ],
            optimum=727.679357789,
            solution=[193.407427272, 179.547076032, 185.018063358, 168.706791127],
        ),
        spelled_out(
            "HS73",
            lambda x1, x2, x3, x4: 24.55 * x1 + 26.75 * x2 + 39 * x3 + 40.5 * x4,
            [1, 1, 1, 1],
            lower=0,
            equality=lambda x1, x2, x3, x4: [x1 + x2 + x3 + x4 - 1],
            inequality=protein_and_risk,
            optimum=29.8943781592,
            solution=[0.635521568635, 0, 0.312701880752, 0.0517765506134],
        ),
        generators(
            "HS74",
            0.55,
            optimum=5126.49810959,
            solution=[679.945319851, 1026.06713261, 0.118876364493, -0.396233553203],
        ),
        # The source prints 5174.4129, right to seven digits.
        generators(
            "HS75",
            0.48,
            optimum=5174.41269538,
            solution=[776.159026586, 925.195138469, 0.0511089285384, -0.428891071462],
        ),
        spelled_out(
            "HS76",
            lambda x1, x2, x3, x4: (
                x1**2 + 0.5 * x2**2 + x3**2 + 0.5 * x4**2 - x1 * x3 + x3 * x4 - x1 - 3 * x2 + x3 - x4
            ),
            [0.5, 0.5, 0.5, 0.5],
            lower=0,
            inequality=lambda x1, x2, x3, x4: [
                5 - x1 - 2 * x2 - x3 - x4,
                4 - 3 * x1 - x2 - 2 * x3 + x4,
                x2 + 4 * x3 - 1.5,
            ],
            optimum=-103 / 22,
            solution=[3 / 11, 23 / 11, 0, 6 / 11],
        ),
    )


def five_variables() -> tuple[NonlinearProgramme, ...]:
    """Problems 77 to 81."""

    def sphere(x1, x2, x3, x4, x5):
        return [x1**2 + x2**2 + x3**2 + x4**2 + x5**2 - 10, x2 * x3 - 5 * x4 * x5, x1**3 + x2**3 + 1]

    return (
        spelled_out(
            "HS77",
            lambda x1, x2, x3, x4, x5: (x1 - 1) ** 2 + (x1 - x2) ** 2 + (x3 - 1) ** 2 + (x4 - 1) ** 4 + (x5 - 1) ** 6,
            np.full(5, 2.0),
            equality=lambda x1, x2, x3, x4, x5: [
                x1**2 * x4 + jnp.sin(x4 - x5) - 2 * np.sqrt(2),
                x2 + x3**4 * x4**2 - 8 - np.sqrt(2),
            ],
            optimum=0.241505128792,
            solution=[1.16617218971, 1.1821113888, 1.38025704315, 1.50603627362, 0.610920196043],
        ),
        spelled_out(
            "HS78",
            lambda x1, x2, x3, x4, x5: x1 * x2 * x3 * x4 * x5,
            [-2, 1.5, 2, -1, -1],
            equality=sphere,
            optimum=-2.91970040895,
            solution=[-1.71714357039, 1.59570969018, 1.82724575293, -0.763643078184, -0.763643078184],
        ),
        spelled_out(
            "HS79",
            lambda x1, x2, x3, x4, x5: (
                (x1 - 1) ** 2 + (x1 - x2) ** 2 + (x2 - x3) ** 2 + (x3 - x4) ** 4 + (x4 - x5) ** 4
            ),
            np.full(5, 2.0),
            equality=lambda x1, x2, x3, x4, x5: [
                x1 + x2**2 + x3**3 - 2 - 3 * np.sqrt(2),
                x2 - x3**2 + x4 + 2 - 2 * np.sqrt(2),
                x1 * x5 - 2,
            ],
            optimum=0.0787768208704,
            solution=[1.19112745631, 1.36260316496, 1.47281793151, 1.63501661917, 1.67908143617],
        ),
        spelled_out(
            "HS80",
            lambda x1, x2, x3, x4, x5: jnp.exp(x1 * x2 * x3 * x4 * x5),
            [-2, 2, 2, -1, -1],
            lower=[-2.3, -2.3, -3.2, -3.2, -3.2],
            upper=[2.3, 2.3, 3.2, 3.2, 3.2],
            equality=sphere,
            optimum=0.0539498477708,
            solution=[-1.71714357039, 1.59570969018, 1.82724575293, -0.763643078184, -0.763643078184],
        ),
        spelled_out(
            "HS81",
            lambda x1, x2, x3, x4, x5: jnp.exp(x1 * x2 * x3 * x4 * x5) - 0.5 * (x1**3 + x2**3 + 1) ** 2,
            [-2, 2, 2, -1, -1],
            lower=[-2.3, -2.3, -3.2, -3.2, -3.2],
            upper=[2.3, 2.3, 3.2, 3.2, 3.2],
            equality=sphere,
            optimum=0.0539498477708,
            solution=[-1.71714357039, 1.59570969018, 1.82724575293, -0.763643078184, -0.763643078184],
        ),
    )


PROBLEMS: tuple[NonlinearProgramme, ...] = four_variables() + five_variables()
