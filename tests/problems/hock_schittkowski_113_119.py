"""Problems 113 to 119 of Hock and Schittkowski, Test Examples for Nonlinear Programming Codes, 1981.

There is no problem 115.
"""

import jax.numpy as jnp
import numpy as np

from tests.problems.hock_schittkowski_083_093 import COLVILLE_A, COLVILLE_B, COLVILLE_C, COLVILLE_D, COLVILLE_E
from tests.problems.nonlinear_programme import NonlinearProgramme, programme, spelled_out


def wong() -> NonlinearProgramme:
    """Problem 113: ten variables, eight constraints."""

    def cost(x1, x2, x3, x4, x5, x6, x7, x8, x9, x10):
        squares = (x3 - 10) ** 2 + 4 * (x4 - 5) ** 2 + (x5 - 3) ** 2 + 2 * (x6 - 1) ** 2 + 5 * x7**2
        others = 7 * (x8 - 11) ** 2 + 2 * (x9 - 10) ** 2 + (x10 - 7) ** 2 + 45
        return x1**2 + x2**2 + x1 * x2 - 14 * x1 - 16 * x2 + squares + others

    return spelled_out(
        "HS113",
        cost,
        [2, 3, 5, 5, 1, 2, 7, 3, 6, 10],
        inequality=lambda x1, x2, x3, x4, x5, x6, x7, x8, x9, x10: [
            105 - 4 * x1 - 5 * x2 + 3 * x7 - 9 * x8,
            -10 * x1 + 8 * x2 + 17 * x7 - 2 * x8,
            8 * x1 - 2 * x2 - 5 * x9 + 2 * x10 + 12,
            -3 * (x1 - 2) ** 2 - 4 * (x2 - 3) ** 2 - 2 * x3**2 + 7 * x4 + 120,
            -5 * x1**2 - 8 * x2 - (x3 - 6) ** 2 + 2 * x4 + 40,
            -0.5 * (x1 - 8) ** 2 - 2 * (x2 - 4) ** 2 - 3 * x5**2 + x6 + 30,
            -(x1**2) - 2 * (x2 - 2) ** 2 + 2 * x1 * x2 - 14 * x5 + 6 * x6,
            3 * x1 - 6 * x2 - 12 * (x9 - 8) ** 2 + 7 * x10,
        ],
        optimum=24.3062090682,
        solution=[
            2.171996371255,
            2.363682973697,
            8.773925738477,
            5.095984487948,
            0.9906547649639,
            1.430573978936,
            1.321644208162,
            9.828725807886,
            8.280091670098,
            8.375926663921,
        ],
    )


def alkylation() -> NonlinearProgramme:
    """Problem 114: the process of problem 67, its balances written as constraints."""
    a, b = 0.99, 0.9

    def limits(x1, x2, x3, x4, x5, x6, x7, x8, x9, x10):
        g1 = 35.82 - 0.222 * x10 - b * x9
        g2 = -133 + 3 * x7 - a * x10
        g5 = 1.12 * x1 + 0.13167 * x1 * x8 - 0.00667 * x1 * x8**2 - a * x4
        g6 = 57.425 + 1.098 * x8 - 0.038 * x8**2 + 0.325 * x6 - a * x7
        opposite = [-g1 + x9 * (1 / b - b), -g2 + (1 / a - a) * x10, -g5 + (1 / a - a) * x4, -g6 + (1 / a - a) * x7]
        return [g1, g2, g5, g6, *opposite]

    return spelled_out(
        "HS114",
        lambda x1, x2, x3, x4, x5, x6, x7, x8, x9, x10: 5.04 * x1 + 0.035 * x2 + 10 * x3 + 3.36 * x5 - 0.063 * x4 * x7,
        [1745, 12000, 110, 3048, 1974, 89.2, 92.8, 8, 3.6, 145],
        lower=[1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 85, 90, 3, 1.2, 145],
        upper=[2000, 16000, 120, 5000, 2000, 93, 95, 12, 4, 162],
        equality=lambda x1, x2, x3, x4, x5, x6, x7, x8, x9, x10: [
            1.22 * x4 - x1 - x5,
            98000 * x3 / (x4 * x9 + 1000 * x3) - x6,
            (x2 + x5) / x1 - x8,
        ],
        inequality=limits,
        optimum=-1768.80696372,
        solution=[
            1698.09476519,
            15818.6149242,
            54.1026823332,
            3031.22521737,
            2000,
            90.115422199,
            95,
            10.4932983067,
            1.56163636364,
            153.535353535,
        ],
    )


