"""Eight numbers that compiled code adds and multiplies at once: the lanes of one vector register.

A Taylor series has sixteen terms (see `ebm.core.series.ORDER`), two vectors. LLVM makes the
machine code: one instruction where a register holds eight numbers (AVX-512), two or four where it
holds fewer, with the same result to the bit. Here numba learns the type and what can be done with
it: for each function there is the plain one, on an array of eight, which also says what it does,
and the code that is built in its place.

`put`, `upto` and `above` take any lane number: where there is no such lane they put nothing, keep
all, or keep none.
"""

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model
from numba.np.arrayobj import make_array

from rockcheck.scenes import Floats

LANES = 8
_PLACES = np.arange(LANES)
_NUMBER, _PLACE = ir.DoubleType(), ir.IntType(64)
_VECTOR, _VECTOR_OF_PLACES = ir.VectorType(_NUMBER, LANES), ir.VectorType(_PLACE, LANES)
_ZEROS = ir.Constant(_VECTOR, [0.0] * LANES)
_ONES = ir.Constant(_VECTOR, [1.0] * LANES)
_RAMP = ir.Constant(_VECTOR, [float(place) for place in _PLACES])


class Lanes(types.Type):
    """numba's type of eight numbers."""

    def __init__(self) -> None:
        super().__init__("Lanes")


_LANES = Lanes()


@register_model(Lanes)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def _indices(places: Any) -> Any:
    """For a shuffle: which lane each lane of the result has."""
    return ir.Constant(ir.VectorType(ir.IntType(32), len(places)), [int(place) for place in places])


def _all(b: Any, number: Any, vector: Any = _VECTOR) -> Any:
    """The same number in all lanes."""
    nothing = ir.Constant(vector, ir.Undefined)
    return b.shuffle_vector(
        b.insert_element(nothing, number, ir.IntType(32)(0)), nothing, _indices([0] * LANES)
    )


def _where(b: Any, how: str, place: Any) -> Any:
    """The lanes whose number compares so with `place`."""
    return b.icmp_signed(
        how, ir.Constant(_VECTOR_OF_PLACES, _PLACES.tolist()), _all(b, place, _VECTOR_OF_PLACES)
    )


