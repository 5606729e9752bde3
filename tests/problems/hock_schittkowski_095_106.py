"""Problems 95 to 106 of Hock and Schittkowski, Test Examples for Nonlinear Programming Codes, 1981.

Left out: 105 (a table of 235 numbers with which the printed optimum could not be reproduced).
"""

import jax.numpy as jnp
import numpy as np

from tests.problems.nonlinear_programme import NonlinearProgramme, programme, spelled_out


def four_limits(name, limits, optimum, solution) -> NonlinearProgramme:
    """Problems 95 to 98: one set of four constraints with four right-hand sides."""

    def constraints(x1, x2, x3, x4, x5, x6):
        return [
            17.1 * x1
            + 38.2 * x2
            + 204.2 * x3
            + 212.3 * x4
            + 623.4 * x5
            + 1495.5 * x6
            - 169 * x1 * x3
            - 3580 * x3 * x5
            - 3810 * x4 * x5
            - 18500 * x4 * x6
            - 24300 * x5 * x6
            - limits[0],
            17.9 * x1
            + 36.8 * x2
            + 113.9 * x3
            + 169.7 * x4
            + 337.8 * x5
            + 1385.2 * x6
            - 139 * x1 * x3
            - 2450 * x4 * x5
            - 16600 * x4 * x6
            - 17200 * x5 * x6
            - limits[1],
            -273 * x2 - 70 * x4 - 819 * x5 + 26000 * x4 * x5 - limits[2],
            159.9 * x1 - 311 * x2 + 587 * x4 + 391 * x5 + 2198 * x6 - 14000 * x1 * x6 - limits[3],
        ]

    return spelled_out(
        name,
        lambda x1, x2, x3, x4, x5, x6: 4.3 * x1 + 31.8 * x2 + 63.3 * x3 + 15.8 * x4 + 68.5 * x5 + 4.7 * x6,
        np.zeros(6),
        lower=0,
        upper=[0.31, 0.046, 0.068, 0.042, 0.028, 0.0134],
        inequality=constraints,
        optimum=optimum,
        solution=solution,
    )


def rocket() -> NonlinearProgramme:
    """Problem 99: angles of thrust in seven stages, for the greatest horizontal velocity at the end."""
    thrust = np.array([50, 50, 75, 75, 75, 100, 100])
    stage = np.diff([0, 25, 50, 100, 150, 200, 290, 380])

    def final_state(x):
        climb = stage * (thrust * jnp.sin(x) - 32)
        before = jnp.cumsum(climb) - climb
        return [jnp.sum(stage * (0.5 * climb + before)) - 1e5, jnp.sum(climb) - 1e3]

    return programme(
        "HS99",
        lambda x: -(jnp.sum(thrust * stage * jnp.cos(x)) ** 2),
        np.full(7, 0.5),
        lower=0,
        upper=1.58,
        equality=final_state,
        optimum=-831079891.51,
        solution=[
            0.542467816212317,
            0.529021424201977,
            0.5084491553164,
            0.480268850961816,
            0.451236349796647,
            0.409183082420985,
            0.352787891781123,
        ],
    )


def posynomial(coefficients, exponents):
    """Sum of coefficient times the product of powers of x, one row of exponents for each term."""
    c, e = np.asarray(coefficients), np.asarray(exponents)
    return lambda x: jnp.sum(c * jnp.prod(x**e, axis=1))


def geometric(name, a, optimum, solution) -> NonlinearProgramme:
    """Problems 101 to 103: one geometric programme with three exponents."""
    cost = posynomial(
        [10, 15, 20, 25],
        [[1, -1, 0, 2, 0, -3, a], [-1, -2, 1, 1, -1, 0, -0.5], [-2, 1, 0, -1, -2, 1, 0], [2, 2, -1, 0, 0.5, -2, 1]],
    )
    first = posynomial(
        [0.5, 0.7, 0.2], [[0.5, 0, -1, 0, 0, -2, 1], [3, 1, -2, 0, 0, 1, 0.5], [0, -1, 1, -0.5, 0, 2 / 3, 0.25]]
    )
    second = posynomial(
        [1.3, 0.8, 3.1], [[-0.5, 1, -1, 0, -1, 1, 0], [0, 0, 1, -1, -1, 2, 0], [-1, 0.5, 0, -2, -1, 1 / 3, 0]]
    )
    third = posynomial(
        [2, 0.1, 1, 0.65],
        [
            [1, 0, -1.5, 0, 1, -1, 1 / 3],
            [0, 1, -0.5, 0, 1, -1, -0.5],
            [-1, 1, 0.5, 0, 1, 0, 0],
            [0, -2, 1, 0, 1, -1, 1],
        ],
    )
    fourth = posynomial(
        [0.2, 0.3, 0.4, 0.5],
        [
            [-2, 1, 0, -1, 0.5, 0, 1 / 3],
            [0.5, 2, 1, 1 / 3, -2 / 3, 0, 0.25],
            [-3, -2, 1, 0, 1, 0, 0.75],
            [0, 0, -2, 1, 0, 0, 0.5],
        ],
    )
    return programme(
        name,
        cost,
        np.full(7, 6.0),
        lower=[0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.01],
        upper=10,
        inequality=lambda x: [1 - first(x), 1 - second(x), 1 - third(x), 1 - fourth(x), cost(x) - 100, 3000 - cost(x)],
        optimum=optimum,
        solution=solution,
    )


