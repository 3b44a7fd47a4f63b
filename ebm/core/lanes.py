"""Eight numbers that compiled code adds and multiplies at once: the lanes of one vector register.

A Taylor series has sixteen terms (see `ebm.core.series.ORDER`), two vectors. LLVM makes the
machine code: one instruction where a register holds eight numbers (AVX-512), two or four where it
holds fewer, with the same result to the bit. Here numba learns the type and what can be done with
it: each function is the plain one, on an array of eight, which also says what it does, and is
decorated with the code that is built in its place.

`put`, `upto` and `above` take any lane number: where there is no such lane they put nothing, keep
all, or keep none.
"""

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import infer_global, make_concrete_template, signature
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


_LANES = Lanes("Lanes")
_IN_MATRIX = types.float64[:, ::1], types.int64, types.int64
register_model(Lanes)(lambda manager, kind: models.PrimitiveModel(manager, kind, _VECTOR))


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


def _place(context: Any, b: Any, a: Any, row: Any, k: Any) -> Any:
    """A pointer to the lanes from a[row, k] on of a matrix."""
    kind = _IN_MATRIX[0]
    matrix = make_array(kind)(context, b, a)
    number = cgutils.get_item_pointer(context, b, kind, matrix, [row, k], wraparound=False)
    return b.bitcast(number, ir.PointerType(_VECTOR))


def _compiled_as(
    code: Callable[..., Any], result: Any, *given: Any
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Tells numba to compile `code` in place of the decorated function, the plain one.

    `code` is called with the builder of the machine code and the values of the arguments, which are
    of the types `given`. In place of a matrix, a row and a column it gets a pointer to the lanes.
    """

    def tell(plain: Callable[..., Any]) -> Callable[..., Any]:
        def lower(context: Any, b: Any, kinds: Any, values: Any) -> Any:
            if given[:3] == _IN_MATRIX:
                values = [_place(context, b, *values[:3]), *values[3:]]
            found = code(b, *values)
            return context.get_dummy_value() if result == types.none else found

        kind = make_concrete_template(plain.__name__, plain, [signature(result, *given)])
        infer_global(plain, types.Function(kind))
        lower_builtin(plain, *given)(lower)
        return plain

    return tell


#: Sums and products are those of lanes with lanes, or of lanes with a number, which then stands in
#: all lanes.
_PAIRS = (_LANES, _LANES), (_LANES, types.float64), (types.float64, _LANES)


def _calculates(operation: Any, instruction: str) -> None:
    """Tells numba how an operator works on lanes."""
    cases = [signature(_LANES, *kinds) for kinds in _PAIRS]
    infer_global(operation)(make_concrete_template(instruction, operation, cases))
    for kinds in _PAIRS:

        def code(_: Any, b: Any, found: Any, values: Any, kinds: Any = kinds) -> Any:
            both = [
                value if kind == _LANES else _all(b, value)
                for kind, value in zip(kinds, values, strict=True)
            ]
            return getattr(b, instruction)(*both)

        lower_builtin(operation, *kinds)(code)


_calculates(operator.add, "fadd")
_calculates(operator.mul, "fmul")


@_compiled_as(lambda b: _ZEROS, _LANES)
def zeros() -> Floats:
    """0 in each lane."""
    return np.zeros(LANES)


@_compiled_as(lambda b: _RAMP, _LANES)
def ramp() -> Floats:
    """Each lane's own number: 0, 1, 2, ..."""
    return np.arange(float(LANES))


def _powers(b: Any, t: Any) -> Any:
    result = _ONES
    for bit in (1, 2, 4):
        has = ir.Constant(
            ir.VectorType(ir.IntType(1), LANES), [bool(place & bit) for place in _PLACES]
        )
        result = b.fmul(result, b.select(has, _all(b, t), _ONES))
        t = b.fmul(t, t)
    return result


@_compiled_as(_powers, _LANES, types.float64)
def powers(t: float) -> Floats:
    """1, t, t^2, ..."""
    result = np.ones(LANES)
    for bit in (1, 2, 4):
        result = result * np.where(_PLACES & bit, t, 1.0)
        t = t * t
    return result


@_compiled_as(lambda b, v: b.extract_element(v, ir.IntType(32)(0)), types.float64, _LANES)
def first(v: Floats) -> float:
    """The number in lane 0."""
    return v[0]


@_compiled_as(lambda b, v: b.shuffle_vector(v, _ZEROS, _indices(_PLACES + 1)), _LANES, _LANES)
def shifted(v: Floats) -> Floats:
    """Each lane's number moved to the lane before; 0 comes into the last one."""
    return np.append(v[1:], 0.0)


@_compiled_as(
    lambda b, v, place, number: b.select(_where(b, "==", place), _all(b, number), v),
    *(_LANES, _LANES, types.int64, types.float64),
)
def put(v: Floats, place: int, number: float) -> Floats:
    """The lanes with this number in one place."""
    return np.where(place == _PLACES, number, v)


@_compiled_as(
    lambda b, v, place: b.select(_where(b, "<=", place), v, _ZEROS), _LANES, _LANES, types.int64
)
def upto(v: Floats, place: int) -> Floats:
    """The lanes up to this place, 0 in those behind it."""
    return np.where(place >= _PLACES, v, 0.0)


@_compiled_as(
    lambda b, v, place: b.select(_where(b, ">", place), v, _ZEROS), _LANES, _LANES, types.int64
)
def above(v: Floats, place: int) -> Floats:
    """The lanes behind this place, 0 in those up to it."""
    return np.where(place < _PLACES, v, 0.0)


@_compiled_as(lambda b, v: b.select(b.fcmp_ordered(">", v, _ZEROS), _ZEROS, v), _LANES, _LANES)
def falls(v: Floats) -> Floats:
    """The negative numbers, and 0 for the positive ones. NaN stays NaN."""
    return np.where(v > 0.0, 0.0, v)


def _total(b: Any, v: Any) -> Any:
    count = LANES
    while count > 1:
        count //= 2
        nothing = ir.Constant(v.type, ir.Undefined)
        low = b.shuffle_vector(v, nothing, _indices(range(count)))
        v = b.fadd(low, b.shuffle_vector(v, nothing, _indices(range(count, 2 * count))))
    return b.extract_element(v, ir.IntType(32)(0))


@_compiled_as(_total, types.float64, _LANES)
def total(v: Floats) -> float:
    """The sum of all lanes, by halving.

    The two halves are added, then the two quarters of that, and at last the two numbers left.
    """
    while len(v) > 1:
        half = len(v) // 2
        v = v[:half] + v[half:]
    return v[0]


@_compiled_as(lambda b, place: b.load(place, align=8), _LANES, *_IN_MATRIX)
def load(a: Floats, row: int, k: int) -> Floats:
    """The numbers a[row, k], a[row, k + 1], ... of a matrix; they must all be in the row."""
    return a[row, k : k + LANES].copy()


@_compiled_as(lambda b, place, v: b.store(v, place, align=8), types.none, *_IN_MATRIX, _LANES)
def store(a: Floats, row: int, k: int, v: Floats) -> None:
    """Writes a[row, k], a[row, k + 1], ... of a matrix; they must all be in the row."""
    a[row, k : k + LANES] = v