def membranes() -> NonlinearProgramme:
    """Problem 116: membrane separation in three stages."""
    a, b, c, d, e, f = 0.002, 1.262626, 1.231059, 0.03475, 0.975, 0.00975

    def limits(x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11, x12, x13):
        return [
            x3 - x2,
            x2 - x1,
            1 - a * x7 + a * x8,
            x11 + x12 + x13 - 50,
            250 - x11 - x12 - x13,
            x13 - b * x10 + c * x3 * x10,
            x5 - d * x2 - e * x2 * x5 + f * x2**2,
            x6 - d * x3 - e * x3 * x6 + f * x3**2,
            x4 - d * x1 - e * x1 * x4 + f * x1**2,
            x12 - b * x9 + c * x2 * x9,
            x11 - b * x8 + c * x1 * x8,
            x5 * x7 - x1 * x8 - x4 * x7 + x4 * x8,
            1 - a * (x2 * x9 + x5 * x8 - x1 * x8 - x6 * x9) - x5 - x6,
            x2 * x9 - x3 * x10 - x6 * x9 - 500 * x2 + 500 * x6 + x2 * x10,
            x2 - 0.9 - a * (x2 * x10 - x3 * x10),
        ]

    # The source prints 97.588409 at a point that misses its constraints by 2e-4.
    return spelled_out(
        "HS116",
        lambda *x: x[10] + x[11] + x[12],
        [0.5, 0.8, 0.9, 0.1, 0.14, 0.5, 489, 80, 650, 450, 150, 150, 150],
        lower=[0.1, 0.1, 0.1, 1e-4, 0.1, 0.1, 0.1, 0.1, 500, 0.1, 1, 1e-4, 1e-4],
        upper=[1, 1, 1, 0.1, 0.9, 0.9, 1000, 1000, 1000, 500, 150, 150, 150],
        inequality=limits,
        optimum=97.5875095581,
        solution=[
            0.803773157377,
            0.899985800673,
            0.970982435484,
            0.1,
            0.190813176216,
            0.460654782852,
            574.077573583,
            74.0775735828,
            500.016160169,
            0.1,
            20.2330906974,
            77.3476899273,
            0.00672893339557,
        ],
    )


def colville_dual() -> NonlinearProgramme:
    """Problem 117: the dual of problem 86."""
    return programme(
        "HS117",
        lambda x: -COLVILLE_B @ x[:10] + x[10:] @ COLVILLE_C @ x[10:] + 2 * COLVILLE_D @ x[10:] ** 3,
        np.where(np.arange(15) == 6, 60, 0.001),
        lower=0,
        inequality=lambda x: 2 * COLVILLE_C @ x[10:] + 3 * COLVILLE_D * x[10:] ** 2 + COLVILLE_E - x[:10] @ COLVILLE_A,
        optimum=32.3486789657,
        solution=[
            0,
            0,
            5.1740407277,
            0,
            3.06110868776,
            11.8395456648,
            0,
            0,
            0.103896190771,
            0,
            0.3,
            0.333467606535,
            0.4,
            0.428310104782,
            0.223964873561,
        ],
    )


def production() -> NonlinearProgramme:
    """Problem 118: three products in five months, a quadratic programme."""
    demand = np.array([60, 50, 70, 85, 100])

    def cost(x):
        made = x.reshape(5, 3)
        return jnp.sum(made @ np.array([2.3, 1.7, 2.2]) + made**2 @ np.array([1e-4, 1e-4, 1.5e-4]))

    def limits(x):
        made = x.reshape(5, 3)
        rise = made[1:] - made[:-1]
        return [(rise + 7).ravel(), (np.array([6, 7, 6]) - rise).ravel(), jnp.sum(made, axis=1) - demand]

    return programme(
        "HS118",
        cost,
        [20, 55, 15, 20, 60, 20, 20, 60, 20, 20, 60, 20, 20, 60, 20],
        lower=[8, 43, 3] + 12 * [0],
        upper=[21, 57, 16] + 4 * [90, 120, 60],
        inequality=limits,
        optimum=664.8204500,
        solution=[8, 49, 3, 1, 56, 0, 1, 63, 6, 3, 70, 12, 5, 77, 18],
    )


def colville_seventh() -> NonlinearProgramme:
    """Problem 119: sixteen variables, eight linear equations."""
    # Row i lists the variables, from 1, whose product with variable i enters the objective.
    joined = [
        [1, 4, 7, 8, 16],
        [2, 3, 7, 10],
        [3, 7, 9, 10, 14],
        [4, 7, 11, 15],
        [5, 6, 10, 12, 16],
        [6, 8, 15],
        [7, 11, 13],
        [8, 10, 15],
        [9, 12, 16],
        [10, 14],
        [11, 13],
        [12, 14],
        [13, 14],
        [14],
        [15],
        [16],
    ]
    a = np.array([np.isin(np.arange(1, 17), row) for row in joined], float)
    left = np.array(
        [
            [0.22, 0.20, 0.19, 0.25, 0.15, 0.11, 0.12, 0.13],
            [-1.46, 0, -1.30, 1.82, -1.15, 0, 0.80, 0],
            [1.29, -0.89, 0, 0, -1.16, -0.96, 0, -0.49],
            [-1.10, -1.06, 0.95, -0.54, 0, -1.78, -0.41, 0],
            [0, 0, 0, -1.43, 1.51, 0.59, -0.33, -0.43],
            [0, -1.72, -0.33, 0, 1.62, 1.24, 0.21, -0.26],
            [1.12, 0, 0, 0.31, 0, 0, 1.12, 0],
            [0, 0.45, 0.26, -1.10, 0.58, 0, -1.03, 0.10],
        ]
    )
    b = np.hstack([left, np.eye(8)])
    b[6, 8] = -0.36
    c = np.array([2.5, 1.1, -3.1, -3.5, 1.3, 2.1, 2.3, -1.5])

    def cost(x):
        y = x**2 + x + 1
        return y @ a @ y

    return programme(
        "HS119",
        cost,
        np.full(16, 10.0),
        lower=0,
        upper=5,
        equality=lambda x: b @ x - c,
        optimum=244.899697517,
        solution=[
            0.0398473514111,
            0.791983155688,
            0.202870330251,
            0.844357916366,
            1.26990645287,
            0.934738707825,
            1.68196196925,
            0.15530087739,
            1.56787033355,
            0,
            0,
            0,
            0.660204066087,
            0,
            0.674255926868,
            0,
        ],
    )


PROBLEMS: tuple[NonlinearProgramme, ...] = (
    wong(),
    alkylation(),
    membranes(),
    colville_dual(),
    production(),
    colville_seventh(),
)
