"""Problems 45 to 56 of Hock and Schittkowski, Test Examples for Nonlinear Programming Codes, 1981."""

import jax.numpy as jnp
import numpy as np

from tests.problems.nonlinear_programme import NonlinearProgramme, programme, spelled_out


def five_variables() -> tuple[NonlinearProgramme, ...]:
    """Problems 45 to 53: five variables; linear equations from problem 48 on."""

    def linear(x1, x2, x3, x4, x5):
        return [x1 + 3 * x2, x3 + x4 - 2 * x5, x2 - x5]

    return (
        programme(
            "HS45",
            lambda x: 2 - jnp.prod(x) / 120,
            np.full(5, 2.0),
            lower=0,
            upper=[1, 2, 3, 4, 5],
            optimum=1,
            solution=[1, 2, 3, 4, 5],
        ),
        spelled_out(
            "HS46",
            lambda x1, x2, x3, x4, x5: (x1 - x2) ** 2 + (x3 - 1) ** 2 + (x4 - 1) ** 4 + (x5 - 1) ** 6,
            [np.sqrt(2) / 2, 1.75, 0.5, 2, 2],
            equality=lambda x1, x2, x3, x4, x5: [x1**2 * x4 + jnp.sin(x4 - x5) - 1, x2 + x3**4 * x4**2 - 2],
            optimum=0,
            solution=np.ones(5),
        ),
        spelled_out(
            "HS47",
            lambda x1, x2, x3, x4, x5: (x1 - x2) ** 2 + (x2 - x3) ** 3 + (x3 - x4) ** 4 + (x4 - x5) ** 4,
            [2, np.sqrt(2), -1, 2 - np.sqrt(2), 0.5],
            equality=lambda x1, x2, x3, x4, x5: [x1 + x2**2 + x3**3 - 3, x2 - x3**2 + x4 - 1, x1 * x5 - 1],
            optimum=0,
            solution=np.ones(5),
        ),
        spelled_out(
            "HS48",
            lambda x1, x2, x3, x4, x5: (x1 - 1) ** 2 + (x2 - x3) ** 2 + (x4 - x5) ** 2,
            [3, 5, -3, 2, -2],
            equality=lambda x1, x2, x3, x4, x5: [x1 + x2 + x3 + x4 + x5 - 5, x3 - 2 * (x4 + x5) + 3],
            optimum=0,
            solution=np.ones(5),
        ),
        spelled_out(
            "HS49",
            lambda x1, x2, x3, x4, x5: (x1 - x2) ** 2 + (x3 - 1) ** 2 + (x4 - 1) ** 4 + (x5 - 1) ** 6,
            [10, 7, 2, -3, 0.8],
            equality=lambda x1, x2, x3, x4, x5: [x1 + x2 + x3 + 4 * x4 - 7, x3 + 5 * x5 - 6],
            optimum=0,
            solution=np.ones(5),
        ),
        spelled_out(
            "HS50",
            lambda x1, x2, x3, x4, x5: (x1 - x2) ** 2 + (x2 - x3) ** 2 + (x3 - x4) ** 4 + (x4 - x5) ** 2,
            [35, -31, 11, 5, -5],
            equality=lambda x1, x2, x3, x4, x5: [
                x1 + 2 * x2 + 3 * x3 - 6,
                x2 + 2 * x3 + 3 * x4 - 6,
                x3 + 2 * x4 + 3 * x5 - 6,
            ],
            optimum=0,
            solution=np.ones(5),
        ),
        spelled_out(
            "HS51",
            lambda x1, x2, x3, x4, x5: (x1 - x2) ** 2 + (x2 + x3 - 2) ** 2 + (x4 - 1) ** 2 + (x5 - 1) ** 2,
            [2.5, 0.5, 2, -1, 0.5],
            equality=lambda x1, x2, x3, x4, x5: [x1 + 3 * x2 - 4, x3 + x4 - 2 * x5, x2 - x5],
            optimum=0,
            solution=np.ones(5),
        ),
        spelled_out(
            "HS52",
            lambda x1, x2, x3, x4, x5: (4 * x1 - x2) ** 2 + (x2 + x3 - 2) ** 2 + (x4 - 1) ** 2 + (x5 - 1) ** 2,
            np.full(5, 2.0),
            equality=linear,
            optimum=1859 / 349,
            solution=np.array([-33, 11, 180, -158, 11]) / 349,
        ),
        spelled_out(
            "HS53",
            lambda x1, x2, x3, x4, x5: (x1 - x2) ** 2 + (x2 + x3 - 2) ** 2 + (x4 - 1) ** 2 + (x5 - 1) ** 2,
            np.full(5, 2.0),
            lower=-10,
            upper=10,
            equality=linear,
            optimum=176 / 43,
            solution=np.array([-33, 11, 27, -5, 11]) / 43,
        ),
    )


