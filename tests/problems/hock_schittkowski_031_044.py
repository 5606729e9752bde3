"""Problems 31 to 44 of Hock and Schittkowski, Test Examples for Nonlinear Programming Codes, 1981."""

import jax.numpy as jnp
import numpy as np

from tests.problems.nonlinear_programme import NonlinearProgramme, spelled_out


def three_and_four_variables() -> tuple[NonlinearProgramme, ...]:
    """Problems 31 to 44: three or four variables."""
    return (
        spelled_out(
            "HS31",
            lambda x1, x2, x3: 9 * x1**2 + x2**2 + 9 * x3**2,
            [1, 1, 1],
            lower=[-10, 1, -10],
            upper=[10, 10, 1],
            inequality=lambda x1, x2, x3: [x1 * x2 - 1],
            optimum=6,
            solution=[1 / np.sqrt(3), np.sqrt(3), 0],
        ),
        spelled_out(
            "HS32",
            lambda x1, x2, x3: (x1 + 3 * x2 + x3) ** 2 + 4 * (x1 - x2) ** 2,
            [0.1, 0.7, 0.2],
            lower=0,
            equality=lambda x1, x2, x3: [1 - x1 - x2 - x3],
            inequality=lambda x1, x2, x3: [6 * x2 + 4 * x3 - x1**3 - 3],
            optimum=1,
            solution=[0, 0, 1],
        ),
        # A second, local, minimum of -4 attracts many methods from this start.
        spelled_out(
            "HS33",
            lambda x1, x2, x3: (x1 - 1) * (x1 - 2) * (x1 - 3) + x3,
            [0, 0, 3],
            lower=0,
            upper=[np.inf, np.inf, 5],
            inequality=lambda x1, x2, x3: [x3**2 - x2**2 - x1**2, x1**2 + x2**2 + x3**2 - 4],
            optimum=np.sqrt(2) - 6,
            solution=[0, np.sqrt(2), np.sqrt(2)],
        ),
        spelled_out(
            "HS34",
            lambda x1, x2, x3: -x1,
            [0, 1.05, 2.9],
            lower=0,
            upper=[100, 100, 10],
            inequality=lambda x1, x2, x3: [x2 - jnp.exp(x1), x3 - jnp.exp(x2)],
            optimum=-np.log(np.log(10)),
            solution=[np.log(np.log(10)), np.log(10), 10],
        ),
        spelled_out(
            "HS35",
            lambda x1, x2, x3: 9 - 8 * x1 - 6 * x2 - 4 * x3 + 2 * x1**2 + 2 * x2**2 + x3**2 + 2 * x1 * x2 + 2 * x1 * x3,
            [0.5, 0.5, 0.5],
            lower=0,
            inequality=lambda x1, x2, x3: [3 - x1 - x2 - 2 * x3],
            optimum=1 / 9,
            solution=[4 / 3, 7 / 9, 4 / 9],
        ),
        spelled_out(
            "HS36",
            lambda x1, x2, x3: -x1 * x2 * x3,
            [10, 10, 10],
            lower=0,
            upper=[20, 11, 42],
            inequality=lambda x1, x2, x3: [72 - x1 - 2 * x2 - 2 * x3],
            optimum=-3300,
            solution=[20, 11, 15],
        ),
        spelled_out(
            "HS37",
            lambda x1, x2, x3: -x1 * x2 * x3,
            [10, 10, 10],
            lower=0,
            upper=42,
            inequality=lambda x1, x2, x3: [72 - x1 - 2 * x2 - 2 * x3, x1 + 2 * x2 + 2 * x3],
            optimum=-3456,
            solution=[24, 12, 12],
        ),
        spelled_out(
            "HS38",
            lambda x1, x2, x3, x4: (
                100 * (x2 - x1**2) ** 2
                + (1 - x1) ** 2
                + 90 * (x4 - x3**2) ** 2
                + (1 - x3) ** 2
                + 10.1 * ((x2 - 1) ** 2 + (x4 - 1) ** 2)
                + 19.8 * (x2 - 1) * (x4 - 1)
            ),
            [-3, -1, -3, -1],
            lower=-10,
            upper=10,
            optimum=0,
            solution=[1, 1, 1, 1],
        ),
        spelled_out(
            "HS39",
            lambda x1, x2, x3, x4: -x1,
            [2, 2, 2, 2],
            equality=lambda x1, x2, x3, x4: [x2 - x1**3 - x3**2, x1**2 - x2 - x4**2],
            optimum=-1,
            solution=[1, 1, 0, 0],
        ),
        # x3 and x4 may both change sign.
        spelled_out(
            "HS40",
            lambda x1, x2, x3, x4: -x1 * x2 * x3 * x4,
            [0.8, 0.8, 0.8, 0.8],
            equality=lambda x1, x2, x3, x4: [x1**3 + x2**2 - 1, x1**2 * x4 - x3, x4**2 - x2],
            optimum=-0.25,
            solution=[2 ** (-1 / 3), 2 ** (-1 / 2), 2 ** (-11 / 12), 2 ** (-1 / 4)],
        ),
        spelled_out(
            "HS41",
            lambda x1, x2, x3, x4: 2 - x1 * x2 * x3,
            [2, 2, 2, 2],
            lower=0,
            upper=[1, 1, 1, 2],
            equality=lambda x1, x2, x3, x4: [x1 + 2 * x2 + 2 * x3 - x4],
            optimum=52 / 27,
            solution=[2 / 3, 1 / 3, 1 / 3, 2],
        ),
        spelled_out(
            "HS42",
            lambda x1, x2, x3, x4: (x1 - 1) ** 2 + (x2 - 2) ** 2 + (x3 - 3) ** 2 + (x4 - 4) ** 2,
            [1, 1, 1, 1],
            equality=lambda x1, x2, x3, x4: [x1 - 2, x3**2 + x4**2 - 2],
            optimum=28 - 10 * np.sqrt(2),
            solution=[2, 2, 0.6 * np.sqrt(2), 0.8 * np.sqrt(2)],
        ),
        spelled_out(
            "HS43",
            lambda x1, x2, x3, x4: x1**2 + x2**2 + 2 * x3**2 + x4**2 - 5 * x1 - 5 * x2 - 21 * x3 + 7 * x4,
            [0, 0, 0, 0],
            inequality=lambda x1, x2, x3, x4: [
                8 - x1**2 - x2**2 - x3**2 - x4**2 - x1 + x2 - x3 + x4,
                10 - x1**2 - 2 * x2**2 - x3**2 - 2 * x4**2 + x1 + x4,
                5 - 2 * x1**2 - x2**2 - x3**2 - 2 * x1 + x2 + x4,
            ],
            optimum=-44,
            solution=[0, 1, 2, -1],
        ),
        # A second, local, minimum of -13 lies at (3, 0, 4, 0).
        spelled_out(
            "HS44",
            lambda x1, x2, x3, x4: x1 - x2 - x3 - x1 * x3 + x1 * x4 + x2 * x3 - x2 * x4,
            [0, 0, 0, 0],
            lower=0,
            inequality=lambda x1, x2, x3, x4: [
                8 - x1 - 2 * x2,
                12 - 4 * x1 - x2,
                12 - 3 * x1 - 4 * x2,
                8 - 2 * x3 - x4,
                8 - x3 - 2 * x4,
                5 - x3 - x4,
            ],
            optimum=-15,
            solution=[0, 3, 0, 4],
        ),
    )


PROBLEMS: tuple[NonlinearProgramme, ...] = three_and_four_variables()
