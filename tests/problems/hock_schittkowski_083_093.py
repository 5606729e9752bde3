"""Problems 83 to 93 of Hock and Schittkowski, Test Examples for Nonlinear Programming Codes, 1981.

Left out: 85 (a long table of a wood-pulp plant) and 87 (its objective has jumps); there is no 82.
"""

import jax.numpy as jnp
import numpy as np

from tests.problems.nonlinear_programme import NonlinearProgramme, programme, spelled_out

# Data of problem 86, and of its dual, problem 117: Colville's first and second problems.
COLVILLE_A = np.array(
    [
        [-16, 2, 0, 1, 0],
        [0, -2, 0, 4, 2],
        [-3.5, 0, 2, 0, 0],
        [0, -2, 0, -4, -1],
        [0, -9, -2, 1, -2.8],
        [2, 0, -4, 0, 0],
        [-1, -1, -1, -1, -1],
        [-1, -2, -3, -2, -1],
        [1, 2, 3, 4, 5],
        [1, 1, 1, 1, 1],
    ]
)
COLVILLE_B = np.array([-40, -2, -0.25, -4, -4, -1, -40, -60, 5, 1])
COLVILLE_C = np.array(
    [
        [30, -20, -10, 32, -10],
        [-20, 39, -6, -31, 32],
        [-10, -6, 10, -6, -10],
        [32, -31, -6, 39, -20],
        [-10, 32, -10, -20, 30],
    ]
)
COLVILLE_D = np.array([4, 8, 10, 6, 2])
COLVILLE_E = np.array([-15, -27, -36, -18, -12])


def five_variables() -> tuple[NonlinearProgramme, ...]:
    """Problems 83, 84 and 86."""

    def balances(x1, x2, x3, x4, x5):
        first = 85.334407 + 0.0056858 * x2 * x5 + 0.0006262 * x1 * x4 - 0.0022053 * x3 * x5
        second = 80.51249 + 0.0071317 * x2 * x5 + 0.0029955 * x1 * x2 + 0.0021813 * x3**2
        third = 9.300961 + 0.0047026 * x3 * x5 + 0.0012547 * x1 * x3 + 0.0019085 * x3 * x4
        return [first, second - 90, third - 20, 92 - first, 110 - second, 25 - third]

    def crop(x1, x2, x3, x4, x5):
        factors = jnp.stack([jnp.ones_like(x1), x2, x3, x4, x5])
        rows = np.array(
            [
                [-145421.402, 2931.1506, -40.427932, 5106.192, 15711.36],
                [-155011.1084, 4360.53352, 12.9492344, 10236.884, 13176.786],
                [-326669.5104, 7390.68412, -27.8986976, 16643.076, 30988.146],
            ]
        )
        made = x1 * (rows @ factors)
        return [made, np.array([294000, 294000, 277200]) - made]

    return (
        spelled_out(
            "HS83",
            lambda x1, x2, x3, x4, x5: 5.3578547 * x3**2 + 0.8356891 * x1 * x5 + 37.293239 * x1 - 40792.141,
            [78, 33, 27, 27, 27],
            lower=[78, 33, 27, 27, 27],
            upper=[102, 45, 45, 45, 45],
            inequality=balances,
            optimum=-30665.5386718,
            solution=[78, 33, 29.9952560257, 45, 36.7758129058],
        ),
        spelled_out(
            "HS84",
            lambda x1, x2, x3, x4, x5: (
                24345 - x1 * (-8720288.849 + 150512.5253 * x2 - 156.6950325 * x3 + 476470.3222 * x4 + 729482.8271 * x5)
            ),
            [2.52, 2, 37.5, 9.25, 6.8],
            lower=[0, 1.2, 20, 9, 6.5],
            upper=[1000, 2.4, 60, 9.3, 7],
            inequality=crop,
            optimum=-5280335.13321,
            solution=[4.537430974655, 2.4, 60, 9.3, 7],
        ),
        programme(
            "HS86",
            lambda x: COLVILLE_E @ x + x @ COLVILLE_C @ x + COLVILLE_D @ x**3,
            [0, 0, 0, 0, 1],
            lower=0,
            inequality=lambda x: COLVILLE_A @ x - COLVILLE_B,
            optimum=-32.3486789657,
            solution=[0.3, 0.333467606535, 0.4, 0.428310104782, 0.223964873561],
        ),
    )


def heat_conduction(n, solution) -> NonlinearProgramme:
    """Problems 88 to 92: bang-bang heating with n switches, to within 0.01 of a given temperature (in the mean)."""
    mu = np.pi * np.arange(30) + 1e-9
    for _ in range(60):
        mu = np.pi * np.arange(30) + np.arctan(1 / mu)  # mu tan(mu) = 1
    a = 2 * np.sin(mu) / (mu + np.sin(mu) * np.cos(mu))
    linear = 2 * a * (np.cos(mu) - np.sin(mu) / mu)
    # Integral of cos(mu_i s) cos(mu_j s) over 0 < s < 1; numpy's sinc(x) is sin(pi x) / (pi x).
    total, difference = (mu[:, None] + mu) / np.pi, (mu[:, None] - mu) / np.pi
    quadratic = np.outer(a * mu**2, a * mu**2) * (np.sinc(total) + np.sinc(difference)) / 2
    signs = 2 * (-1.0) ** np.arange(n)
    signs[0] = 1

    def error(x):
        tails = jnp.cumsum(x[::-1] ** 2)[::-1]
        rho = -(jnp.exp(-jnp.outer(mu**2, tails)) @ signs + (-1) ** n) / mu**2
        return [1e-4 - 2 / 15 - linear @ rho - rho @ quadratic @ rho]

    return programme(
        f"HS{86 + n}",
        lambda x: x @ x,
        0.5 * (-1.0) ** np.arange(n),
        inequality=error,
        optimum=1.36265681488,
        solution=solution,
    )


def transformer() -> NonlinearProgramme:
    """Problem 93: a transformer of least cost."""

    def sizes(x1, x2, x3, x4):
        return x1 * x4 * (x1 + x2 + x3), x2 * x3 * (x1 + 1.57 * x2 + x4)

    def cost(x1, x2, x3, x4, x5, x6):
        core, coil = sizes(x1, x2, x3, x4)
        return 0.0204 * core + 0.0187 * coil + 0.0607 * core * x5**2 + 0.0437 * coil * x6**2

    def rating(x1, x2, x3, x4, x5, x6):
        core, coil = sizes(x1, x2, x3, x4)
        return [0.001 * x1 * x2 * x3 * x4 * x5 * x6 - 2.07, 1 - 0.00062 * core * x5**2 - 0.00058 * coil * x6**2]

    return spelled_out(
        "HS93",
        cost,
        [5.54, 4.4, 12.02, 11.82, 0.702, 0.852],
        lower=0,
        inequality=rating,
        optimum=135.07596283,
        solution=[5.33266633553, 4.65674405917, 10.4329919405, 12.0823063401, 0.752607436224, 0.878650874659],
    )


PROBLEMS: tuple[NonlinearProgramme, ...] = (
    *five_variables(),
    heat_conduction(2, solution=[-1.0743187312, -0.456613708375]),
    heat_conduction(3, solution=[1.0743187312, 0.456613708375, 0]),
    heat_conduction(4, solution=[1.0743187312, -0.0780095403837, 0, -0.449900644904]),
    heat_conduction(5, solution=[-0.586433979576, 0, -0.900142168667, 0.456613708375, 0]),
    heat_conduction(6, solution=[1.0743187312, -0.453517127431, 0, -0.00139776418372, 0, 0.0530692006518]),
    transformer(),
)
