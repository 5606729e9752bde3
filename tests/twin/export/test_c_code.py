"""Programs translated to C give what JAX gives."""

import ctypes
import shutil
import subprocess
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import twin.export.c_code
from twin._checks import InputError
from twin._powers import natural_logarithm
from twin.export.c_code import c_function

COMPILER = shutil.which("cc") or shutil.which("gcc")
pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")
HEADERS = Path(twin.export.c_code.__file__).parent


def translated(functions, folder):
    """Python functions of flat arrays that run the C code of several functions of one array each."""
    text = ['#include "arithmetic.h"']
    for number, (function, example) in enumerate(functions):
        text.append(
            c_function(f"f{number}", lambda arrays, f=function: jax.tree.leaves(f(*arrays)), (("a", example),)).text
        )
    source = folder / "program.c"
    source.write_text("\n".join(text))
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-Wno-unused-variable", "-ffp-contract=off", "-fPIC"]
    command = [COMPILER, *flags, "-shared", f"-I{HEADERS}", str(source), "-o", str(folder / "program.so"), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:3000] + source.read_text()[-3000:]
    return ctypes.CDLL(str(folder / "program.so"))


def run(library, number, arguments, size):
    flat = np.concatenate([np.ravel(np.asarray(a, dtype=np.float64)) for a in arguments])
    result = np.zeros(size + 1)
    pointers = [array.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for array in (flat, result)]
    getattr(library, f"f{number}")(*pointers)
    return result[:size]


def check(functions, folder, rtol=1e-14):
    library = translated(functions, folder)
    for number, (function, arguments) in enumerate(functions):
        expected = [np.ravel(np.asarray(x, dtype=np.float64)) for x in jax.tree.leaves(jax.jit(function)(*arguments))]
        expected = np.concatenate(expected)
        got = run(library, number, arguments, expected.size)
        np.testing.assert_allclose(got, expected, rtol=rtol, atol=1e-15, err_msg=f"function {number}")


def arrays(*shapes, positive=False, seed=0):
    random = np.random.default_rng(seed)
    return [jnp.asarray(random.uniform(0.05, 0.95, s) if positive else random.normal(size=s)) for s in shapes]


ONE = (
    jnp.abs,
    jnp.sign,
    jnp.floor,
    jnp.ceil,
    jnp.round,
    jnp.exp,
    jnp.exp2,
    jnp.expm1,
    jnp.sin,
    jnp.cos,
    jnp.tan,
    jnp.sinh,
)
ONE += (
    jnp.cosh,
    jnp.tanh,
    jnp.arctan,
    jnp.arcsinh,
    jnp.square,
    jnp.negative,
    jax.nn.sigmoid,
    jax.lax.cbrt,
    jax.lax.erf,
)
ONE += (jax.lax.erfc, lambda x: x**3, lambda x: x**-2, lambda x: x**7, jnp.isfinite, lambda x: jax.lax.round(x * 2.5))
ROOTS = (
    jnp.sqrt,
    jnp.log,
    jnp.log1p,
    jax.lax.rsqrt,
    jnp.arcsin,
    jnp.arccos,
    jnp.arctanh,
    natural_logarithm,
    jax.lax.lgamma,
)
ROOTS += (lambda x: jnp.arccosh(1 + x), jax.vmap(natural_logarithm))
TWO = (
    jnp.add,
    jnp.subtract,
    jnp.multiply,
    jnp.divide,
    jnp.maximum,
    jnp.minimum,
    jnp.arctan2,
    jnp.hypot,
    jnp.mod,
    jnp.fmod,
)
TWO += (jnp.less, jnp.greater_equal, jnp.equal, jnp.not_equal, lambda a, b: (a < b) & ~(a > 0.1) | (b > 0) ^ (a > 0))
TWO += (lambda a, b: jnp.where(a < b, a, 2 * b), lambda a, b: jnp.clip(a, -0.3, b), lambda a, b: jnp.abs(a) ** b)
TWO += (jnp.nextafter, lambda a, b: jnp.floor_divide(a, b), jnp.power)


def test_operations_on_single_numbers(tmp_path):
    functions = [(f, arrays((), seed=i)) for i, f in enumerate(ONE)]
    functions += [(f, arrays((), positive=True, seed=i)) for i, f in enumerate(ROOTS[:-1])]
    functions += [(f, arrays((), (), positive=f in TWO[-2:], seed=i)) for i, f in enumerate(TWO)]
    check(functions, tmp_path, rtol=2e-14)


