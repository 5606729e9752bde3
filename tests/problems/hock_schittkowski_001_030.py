"""Problems 1 to 30 of Hock and Schittkowski, Test Examples for Nonlinear Programming Codes, 1981."""

import jax.numpy as jnp
import numpy as np

from tests.problems.nonlinear_programme import NonlinearProgramme, programme, spelled_out

# f of problems 1, 2, 15 to 17 and 20: Rosenbrock's valley.


def rosenbrock(x1, x2):
    return 100 * (x2 - x1**2) ** 2 + (1 - x1) ** 2


def bounds_only() -> tuple[NonlinearProgramme, ...]:
    """Problems 1 to 5 and 25: bounds at most."""
    level = 0.01 * np.arange(1, 100)
    u = 25 + (-50 * np.log(level)) ** (2 / 3)
    return (
        spelled_out("HS1", rosenbrock, [-2, 1], lower=[-np.inf, -1.5], optimum=0, solution=[1, 1]),
        # A second, local, minimum of 4.941229318 lies at (-1.2210, 1.5), on the side of the start.
        spelled_out(
            "HS2", rosenbrock, [-2, 1], lower=[-np.inf, 1.5], optimum=0.0504261878936, solution=[1.22437074874, 1.5]
        ),
        spelled_out(
            "HS3", lambda x1, x2: x2 + 1e-5 * (x2 - x1) ** 2, [10, 1], lower=[-np.inf, 0], optimum=0, solution=[0, 0]
        ),
        spelled_out(
            "HS4", lambda x1, x2: (x1 + 1) ** 3 / 3 + x2, [1.125, 0.125], lower=[1, 0], optimum=8 / 3, solution=[1, 0]
        ),
        spelled_out(
            "HS5",
            lambda x1, x2: jnp.sin(x1 + x2) + (x1 - x2) ** 2 - 1.5 * x1 + 2.5 * x2 + 1,
            [0, 0],
            lower=[-1.5, -3],
            upper=[4, 3],
            optimum=-np.sqrt(3) / 2 - np.pi / 3,
            solution=[0.5 - np.pi / 3, -0.5 - np.pi / 3],
        ),
        # f is flat at the start, where many methods stop at once.
        programme(
            "HS25",
            lambda x: jnp.sum((jnp.exp(-((u - x[1]) ** x[2]) / x[0]) - level) ** 2),
            [100, 12.5, 3],
            lower=[0.1, 0, 0],
            upper=[100, 25.6, 5],
            optimum=0,
            solution=[50, 25, 1.5],
        ),
    )


def equalities() -> tuple[NonlinearProgramme, ...]:
    """Problems 6 to 9 and 26 to 28: equations only."""
    x8 = np.sqrt((25 + np.sqrt(301)) / 2)
    return (
        spelled_out(
            "HS6",
            lambda x1, x2: (1 - x1) ** 2,
            [-1.2, 1],
            equality=lambda x1, x2: [10 * (x2 - x1**2)],
            optimum=0,
            solution=[1, 1],
        ),
        spelled_out(
            "HS7",
            lambda x1, x2: jnp.log(1 + x1**2) - x2,
            [2, 2],
            equality=lambda x1, x2: [(1 + x1**2) ** 2 + x2**2 - 4],
            optimum=-np.sqrt(3),
            solution=[0, np.sqrt(3)],
        ),
        # Two equations in two variables: nothing is left to minimise; three more solutions by symmetry.
        spelled_out(
            "HS8",
            lambda x1, x2: -1 + 0 * x1,
            [2, 1],
            equality=lambda x1, x2: [x1**2 + x2**2 - 25, x1 * x2 - 9],
            optimum=-1,
            solution=[x8, 9 / x8],
        ),
        # Minima repeat at (12 k - 3, 16 k - 4).
        spelled_out(
            "HS9",
            lambda x1, x2: jnp.sin(np.pi * x1 / 12) * jnp.cos(np.pi * x2 / 16),
            [0, 0],
            equality=lambda x1, x2: [4 * x1 - 3 * x2],
            optimum=-0.5,
            solution=[-3, -4],
        ),
        spelled_out(
            "HS26",
            lambda x1, x2, x3: (x1 - x2) ** 2 + (x2 - x3) ** 4,
            [-2.6, 2, 2],
            equality=lambda x1, x2, x3: [(1 + x2**2) * x1 + x3**4 - 3],
            optimum=0,
            solution=[1, 1, 1],
        ),
        spelled_out(
            "HS27",
            lambda x1, x2, x3: 0.01 * (x1 - 1) ** 2 + (x2 - x1**2) ** 2,
            [2, 2, 2],
            equality=lambda x1, x2, x3: [x1 + x3**2 + 1],
            optimum=0.04,
            solution=[-1, 1, 0],
        ),
        spelled_out(
            "HS28",
            lambda x1, x2, x3: (x1 + x2) ** 2 + (x2 + x3) ** 2,
            [-4, 1, 1],
            equality=lambda x1, x2, x3: [x1 + 2 * x2 + 3 * x3 - 1],
            optimum=0,
            solution=[0.5, -0.5, 0.5],
        ),
    )


