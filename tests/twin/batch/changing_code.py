"""Source of a module in which each number belongs to a definition of another kind, for tests that change one."""

import importlib
import sys

SOURCE = '''
import dataclasses
import enum
import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_batching import custom_vmap


class Kind(enum.Enum):
    LOW = 101


class Base:
    def inherited(self, x):
        return 102 * x


class Marker:
    """Its hash and its text are its address."""

    def __init__(self, value):
        self.value = value


def wrapping(f, factor):
    @functools.wraps(f)
    def inner(*arguments):
        return factor * f(*arguments)

    return inner


class Model(eqx.Module, Base):
    width: float = 1.0
    table = (1.0, 103.0)
    named = {"a": [104]}
    kind = Kind.LOW
    markers = frozenset(Marker(k) for k in (1, 2, 3, 105))
    marked = {Marker(1): 1, Marker(2): 106}

    @jax.jit
    def compiled(self, x):
        return 107 * x

    @eqx.filter_jit
    def filtered(self, x):
        return 108 * x

    @functools.partial(jax.jit, static_argnums=0)
    def constant(self, x):
        return 109 * x

    @staticmethod
    @jax.jit
    def alone(x):
        return 110 * x

    @classmethod
    def of_class(cls, x):
        return 111 * x

    @property
    def got(self):
        return 112

    @functools.cached_property
    def kept(self):
        return 113

    def power(self, exponent):
        return self.width**exponent

    squared = functools.partialmethod(power, 114)
    doubled = staticmethod(wrapping(jnp.sin, 115))
    lowered = staticmethod(lambda x: 116 * x)

    @functools.lru_cache
    def remembered(self):
        return 117

    @eqx.filter_jit
    def __call__(self, x):
        return self.width * x["a"] + self.itself(x["b"]) + 118

    def itself(self, x):
        return x if x is None else Model.table[0] * x


@jax.custom_jvp
def smooth(x):
    return x + 119


@smooth.defjvp
def smooth_jvp(primals, tangents):
    return smooth(*primals), 120 * tangents[0]


@jax.custom_jvp
def several(x, y):
    return x + y


several.defjvps(lambda g, out, x, y: 121 * g, None)


@jax.custom_vjp
def backward(x):
    return x


backward.defvjp(lambda x: (x, 122 * x), lambda rest, g: (123 * g,))


@eqx.filter_custom_jvp
def filtered_rule(x):
    return x


@filtered_rule.def_jvp
def filtered_jvp(primals, tangents):
    return primals[0], 124 * tangents[0]


@custom_vmap
def batch_rule(x):
    return x


@batch_rule.def_vmap
def batch_rule_of(size, batched, x):
    return 125 * x, True


def plain(x, y):
    return x * y


slope = jax.grad(plain, argnums=126 - 126)
rows = jax.vmap(plain, in_axes=(127 - 127, None))
filtered_rows = eqx.filter_vmap(plain, in_axes=(128 - 128, None))
filtered_slope = eqx.filter_value_and_grad(lambda x: 129 * x)
again = jax.checkpoint(lambda x: 130 * x)
jacobian = jax.jacfwd(lambda x: 131 * x)
elementwise = np.vectorize(lambda x: 132 * x)
bound = functools.partial(jax.jit(lambda k, x: k * x), 133)


drawn = jax.random.key(134)
things = np.array([Marker(135), "text"], dtype=object)


def rules(x):
    used = (smooth, several, backward, filtered_rule, batch_rule)
    made = (slope, rows, filtered_rows, filtered_slope, again, jacobian, elementwise, bound, drawn, things)
    return x["a"] + 0 * len(used) + 0 * len(made)


def model():
    return Model()
'''
IN_CLASS, IN_ALL = range(101, 119), range(101, 136)
NAME = "changing_code_source"


def loaded(folder, number=None):
    """The module, after a number of its source was changed."""
    text = SOURCE if number is None else SOURCE.replace(str(number), str(number + 900), 1)
    assert number is None or text != SOURCE
    (folder / f"{NAME}.py").write_text(text)
    sys.modules.pop(NAME, None)
    importlib.invalidate_caches()
    return importlib.import_module(NAME)