def test_operations_on_arrays(tmp_path):
    functions = [(f, arrays((3, 4), seed=i)) for i, f in enumerate(ONE)]
    functions += [(f, arrays((5,), positive=True, seed=i)) for i, f in enumerate(ROOTS)]
    functions += [(f, arrays((3, 4), (4,), positive=f in TWO[-2:], seed=i)) for i, f in enumerate(TWO)]
    check(functions, tmp_path, rtol=2e-14)


def test_what_is_no_number_stays_so(tmp_path):
    nan, inf = jnp.asarray(jnp.nan), jnp.asarray(jnp.inf)
    cases = [(f, [nan, jnp.asarray(1.0)]) for f in (jnp.maximum, jnp.minimum, jnp.add)]
    cases += [(f, [jnp.asarray(1.0), nan]) for f in (jnp.maximum, jnp.minimum)]
    cases += [(jnp.sign, [nan]), (jnp.sign, [jnp.asarray(-0.0)]), (jnp.isfinite, [inf]), (lambda x: x * jnp.inf, [nan])]
    cases += [(lambda x: jnp.clip(x, -1.0, 1.0), [nan]), (lambda x: jnp.where(x > 0, jnp.inf, -jnp.inf), [inf])]
    check(cases, tmp_path)


def moves():
    yield lambda a: a.reshape(2, 6).T, arrays((3, 4))
    yield lambda a: a[1], arrays((3, 4))
    yield lambda a: a[:, 2], arrays((3, 4))
    yield lambda a: a[::-1, 1::2], arrays((3, 4))
    yield lambda a: jnp.stack([a[0, 0], a[2, 1], a[1, 1]]), arrays((3, 4))
    yield lambda a, b: jnp.concatenate([a, b[None], a[:1] * 2]), arrays((3, 4), (4,))
    yield lambda a, b: jnp.concatenate([jnp.zeros(1), a, jnp.ones(2), b[:1]]), arrays((3,), (4,))
    yield lambda a: jnp.pad(a, ((1, 2), (0, 1)), constant_values=-3.0), arrays((3, 4))
    yield lambda a: jnp.broadcast_to(a[:, None], (3, 5)) + jnp.arange(5), arrays((3,))
    yield lambda a: jnp.split(a, 3), arrays((6,))
    yield lambda a: jnp.diag(a) + jnp.eye(3), arrays((3,))
    yield lambda a: jnp.repeat(a, 2), arrays((3,))
    yield lambda a: jnp.roll(a, 1), arrays((4,))
    yield lambda a: a[jnp.asarray([2, 0, 0, 1])], arrays((3, 4))
    yield lambda a: (a[0:1] * 3, a[0:1, 0:1]), arrays((1, 4))
    yield lambda a: jnp.asarray([[1.5, -2.0], [0.25, 1e300]]) * a, arrays(())


def sums():
    yield lambda a: (a.sum(), a.prod(), a.max(), a.min()), arrays((3, 4))
    yield lambda a: (a.sum(0), a.prod(1), a.max(0), a.min(1)), arrays((3, 4))
    yield lambda a: a.sum((0, 2)), arrays((2, 3, 4))
    yield lambda a: (jnp.any(a > 0), jnp.all(a > -9, axis=1)), arrays((3, 4))
    yield (
        lambda a: (jnp.cumsum(a, 0), jnp.cumprod(a, 1), jax.lax.cummax(a), jax.lax.cumsum(a, 1, reverse=True)),
        arrays((3, 4)),
    )
    yield lambda a: (jnp.argmax(a, 1), jnp.argmin(a), jnp.max((a * 9).astype(int), 0)), arrays((3, 4))
    yield lambda a, b: a @ b, arrays((3, 4), (4, 2))
    yield lambda a, b: (a @ b, b @ a.T, jnp.dot(b, b)), arrays((3, 4), (4,))
    yield lambda a, b: jnp.einsum("bij,bkj->bik", a, b), arrays((2, 3, 4), (2, 5, 4))
    yield lambda a, b: jnp.einsum("ijb,jkb->kib", a, b), arrays((3, 4, 2), (4, 5, 2))
    yield lambda a, b: jnp.outer(a, b), arrays((3,), (2,))


