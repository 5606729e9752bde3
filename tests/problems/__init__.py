"""Published problems with known answers, for the tests of solvers."""