def inequalities() -> tuple[NonlinearProgramme, ...]:
    """Problems 10 to 24, 29 and 30: inequalities, one equation in problem 14."""
    return (
        spelled_out(
            "HS10",
            lambda x1, x2: x1 - x2,
            [-10, 10],
            inequality=lambda x1, x2: [-3 * x1**2 + 2 * x1 * x2 - x2**2 + 1],
            optimum=-1,
            solution=[0, 1],
        ),
        spelled_out(
            "HS11",
            lambda x1, x2: (x1 - 5) ** 2 + x2**2 - 25,
            [4.9, 0.1],
            inequality=lambda x1, x2: [x2 - x1**2],
            optimum=-8.49846422313,
            solution=[1.23477282505, 1.52466392949],
        ),
        spelled_out(
            "HS12",
            lambda x1, x2: 0.5 * x1**2 + x2**2 - x1 * x2 - 7 * x1 - 7 * x2,
            [0, 0],
            inequality=lambda x1, x2: [25 - 4 * x1**2 - x2**2],
            optimum=-30,
            solution=[2, 3],
        ),
        # No constraint qualification holds at the solution: there are no multipliers.
        spelled_out(
            "HS13",
            lambda x1, x2: (x1 - 2) ** 2 + x2**2,
            [-2, -2],
            lower=0,
            inequality=lambda x1, x2: [(1 - x1) ** 3 - x2],
            optimum=1,
            solution=[1, 0],
        ),
        spelled_out(
            "HS14",
            lambda x1, x2: (x1 - 2) ** 2 + (x2 - 1) ** 2,
            [2, 2],
            equality=lambda x1, x2: [x1 - 2 * x2 + 1],
            inequality=lambda x1, x2: [1 - x1**2 / 4 - x2**2],
            optimum=9 - 2.875 * np.sqrt(7),
            solution=[(np.sqrt(7) - 1) / 2, (np.sqrt(7) + 1) / 4],
        ),
        # A second, local, minimum of 360.379767 lies at (-0.7921, -1.2624).
        spelled_out(
            "HS15",
            rosenbrock,
            [-2, 1],
            upper=[0.5, np.inf],
            inequality=lambda x1, x2: [x1 * x2 - 1, x1 + x2**2],
            optimum=306.5,
            solution=[0.5, 2],
        ),
        # A second, local, minimum of 23.14466094 attracts many methods from this start.
        spelled_out(
            "HS16",
            rosenbrock,
            [-2, 1],
            lower=[-0.5, -np.inf],
            upper=[0.5, 1],
            inequality=lambda x1, x2: [x1 + x2**2, x1**2 + x2],
            optimum=0.25,
            solution=[0.5, 0.25],
        ),
        spelled_out(
            "HS17",
            rosenbrock,
            [-2, 1],
            lower=[-0.5, -np.inf],
            upper=[0.5, 1],
            inequality=lambda x1, x2: [x2**2 - x1, x1**2 - x2],
            optimum=1,
            solution=[0, 0],
        ),
        spelled_out(
            "HS18",
            lambda x1, x2: 0.01 * x1**2 + x2**2,
            [2, 2],
            lower=[2, 0],
            upper=50,
            inequality=lambda x1, x2: [x1 * x2 - 25, x1**2 + x2**2 - 25],
            optimum=5,
            solution=[np.sqrt(250), np.sqrt(2.5)],
        ),
        # The source prints -6961.81381, right to eight digits.
        spelled_out(
            "HS19",
            lambda x1, x2: (x1 - 10) ** 3 + (x2 - 20) ** 3,
            [20.1, 5.84],
            lower=[13, 0],
            upper=100,
            inequality=lambda x1, x2: [(x1 - 5) ** 2 + (x2 - 5) ** 2 - 100, 82.81 - (x2 - 5) ** 2 - (x1 - 6) ** 2],
            optimum=-6961.81387558,
            solution=[14.095, 0.842960789215],
        ),
        # A second, local, minimum of 40.19872981 attracts many methods from this start.
        spelled_out(
            "HS20",
            rosenbrock,
            [-2, 1],
            lower=[-0.5, -np.inf],
            upper=[0.5, np.inf],
            inequality=lambda x1, x2: [x1 + x2**2, x1**2 + x2, x1**2 + x2**2 - 1],
            optimum=81.5 - 25 * np.sqrt(3),
            solution=[0.5, np.sqrt(3) / 2],
        ),
        spelled_out(
            "HS21",
            lambda x1, x2: 0.01 * x1**2 + x2**2 - 100,
            [-1, -1],
            lower=[2, -50],
            upper=50,
            inequality=lambda x1, x2: [10 * x1 - x2 - 10],
            optimum=-99.96,
            solution=[2, 0],
        ),
        spelled_out(
            "HS22",
            lambda x1, x2: (x1 - 2) ** 2 + (x2 - 1) ** 2,
            [2, 2],
            inequality=lambda x1, x2: [2 - x1 - x2, x2 - x1**2],
            optimum=1,
            solution=[1, 1],
        ),
        spelled_out(
            "HS23",
            lambda x1, x2: x1**2 + x2**2,
            [3, 1],
            lower=-50,
            upper=50,
            inequality=lambda x1, x2: [x1 + x2 - 1, x1**2 + x2**2 - 1, 9 * x1**2 + x2**2 - 9, x1**2 - x2, x2**2 - x1],
            optimum=2,
            solution=[1, 1],
        ),
        spelled_out(
            "HS24",
            lambda x1, x2: ((x1 - 3) ** 2 - 9) * x2**3 / (27 * np.sqrt(3)),
            [1, 0.5],
            lower=0,
            inequality=lambda x1, x2: [x1 / np.sqrt(3) - x2, x1 + np.sqrt(3) * x2, 6 - x1 - np.sqrt(3) * x2],
            optimum=-1,
            solution=[3, np.sqrt(3)],
        ),
        spelled_out(
            "HS29",
            lambda x1, x2, x3: -x1 * x2 * x3,
            [1, 1, 1],
            inequality=lambda x1, x2, x3: [48 - x1**2 - 2 * x2**2 - 4 * x3**2],
            optimum=-16 * np.sqrt(2),
            solution=[4, 2 * np.sqrt(2), 2],
        ),
        spelled_out(
            "HS30",
            lambda x1, x2, x3: x1**2 + x2**2 + x3**2,
            [1, 1, 1],
            lower=[1, -10, -10],
            upper=10,
            inequality=lambda x1, x2, x3: [x1**2 + x2**2 - 1],
            optimum=1,
            solution=[1, 0, 0],
        ),
    )


PROBLEMS: tuple[NonlinearProgramme, ...] = bounds_only() + equalities() + inequalities()
