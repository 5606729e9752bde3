"""Statistics of a comparison: against NumPy, with modes that could not be paired, bad input."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.identification.conformity import conformity, conformity_statistics
from twin._checks import InputError
from twin.linear import SecondOrder, frequency_response
from twin.modal import modes, reference_modes

N = 4
NAMES = tuple("abcd")
LINES = np.linspace(1.0, 40.0, 60)


def chain(factor=1.0, loss=0.02):
    ends = np.eye(N) - np.eye(N, k=1)
    stiffness = 1e4 * ends @ np.diag([1.0, 1.4, factor, 2.0]) @ ends.T
    return SecondOrder(
        np.eye(N), 1.0 * np.eye(N), loss * stiffness, stiffness, np.eye(N)[:, :1], np.eye(N), ("force",), NAMES
    )


def test_the_same_model():
    system = chain()
    response, found = frequency_response(system, LINES), modes(system)
    table = conformity([(response, response)], [(found, reference_modes(found))])
    for measure in ("frac", "csf", "macxp"):
        assert np.allclose(list(table.to_dict()[measure].values()), 100.0, atol=1e-9)
    assert np.allclose(list(table.to_dict()["ndd"].values()), 0.0)
    assert table.unpaired == 0


def test_another_model_at_two_positions():
    pairs = [(chain(1.01, 0.03), chain()), (chain(1.02), chain())]
    responses = [tuple(frequency_response(s, LINES, outputs=("a", "c")) for s in pair) for pair in pairs]
    table = conformity(responses, [tuple(modes(s) for s in pair) for pair in pairs])
    ratio, ratio_ref = (modes(pairs[0][i]).damping_ratio for i in (0, 1))
    assert np.isclose(table.ndd.worst, 100 * np.max(ratio / ratio_ref - 1), rtol=1e-9)
    assert table.ndd.worst >= table.ndd.percentile >= table.ndd.mean
    for measure in (table.frac, table.csf, table.macxp):
        assert measure.worst < measure.percentile < measure.mean <= 100.0
    frame = table.to_dataframe()
    assert list(frame.columns) == ["FRAC in %", "CSF in %", "MACXP in %", "NDD in %"]
    assert frame.loc["Worst", "MACXP in %"] == table.macxp.worst
    assert "Median" in repr(table)
    assert "<table" in table._repr_html_()


def test_numbers_by_hand():
    values = np.linspace(0.5, 1.0, 101)
    table = conformity_statistics(values, values[::-1], values, np.concatenate([-values, [np.nan]]))
    assert np.allclose(list(table.to_dict()["frac"].values()), [50.0, 52.5, 75.0, 75.0])
    assert np.allclose(list(table.to_dict()["ndd"].values()), [100.0, 97.5, 75.0, 75.0])
    assert table.unpaired == 1
    assert "1 reference modes could not be paired" in repr(table)


def test_a_mode_that_cannot_be_paired_counts_in_macxp():
    found = modes(chain())
    strange = reference_modes(found)
    strange = eqx.tree_at(lambda r: r.frequency, strange, strange.frequency.at[2].set(500.0))
    response = frequency_response(chain(), LINES)
    table = conformity([(response, response)], [(found, strange)])
    assert table.unpaired == 1
    assert table.macxp.worst < 30.0
    assert np.isclose(table.ndd.worst, 0.0)


def test_bad_input():
    response, found = frequency_response(chain(), LINES), modes(chain())
    with pytest.raises(InputError, match="Give at least one"):
        conformity([], [(found, found)])
    nothing = eqx.tree_at(lambda f: f.values, response, response.values * jnp.array([1, 1, 0, 1])[:, None, None])
    with pytest.raises(InputError, match="frac has 4 values, 1 of them NaN"):
        conformity([(nothing, response)], [(found, found)])
