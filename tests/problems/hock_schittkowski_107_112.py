"""Problems 107 to 112 of Hock and Schittkowski, Test Examples for Nonlinear Programming Codes, 1981."""

import jax.numpy as jnp
import numpy as np

from tests.problems.nonlinear_programme import NonlinearProgramme, programme, spelled_out


def small_network() -> NonlinearProgramme:
    """Problem 107: power flow of least cost, in per unit."""
    c, d = 48.4 / 50.176 * np.sin(0.25), 48.4 / 50.176 * np.cos(0.25)

    def flows(x1, x2, x3, x4, x5, x6, x7, x8, x9):
        y1, y2, y3, y4 = jnp.sin(x8), jnp.cos(x8), jnp.sin(x9), jnp.cos(x9)
        y5, y6 = jnp.sin(x8 - x9), jnp.cos(x8 - x9)
        return [
            0.4 - x1 + 2 * c * x5**2 - x5 * x6 * (d * y1 + c * y2) - x5 * x7 * (d * y3 + c * y4),
            0.4 - x2 + 2 * c * x6**2 + x5 * x6 * (d * y1 - c * y2) + x6 * x7 * (d * y5 - c * y6),
            0.8 + 2 * c * x7**2 + x5 * x7 * (d * y3 - c * y4) - x6 * x7 * (d * y5 + c * y6),
            0.2 - x3 + 2 * d * x5**2 + x5 * x6 * (c * y1 - d * y2) + x5 * x7 * (c * y3 - d * y4),
            0.2 - x4 + 2 * d * x6**2 - x5 * x6 * (c * y1 + d * y2) - x6 * x7 * (c * y5 + d * y6),
            -0.337 + 2 * d * x7**2 - x5 * x7 * (c * y3 + d * y4) + x6 * x7 * (c * y5 - d * y6),
        ]

    free = np.inf
    return spelled_out(
        "HS107",
        lambda x1, x2, x3, x4, x5, x6, x7, x8, x9: 3000 * x1 + 1000 * x1**3 + 2000 * x2 + 666.667 * x2**3,
        [0.8, 0.8, 0.2, 0.2, 1.0454, 1.0454, 1.0454, 0, 0],
        lower=[0, 0, -free, -free, 0.90909, 0.90909, 0.90909, -free, -free],
        upper=[free, free, free, free, 1.0909, 1.0909, 1.0909, free, free],
        equality=flows,
        optimum=5055.01180354,
        solution=[
            0.667012762315,
            1.02238471705,
            0.228287144668,
            0.18482175613,
            1.0909,
            1.0909,
            1.06903600314,
            0.106610622407,
            -0.33878761907,
        ],
    )


def large_network() -> NonlinearProgramme:
    """Problem 109: power flow of least cost, in volts and watts."""
    a, b, c = 50.176, np.sin(0.25), np.cos(0.25)

    def flows(x1, x2, x3, x4, x5, x6, x7, x8, x9):
        def sine(angle):
            return jnp.sin(angle - 0.25)

        def cosine(angle):
            return jnp.cos(angle - 0.25)

        def shunt(volts):
            return 2 * c * volts**2 - 0.7533e-3 * a * volts**2

        return [
            x5 * x6 * sine(-x3) + x5 * x7 * sine(-x4) + 2 * b * x5**2 - a * x1 + 400 * a,
            x5 * x6 * sine(x3) + x6 * x7 * sine(x3 - x4) + 2 * b * x6**2 - a * x2 + 400 * a,
            x5 * x7 * sine(x4) + x6 * x7 * sine(x4 - x3) + 2 * b * x7**2 + 881.779 * a,
            a * x8 + x5 * x6 * cosine(-x3) + x5 * x7 * cosine(-x4) - 200 * a - shunt(x5),
            a * x9 + x5 * x6 * cosine(x3) + x6 * x7 * cosine(x3 - x4) - 200 * a - shunt(x6),
            x5 * x7 * cosine(x4) + x6 * x7 * cosine(x4 - x3) - 22.938 * a - shunt(x7),
        ]

    # The source prints 5362.06928 at a point that misses its constraints by 0.02.
    return spelled_out(
        "HS109",
        lambda x1, x2, x3, x4, x5, x6, x7, x8, x9: 3 * x1 + 1e-6 * x1**3 + 2 * x2 + 0.522074e-6 * x2**3,
        np.zeros(9),
        lower=[0, 0, -0.55, -0.55, 196, 196, 196, -400, -400],
        upper=[np.inf, np.inf, 0.55, 0.55, 252, 252, 252, 800, 800],
        equality=flows,
        inequality=lambda x1, x2, x3, x4, x5, x6, x7, x8, x9: [
            x4 - x3 + 0.55,
            x3 - x4 + 0.55,
            2250000 - x1**2 - x8**2,
            2250000 - x2**2 - x9**2,
        ],
        optimum=5362.06918111,
        solution=[
            675.0253392597,
            1134.021089715,
            0.1334850509183,
            -0.3711902626478,
            252,
            252,
            201.4658577338,
            426.6190056621,
            368.4881990875,
        ],
    )