def six_and_seven_variables() -> tuple[NonlinearProgramme, ...]:
    """Problems 54 to 56: six or seven variables."""

    def normal_exponent(x1, x2, x3, x4, x5, x6):
        u, v = (x1 - 1e4) / 8e3, x2 - 1
        others = (
            (x3 - 2e6) ** 2 / 4.9e13 + (x4 - 10) ** 2 / 2.5e3 + (x5 - 1e-3) ** 2 / 2.5e-3 + (x6 - 1e8) ** 2 / 2.5e17
        )
        return (u**2 + 0.4 * u * v + v**2) / 0.96 + others

    a, b, c = np.arcsin(np.sqrt([1 / 4.2, 4 / 7, 2 / 7]))
    return (
        # Variables from 1e-3 to 1e8, far from a good scale, and f is flat at the start.
        spelled_out(
            "HS54",
            lambda *x: -jnp.exp(-normal_exponent(*x) / 2),
            [6e3, 1.5, 4e6, 2, 3e-3, 5e7],
            lower=[0, -10, 0, 0, -1, 0],
            upper=[2e4, 10, 1e7, 20, 1, 2e8],
            equality=lambda x1, x2, x3, x4, x5, x6: [x1 + 4e3 * x2 - 1.76e4],
            optimum=-np.exp(-27 / 280),
            solution=[91600 / 7, 79 / 70, 2e6, 10, 1e-3, 1e8],
        ),
        # The six equations are linearly dependent; a second, local, minimum of 20/3 lies at x1 = 1.
        spelled_out(
            "HS55",
            lambda x1, x2, x3, x4, x5, x6: x1 + 2 * x2 + 4 * x5 + jnp.exp(x1 * x4),
            [1, 2, 0, 0, 0, 2],
            lower=0,
            upper=[1, np.inf, np.inf, 1, np.inf, np.inf],
            equality=lambda x1, x2, x3, x4, x5, x6: [
                x1 + 2 * x2 + 5 * x5 - 6,
                x1 + x2 + x3 - 3,
                x4 + x5 + x6 - 2,
                x1 + x4 - 1,
                x2 + x5 - 2,
                x3 + x6 - 2,
            ],
            optimum=19 / 3,
            solution=[0, 4 / 3, 5 / 3, 1, 2 / 3, 1 / 3],
        ),
        spelled_out(
            "HS56",
            lambda x1, x2, x3, x4, x5, x6, x7: -x1 * x2 * x3,
            [1, 1, 1, a, a, a, np.arcsin(np.sqrt(5 / 7.2))],
            equality=lambda x1, x2, x3, x4, x5, x6, x7: [
                x1 - 4.2 * jnp.sin(x4) ** 2,
                x2 - 4.2 * jnp.sin(x5) ** 2,
                x3 - 4.2 * jnp.sin(x6) ** 2,
                x1 + 2 * x2 + 2 * x3 - 7.2 * jnp.sin(x7) ** 2,
            ],
            optimum=-3.456,
            solution=[2.4, 1.2, 1.2, b, c, c, np.pi / 2],
        ),
    )


PROBLEMS: tuple[NonlinearProgramme, ...] = five_variables() + six_and_seven_variables()
