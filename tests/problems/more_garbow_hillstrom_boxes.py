"""Moré, Garbow and Hillstrom's problems within bounds that most of their solutions do not respect."""

from collections.abc import Iterator

import numpy as np

from problems.more_garbow_hillstrom import Problem

# Least sums of squares found in the two boxes, by SciPy's trf and dogbox from the start and four random points at
# tolerances of 1e-14, and by the solver under test.
_SQUARES = {
    "Rosenbrock": (2.89953743743, 3.9899748106),
    "Freudenstein and Roth": (94.5227479939, 90.0305997427),
    "Powell badly scaled": (0.0497127201956, 0.018275061096),
    "Brown badly scaled": (999997000003.0, 999996000005.0),
    "Beale": (3.55078125, 14.203125),
    "Jennrich and Sampson": (124.362182356, 4171.30616196),
    "helical valley": (1065.07864376, 226.0),
    "Bard": (4.63149710254, 10.1058406321),
    "Gaussian": (1.12793276962e-08, 2.58427683247e-06),
    "Meyer": (516.045716818, 16779.8743888),
    "Gulf": (0.633298899598, 0.575534882528),
    "Box": (186.293101714, 1021.65538267),
    "Powell singular": (16.6032362502, 23.9240932872),
    "Wood": (1539.375, 42.0),
    "Kowalik and Osborne": (0.000307505603849, 0.00211544320244),
    "Brown and Dennis": (887026.9201, 7222716.28741),
    "Osborne 1": (5.46489469748e-05, 0.129044766947),
    "Biggs": (0.243725663388, 0.142345188967),
    "Osborne 2": (0.09555070363, 1.20034938971),
    "Watson 6": (1.27139842758, 0.0137699383397),
    "Watson 9": (1.16069935273, 0.000121920197012),
    "Watson 12": (1.13748458775, 9.66402641148e-07),
    "extended Rosenbrock 8": (11.5981497497, 15.9598992424),
    "extended Powell singular 8": (33.2064725004, 47.8481865744),
    "penalty I 4": (52.562515, 885.06264),
    "penalty I 10": (9216.0005125, 148032.56535),
    "penalty II 4": (9.37629300736e-06, 2.34000880546),
    "penalty II 10": (0.000293660537457, 162.652776566),
    "variably dimensioned 10": (14762.85, 0.0),
    "trigonometric 10": (0.0, 0.00192193682787),
    "Brown almost linear 10": (0.0, 0.0),
    "discrete boundary value 10": (0.0, 0.0),
    "discrete integral equation 10": (0.0, 0.0),
    "Broyden tridiagonal 10": (0.132517972187, 0.0),
    "Broyden banded 10": (0.156355297206, 0.0),
    "linear, full rank": (26.25, 35.0),
    "linear, rank 1": (158307.5, 639470.0),
    "linear, rank 1, zeros": (41188.25, 167771.0),
    "Chebyquad 8": (0.00351687372568, 0.00907179253483),
    "Chebyquad 9": (0.0, 0.00987351732187),
    "Chebyquad 10": (0.00477271369638, 0.00746844888042),
}


def boxes(problem: Problem) -> Iterator[tuple[np.ndarray, np.ndarray, float]]:
    """Lower and upper bounds with the least sum of squares in them: the start in the middle, and in a corner."""
    reach = 0.5 * np.maximum(np.abs(problem.start), 1.0)
    around, corner = _SQUARES[problem.name]
    yield problem.start - reach, problem.start + reach, around
    yield problem.start, problem.start + 2 * reach, corner


def least(squares: float, known: float) -> bool:
    """Whether a sum of squares is the least one known."""
    return squares <= known * (1 + 1e-6) + 1e-18