def largest_hexagon() -> NonlinearProgramme:
    """Problem 108: the hexagon of largest area whose corners are at most 1 apart."""

    def area(x1, x2, x3, x4, x5, x6, x7, x8, x9):
        return 0.5 * (x1 * x4 - x2 * x3 + x3 * x9 - x5 * x9 + x5 * x8 - x6 * x7)

    def limits(x1, x2, x3, x4, x5, x6, x7, x8, x9):
        return [
            1 - x3**2 - x4**2,
            1 - x9**2,
            1 - x5**2 - x6**2,
            1 - x1**2 - (x2 - x9) ** 2,
            1 - (x1 - x5) ** 2 - (x2 - x6) ** 2,
            1 - (x1 - x7) ** 2 - (x2 - x8) ** 2,
            1 - (x3 - x5) ** 2 - (x4 - x6) ** 2,
            1 - (x3 - x7) ** 2 - (x4 - x8) ** 2,
            1 - x7**2 - (x8 - x9) ** 2,
            x1 * x4 - x2 * x3,
            x3 * x9,
            -x5 * x9,
            x5 * x8 - x6 * x7,
        ]

    return spelled_out(
        "HS108",
        lambda *x: -area(*x),
        np.ones(9),
        lower=[-np.inf] * 8 + [0],
        inequality=limits,
        optimum=-np.sqrt(3) / 2,
        solution=[
            0.884152334342,
            0.467198726109,
            0.0374702017453,
            0.99929774541,
            0.884152334342,
            0.467198726109,
            0.0374702017453,
            0.99929774541,
            0,
        ],
    )


def equilibrium() -> tuple[NonlinearProgramme, ...]:
    """Problems 110 to 112: bounds only; chemical equilibrium in logarithms of amounts, and in amounts."""
    c = np.array([-6.089, -17.164, -34.054, -5.914, -24.721, -14.986, -24.1, -10.708, -26.662, -22.179])

    def energy(amounts, logarithms):
        return amounts @ (c + logarithms - jnp.log(jnp.sum(amounts)))

    def elements(x1, x2, x3, x4, x5, x6, x7, x8, x9, x10):
        return [x1 + 2 * x2 + 2 * x3 + x6 + x10 - 2, x4 + 2 * x5 + x6 + x7 - 1, x3 + x7 + x8 + 2 * x9 + x10 - 1]

    return (
        programme(
            "HS110",
            lambda x: jnp.sum(jnp.log(x - 2) ** 2 + jnp.log(10 - x) ** 2) - jnp.prod(x) ** 0.2,
            np.full(10, 9.0),
            lower=2.001,
            upper=9.999,
            optimum=-45.7784697074,
            solution=np.full(10, 9.35026583307),
        ),
        programme(
            "HS111",
            lambda x: energy(jnp.exp(x), x),
            np.full(10, -2.3),
            lower=-100,
            upper=100,
            equality=lambda x: elements(*jnp.exp(x)),
            optimum=-47.7610908594,
            solution=[
                -3.20231158855,
                -1.91236659708,
                -0.24442674775,
                -6.56117727166,
                -0.723097963295,
                -7.27423228019,
                -3.59723742233,
                -4.02031673069,
                -3.28837688136,
                -2.33437173922,
            ],
        ),
        # The source prints -47.707579, which is not yet the minimum; problem 111 is the same and has it.
        programme(
            "HS112",
            lambda x: energy(x, jnp.log(x)),
            np.full(10, 0.1),
            lower=1e-6,
            equality=lambda x: elements(*x),
            optimum=-47.7610908594,
            solution=[
                0.0406680873557,
                0.147730354341,
                0.783153354009,
                0.00141421980903,
                0.485246648699,
                0.000693172078421,
                0.027399310714,
                0.0179472795849,
                0.037314365913,
                0.0968713238658,
            ],
        ),
    )


PROBLEMS: tuple[NonlinearProgramme, ...] = (small_network(), largest_hexagon(), large_network(), *equilibrium())