def loops():
    yield lambda a: jax.lax.scan(lambda c, x: (c * 0.5 + x, c - x), a[0], a), arrays((5,))
    yield lambda a: jax.lax.scan(lambda c, x: ((c[1], c[0] + x), c[0]), (a[0], a[1]), a, reverse=True), arrays((4, 3))
    yield lambda a: jax.lax.fori_loop(0, 7, lambda i, c: c + i * jnp.sin(c), a), arrays((3,))
    yield lambda a: jax.lax.while_loop(lambda c: c[1] < 40, lambda c: (c[0] * 0.9, c[1] + 3), (a, 0))[0], arrays(())
    yield (
        lambda a: jax.lax.while_loop(lambda c: jnp.abs(c[0]) > 0.1, lambda c: (c[1] * 0.7, c[0]), (a, a + 1)),
        arrays(()),
    )
    yield lambda a: jax.lax.cond(a[0] > 0, lambda x: (x * 2, x.sum()), lambda x: (-x, x[1]), a), arrays((3,))
    yield lambda a: jax.lax.switch(jnp.int32(a * 1e6) % 3, [jnp.sin, jnp.cos, jnp.exp], a), arrays((), seed=4)
    yield lambda a: jax.lax.scan(lambda c, _: (c + 1, None), a, None, length=3)[0], arrays(())
    yield lambda a: jax.lax.scan(lambda c, x: (c + x.sum(), c), a.sum(), a), arrays((1, 3))
    yield lambda a: jax.lax.map(lambda x: jnp.outer(x, x), a), arrays((2, 3))


def lookups():
    table = jnp.linspace(0.0, 1.0, 6) ** 2
    yield lambda a: table[jnp.floor(jnp.abs(a) * 5).astype(int)], arrays((4,))
    yield lambda a: jnp.interp(a, jnp.linspace(-1, 1, 6), table), arrays((4,))
    yield lambda a: jnp.searchsorted(table, jnp.abs(a)), arrays(())
    yield lambda a: a[jnp.int32(a[0, 0] * 10) % 3, 1:3], arrays((3, 4))
    yield lambda a: jax.lax.dynamic_slice(a, (jnp.int32(9), jnp.int32(-1)), (2, 2)), arrays((3, 4))
    yield lambda a: jax.lax.dynamic_update_slice(a, a[:2, :2] * 5, (jnp.int32(7), jnp.int32(1))), arrays((3, 4))
    yield lambda a: jax.lax.dynamic_update_index_in_dim(a, 5.0, jnp.int32(2), 0), arrays((4,))
    yield lambda a: jnp.take(a, jnp.asarray([0, 7, -9]), mode="fill"), arrays((4,))
    yield lambda a: jnp.take(a, jnp.asarray([0, 7, 2]), mode="clip", axis=1), arrays((3, 4))
    yield lambda a: jax.vmap(lambda row, k: row[k])(a, jnp.asarray([3, 0, 2])), arrays((3, 4))


@pytest.mark.parametrize("family", [moves, sums, loops, lookups])
def test_programs_on_arrays(tmp_path, family):
    check(list(family()), tmp_path, rtol=1e-13)


def test_whole_numbers(tmp_path):
    whole = [jnp.asarray([7, -7, 3, 0]), jnp.asarray([2, 3, -2, 5])]
    functions = [
        (f, whole) for f in (jnp.add, jnp.multiply, jax.lax.div, jax.lax.rem, jnp.maximum, jnp.bitwise_xor, jax.lax.pow)
    ][:-1]
    functions += [
        (f, whole[:1]) for f in (jnp.abs, jnp.sign, lambda a: a << 2, lambda a: a >> 1, lambda a: ~a, lambda a: a**3)
    ]
    functions += [(lambda a: jax.lax.bitcast_convert_type(a, jnp.uint64) >> jnp.uint64(52), arrays((4,)))]
    check(functions, tmp_path)


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (lambda a: jnp.sort(a), "'sort'"),
        (lambda a: jnp.linalg.cholesky(a[:, None] * a), "'cholesky'"),
        (lambda a: a.astype(jnp.float32) + 1, "float32"),
        (lambda a: jnp.abs(a + 1j), "complex128"),
    ],
)
def test_what_has_no_translation_is_named(function, words):
    with pytest.raises(InputError, match=words):
        c_function("f", lambda arrays: [function(*arrays)], (("a", [jnp.ones(3)]),))


def test_what_is_not_needed_is_left_out():
    made = c_function("f", lambda p, x: [p[0] * 2.0], (("p", [jnp.ones(()), jnp.ones(())]), ("x", [jnp.ones(3)])))
    assert made.used == ((True, False), (False,))