def seven_and_eight_variables() -> tuple[NonlinearProgramme, ...]:
    """Problems 100, 104 and 106."""

    def reactors(x1, x2, x3, x4, x5, x6, x7, x8):
        return 0.4 * (x1 / x7) ** 0.67 + 0.4 * (x2 / x8) ** 0.67 + 10 - x1 - x2

    return (
        spelled_out(
            "HS100",
            lambda x1, x2, x3, x4, x5, x6, x7: (
                (x1 - 10) ** 2
                + 5 * (x2 - 12) ** 2
                + x3**4
                + 3 * (x4 - 11) ** 2
                + 10 * x5**6
                + 7 * x6**2
                + x7**4
                - 4 * x6 * x7
                - 10 * x6
                - 8 * x7
            ),
            [1, 2, 0, 4, 0, 1, 1],
            inequality=lambda x1, x2, x3, x4, x5, x6, x7: [
                127 - 2 * x1**2 - 3 * x2**4 - x3 - 4 * x4**2 - 5 * x5,
                282 - 7 * x1 - 3 * x2 - 10 * x3**2 - x4 + x5,
                196 - 23 * x1 - x2**2 - 6 * x6**2 + 8 * x7,
                -4 * x1**2 - x2**2 + 3 * x1 * x2 - 2 * x3**2 - 5 * x6 + 11 * x7,
            ],
            optimum=680.630057374,
            solution=[
                2.33049937288,
                1.9513723729,
                -0.477541392389,
                4.36572623366,
                -0.624486970527,
                1.03813101861,
                1.59422671161,
            ],
        ),
        spelled_out(
            "HS104",
            reactors,
            [6, 3, 0.4, 0.2, 6, 6, 1, 0.5],
            lower=0.1,
            upper=10,
            inequality=lambda x1, x2, x3, x4, x5, x6, x7, x8: [
                1 - 0.0588 * x5 * x7 - 0.1 * x1,
                1 - 0.0588 * x6 * x8 - 0.1 * x1 - 0.1 * x2,
                1 - 4 * x3 / x5 - 2 * x3**-0.71 / x5 - 0.0588 * x3**-1.3 * x7,
                1 - 4 * x4 / x6 - 2 * x4**-0.71 / x6 - 0.0588 * x4**-1.3 * x8,
                reactors(x1, x2, x3, x4, x5, x6, x7, x8) - 1,
                4.2 - reactors(x1, x2, x3, x4, x5, x6, x7, x8),
            ],
            optimum=3.9511634401,
            solution=[
                6.46511402837,
                2.23270864799,
                0.667397491287,
                0.5957564229,
                5.93267567791,
                5.52723456498,
                1.0133220089,
                0.400668229126,
            ],
        ),
        # The source prints 7049.330923, which is not yet the minimum.
        spelled_out(
            "HS106",
            lambda x1, x2, x3, x4, x5, x6, x7, x8: x1 + x2 + x3,
            [5000, 5000, 5000, 200, 350, 150, 225, 425],
            lower=[100, 1000, 1000, 10, 10, 10, 10, 10],
            upper=[1e4, 1e4, 1e4, 1000, 1000, 1000, 1000, 1000],
            inequality=lambda x1, x2, x3, x4, x5, x6, x7, x8: [
                1 - 0.0025 * (x4 + x6),
                1 - 0.0025 * (x5 + x7 - x4),
                1 - 0.01 * (x8 - x5),
                x1 * x6 - 833.33252 * x4 - 100 * x1 + 83333.333,
                x2 * x7 - 1250 * x5 - x2 * x4 + 1250 * x4,
                x3 * x8 - 1250000 - x3 * x5 + 2500 * x5,
            ],
            optimum=7049.24802053,
            solution=[
                579.30668442536,
                1359.9706680517,
                5109.9706680517,
                182.01769958112,
                295.60117327793,
                217.98230041888,
                286.41652630319,
                395.60117327793,
            ],
        ),
    )


PROBLEMS: tuple[NonlinearProgramme, ...] = (
    # The source prints 0.015619514, at a point below the bounds by 1e-9.
    four_limits(
        "HS95", [4.97, -1.88, -29.08, -78.02], optimum=0.0156195252424, solution=[0, 0, 0, 0, 0, 0.00332330324306]
    ),
    four_limits(
        "HS96", [4.97, -1.88, -69.08, -118.02], optimum=0.0156195252424, solution=[0, 0, 0, 0, 0, 0.00332330324306]
    ),
    four_limits(
        "HS97", [32.97, 25.12, -29.08, -78.02], optimum=3.13580912281, solution=[0.268564912281, 0, 0, 0, 0.028, 0.0134]
    ),
    four_limits(
        "HS98",
        [32.97, 25.12, -124.08, -173.02],
        optimum=3.13580912281,
        solution=[0.268564912281, 0, 0, 0, 0.028, 0.0134],
    ),
    rocket(),
    *seven_and_eight_variables(),
    geometric(
        "HS101",
        -0.25,
        optimum=1809.76476557,
        solution=[
            2.85615855576,
            0.610823030803,
            2.15081256216,
            4.71287370924,
            0.999487540857,
            1.34750750483,
            0.0316527665028,
        ],
    ),
    geometric(
        "HS102",
        0.125,
        optimum=911.880571426,
        solution=[
            3.89625319107,
            0.809358760105,
            2.66438599378,
            4.30091287479,
            0.853554935249,
            1.09528744458,
            0.0273104596577,
        ],
    ),
    geometric(
        "HS103",
        0.5,
        optimum=543.667958468,
        solution=[
            4.39410451053,
            0.854468738797,
            2.84323031395,
            3.39997866769,
            0.722926133007,
            0.870406381804,
            0.0246388263272,
        ],
    ),
)