def _compiled(result: Any, *given: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Tells numba to compile the decorated function in place of the plain one.

    The plain function has the same name without the underscore. The decorated one is called with
    numba's context, the builder of the code, the types and the values of the arguments, for
    arguments of the types `given`.
    """

    def tell(code: Callable[..., Any]) -> Callable[..., Any]:
        plain = globals()[code.__name__[1:]]

        class _Template(AbstractTemplate):
            key = plain

            def generic(self, args: Any, kws: Any) -> Any:
                return signature(
                    result,
                    *(
                        a if isinstance(a, types.Array) else kind
                        for a, kind in zip(args, given, strict=True)
                    ),
                )

        infer_global(plain, types.Function(_Template))
        lower_builtin(plain, *given)(
            lambda context, b, kinds, values: code(context, b, kinds.args, values)
        )
        return code

    return tell


class _Arithmetic(AbstractTemplate):
    """The types of sums and products: lanes with lanes, or lanes with a number.

    The number then stands in all lanes.
    """

    def generic(self, args: Any, kws: Any) -> Any:
        if _LANES in args and all(kind in (_LANES, types.float64) for kind in args):
            return signature(_LANES, *args)
        return None


def _calculates(operation: Any, instruction: str) -> None:
    """Tells numba how an operator works on lanes."""
    infer_global(operation)(type(instruction, (_Arithmetic,), {}))
    for kinds in ((_LANES, _LANES), (_LANES, types.float64), (types.float64, _LANES)):

        def code(_: Any, b: Any, found: Any, values: Any, kinds: Any = kinds) -> Any:
            both = [
                value if kind == _LANES else _all(b, value)
                for kind, value in zip(kinds, values, strict=True)
            ]
            return getattr(b, instruction)(*both)

        lower_builtin(operation, *kinds)(code)


_calculates(operator.add, "fadd")
_calculates(operator.mul, "fmul")


def zeros() -> Floats:
    """0 in each lane."""
    return np.zeros(LANES)


@_compiled(_LANES)
def _zeros(context: Any, b: Any, kinds: Any, values: Any) -> Any:
    return _ZEROS


def ramp() -> Floats:
    """Each lane's own number: 0, 1, 2, ..."""
    return np.arange(float(LANES))


@_compiled(_LANES)
def _ramp(context: Any, b: Any, kinds: Any, values: Any) -> Any:
    return _RAMP


def powers(t: float) -> Floats:
    """1, t, t^2, ..."""
    result = np.ones(LANES)
    for bit in (1, 2, 4):
        result = result * np.where(_PLACES & bit, t, 1.0)
        t = t * t
    return result


@_compiled(_LANES, types.float64)
def _powers(context: Any, b: Any, kinds: Any, values: Any) -> Any:
    result, t = _ONES, values[0]
    for bit in (1, 2, 4):
        has = ir.Constant(
            ir.VectorType(ir.IntType(1), LANES), [bool(place & bit) for place in _PLACES]
        )
        result = b.fmul(result, b.select(has, _all(b, t), _ONES))
        t = b.fmul(t, t)
    return result


def first(v: Floats) -> float:
    """The number in lane 0."""
    return v[0]


@_compiled(types.float64, _LANES)
def _first(context: Any, b: Any, kinds: Any, values: Any) -> Any:
    return b.extract_element(values[0], ir.IntType(32)(0))


def shifted(v: Floats) -> Floats:
    """Each lane's number moved to the lane before; 0 comes into the last one."""
    return np.append(v[1:], 0.0)


@_compiled(_LANES, _LANES)
def _shifted(context: Any, b: Any, kinds: Any, values: Any) -> Any:
    return b.shuffle_vector(values[0], _ZEROS, _indices(_PLACES + 1))


def put(v: Floats, place: int, number: float) -> Floats:
    """The lanes with this number in one place."""
    return np.where(place == _PLACES, number, v)


@_compiled(_LANES, _LANES, types.int64, types.float64)
def _put(context: Any, b: Any, kinds: Any, values: Any) -> Any:
    v, place, number = values
    return b.select(_where(b, "==", place), _all(b, number), v)


def upto(v: Floats, place: int) -> Floats:
    """The lanes up to this place, 0 in those behind it."""
    return np.where(place >= _PLACES, v, 0.0)


@_compiled(_LANES, _LANES, types.int64)
def _upto(context: Any, b: Any, kinds: Any, values: Any) -> Any:
    return b.select(_where(b, "<=", values[1]), values[0], _ZEROS)


def above(v: Floats, place: int) -> Floats:
    """The lanes behind this place, 0 in those up to it."""
    return np.where(place < _PLACES, v, 0.0)


@_compiled(_LANES, _LANES, types.int64)
def _above(context: Any, b: Any, kinds: Any, values: Any) -> Any:
    return b.select(_where(b, ">", values[1]), values[0], _ZEROS)


def falls(v: Floats) -> Floats:
    """The negative numbers, and 0 for the positive ones. NaN stays NaN."""
    return np.where(v > 0.0, 0.0, v)


@_compiled(_LANES, _LANES)
def _falls(context: Any, b: Any, kinds: Any, values: Any) -> Any:
    return b.select(b.fcmp_ordered(">", values[0], _ZEROS), _ZEROS, values[0])


def total(v: Floats) -> float:
    """The sum of all lanes, by halving.

    The two halves are added, then the two quarters of that, and at last the two numbers left.
    """
    while len(v) > 1:
        half = len(v) // 2
        v = v[:half] + v[half:]
    return v[0]


@_compiled(types.float64, _LANES)
def _total(context: Any, b: Any, kinds: Any, values: Any) -> Any:
    v, count = values[0], LANES
    while count > 1:
        count //= 2
        nothing = ir.Constant(v.type, ir.Undefined)
        low = b.shuffle_vector(v, nothing, _indices(range(count)))
        v = b.fadd(low, b.shuffle_vector(v, nothing, _indices(range(count, 2 * count))))
    return b.extract_element(v, ir.IntType(32)(0))


def load(a: Floats, row: int, k: int) -> Floats:
    """The numbers a[row, k], a[row, k + 1], ... of a matrix; they must all be in the row."""
    return a[row, k : k + LANES].copy()


def _place(context: Any, b: Any, kinds: Any, values: Any) -> Any:
    """A pointer to lanes in a matrix."""
    matrix = make_array(kinds[0])(context, b, values[0])
    number = cgutils.get_item_pointer(
        context, b, kinds[0], matrix, [values[1], values[2]], wraparound=False
    )
    return b.bitcast(number, ir.PointerType(_VECTOR))


@_compiled(_LANES, types.Array, types.int64, types.int64)
def _load(context: Any, b: Any, kinds: Any, values: Any) -> Any:
    return b.load(_place(context, b, kinds, values), align=8)


def store(a: Floats, row: int, k: int, v: Floats) -> None:
    """Writes a[row, k], a[row, k + 1], ... of a matrix; they must all be in the row."""
    a[row, k : k + LANES] = v


@_compiled(types.none, types.Array, types.int64, types.int64, _LANES)
def _store(context: Any, b: Any, kinds: Any, values: Any) -> Any:
    b.store(values[3], _place(context, b, kinds, values), align=8)
    return context.get_dummy_value()
