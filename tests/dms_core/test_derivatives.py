"""Every element's analytic derivatives against finite differences; no element can escape.

All modules of `dms_core.model` are imported; each concrete element, constraint and sensor found there must have an
example in `tests/example_elements`. At random states (Euler parameters of unit length and not: kernels hold for
both) each kernel must

- write derivatives equal to central differences of its own values,
- write exactly 0 outside its declared pattern,
- give the same values at level 0 as at level 1, and write no derivative at level 0,
- let inputs enter a constraint additively, and sensors by their values only,

and each dynamic element that reads inputs must have an `input_kernel` that gives its derivatives by them; what a
`parameter_kernel` gives must be the derivatives by all numbers.
"""

from __future__ import annotations

import importlib
import pkgutil

import numpy as np
import pytest

import dms_core.model
from dms_core.compiled.entries import derivative_kernel
from dms_core.model.element import Constraint, DynamicElement, Sensor
from tests.example_elements import composites, examples
from tests.example_elements.kernel_call import KernelCall, kernel_calls

STEP = 3e-5
"""Difference step over the scale of a coordinate. Five points: the formula errs by STEP^4 / 30 = 3e-20 times a fifth
derivative, rounding by 1e-16 / STEP = 3e-12 times the value."""

RTOL = 1e-7
"""Share of the largest derivative by the same coordinate. Curved elements need the room (the fifth derivative of a
tendon curve by length is about 1e10 times its slope); a forgotten term of any importance is larger."""

ATOL = 3e-10
"""Share of the largest value, over the scale of the coordinate: hundredfold the rounding error above."""

SEEDS = range(4)


def _concrete() -> dict[str, type]:
    """Kind to class, of everything in dms_core.model that has or should have a kernel."""
    for info in pkgutil.walk_packages(dms_core.model.__path__, "dms_core.model."):
        importlib.import_module(info.name)
    found: dict[str, type] = {}
    pending: list[type] = [DynamicElement, Constraint, Sensor]
    while pending:
        cls = pending.pop()
        children = [c for c in cls.__subclasses__() if c.__module__.startswith("dms_core.")]
        pending += children
        if cls.kind or not children:
            assert cls.kind, f"{cls.__name__} has no kind of its own"
            first = found.setdefault(cls.kind, cls)
            assert first is cls, f"two classes are of kind '{cls.kind}': {first}, {cls}"
    return found


CONCRETE = _concrete()
CASES = [pytest.param(f, id=f"{kind}-{f.__name__}") for kind, functions in examples().items() for f in functions]


def differences(f, x: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Five-point central differences of f by each entry of x, shape (*f.shape, n)."""
    columns = []
    for k, h in enumerate(STEP * scale):
        e = np.zeros_like(x)
        e[k] = h
        columns.append((8.0 * (f(x + e) - f(x - e)) - (f(x + 2 * e) - f(x - 2 * e))) / (12.0 * h))
    return np.stack(columns, axis=-1) if columns else np.zeros((*np.shape(f(x)), 0))


def assert_derivative(what: str, analytic, f, x, scale) -> None:
    """`analytic` is the derivative of f at x, column by column within the tolerances above."""
    numeric, value = differences(f, x, scale), np.abs(f(x)).max(initial=0.0)
    allowed = RTOL * np.abs(numeric).max(axis=0, initial=0.0) + ATOL * value / scale + 1e-14
    error = np.abs(analytic - numeric)
    assert np.all(error <= allowed), (
        f"{what}: worst entry (row, column) {np.unravel_index(np.argmax(error / allowed), error.shape)}\n"
        f"analytic\n{analytic}\nnumeric\n{numeric}"
    )


def assert_dynamic(call: KernelCall, x) -> None:
    """Jq, Jv, Ja are derivatives of r."""
    _, Jq, Jv, Ja = call(x)
    assert_derivative("Jq", Jq, lambda q: call(x._replace(q=q), 0)[0], x.q, call.q_scale)
    assert_derivative("Jv", Jv, lambda v: call(x._replace(v=v), 0)[0], x.v, call.v_scale)
    assert_derivative("Ja", Ja, lambda a: call(x._replace(a=a), 0)[0], x.a, call.v_scale)


def assert_constraint(call: KernelCall, x) -> None:
    """G, W, H are derivatives of phi, G v, G^T lam; phi_t of phi by time; G, W, H are free of inputs."""
    phi, phi_t, G, W, H = call(x)
    assert_derivative("G", G, lambda q: call(x._replace(q=q), 0)[0], x.q, call.q_scale)
    assert_derivative("W", W, lambda q: call(x._replace(q=q), 0)[2] @ x.v, x.q, call.q_scale)
    assert_derivative("H", H, lambda q: call(x._replace(q=q), 0)[2].T @ x.lam, x.q, call.q_scale)

    def at(t: float) -> np.ndarray:
        later = np.column_stack([x.u @ [1.0, t, t * t / 2.0], x.u @ [0.0, 1.0, t], x.u[:, 2]])
        return call(x._replace(u=later), 0)[0]

    # Inputs are parabolas here and enter additively, so both formulas are exact but for rounding, 1e-16 / h^2.
    h = 0.01
    np.testing.assert_allclose(phi_t[:, 0], (at(h) - at(-h)) / (2 * h), atol=1e-11 * (1.0 + np.abs(phi).max()))
    np.testing.assert_allclose(phi_t[:, 1], (at(h) - 2 * phi + at(-h)) / h**2, atol=1e-10 * (1.0 + np.abs(phi).max()))
    for one, other in zip((G, W, H), call(x._replace(u=x.u + 0.3))[2:], strict=True):
        np.testing.assert_array_equal(one, other)


def assert_sensor(call: KernelCall, x) -> None:
    """Yq, Yv, Ya, Yl, Yu are derivatives of y."""
    _, Yq, Yv, Ya, Yl, Yu = call(x)
    ones = np.ones
    assert_derivative("Yq", Yq, lambda q: call(x._replace(q=q), 0)[0], x.q, call.q_scale)
    assert_derivative("Yv", Yv, lambda v: call(x._replace(v=v), 0)[0], x.v, call.v_scale)
    assert_derivative("Ya", Ya, lambda a: call(x._replace(a=a), 0)[0], x.a, call.v_scale)
    assert_derivative("Yl", Yl, lambda lam: call(x._replace(lam=lam), 0)[0], x.lam, ones(x.lam.size))

    def of_values(values: np.ndarray) -> np.ndarray:
        return call(x._replace(u=np.column_stack([values, x.u[:, 1:]])), 0)[0]

    assert_derivative("Yu", Yu, of_values, x.u[:, 0].copy(), ones(len(x.u)))
    np.testing.assert_array_equal(call(x._replace(u=x.u * [1.0, 3.0, -2.0]), 0)[0], call(x, 0)[0])


def assert_input_kernel(call: KernelCall, x) -> None:
    """Ju is the derivative of r by value, rate and second derivative of every input."""
    Ju = call.slopes(x, "input_kernel")
    assert Ju is not None, f"{call.example.element.kind} reads inputs and has no input_kernel"
    numeric_shape = (call.placement.size, len(x.u) * 3)
    assert_derivative(
        "Ju", Ju.reshape(numeric_shape), lambda u: call(x._replace(u=u.reshape(-1, 3)), 0)[0], x.u.ravel(),
        np.ones(x.u.size),
    )  # fmt: skip


def assert_parameter_kernel(call: KernelCall, x) -> None:
    """Jp is the derivative of r by every number."""
    numbers = np.array(call.placement.numbers, float)
    by = np.where(numbers == 0.0, 1.0, np.abs(numbers))
    Jp = call.slopes(x, "parameter_kernel")
    assert_derivative("Jp", Jp, lambda par: call.with_numbers(par)(x, 0)[0], numbers, by)


def assert_constraint_by_input(call: KernelCall, x) -> None:
    """What a constraint writes into phi_t at the rate 1 of one input is its derivative by that input."""
    unit = [np.array([[v, float(k == m), 0.0] for m, v in enumerate(x.u[:, 0])]) for k in range(len(x.u))]
    told = np.stack([call(x._replace(u=u), 0)[1][:, 0] for u in unit], axis=-1)

    def of_values(values: np.ndarray) -> np.ndarray:
        return call(x._replace(u=np.column_stack([values, x.u[:, 1:]])), 0)[0]

    assert_derivative("phi_u", told, of_values, x.u[:, 0].copy(), np.ones(len(x.u)))


def check(call: KernelCall, x) -> None:
    """The check of its branch."""
    branch = {DynamicElement: assert_dynamic, Constraint: assert_constraint, Sensor: assert_sensor}
    branch[call.branch](call, x)


@pytest.mark.parametrize("kind", sorted(CONCRETE))
def test_every_kind_has_an_example(kind):
    if kind in composites():
        assert issubclass(CONCRETE[kind], Sensor) and CONCRETE[kind].kernel is None
        pytest.skip(f"no kernel of its own: {composites()[kind]}")
    assert CONCRETE[kind].kernel is not None, f"'{kind}' has no kernel and does not stand in COMPOSITES"
    assert examples().get(kind), f"'{kind}' has no example in tests/example_elements"
    for function in examples()[kind]:
        assert type(function().element) is CONCRETE[kind], f"{function.__name__} is no example of '{kind}'"


@pytest.mark.parametrize("kind", sorted(k for k, c in CONCRETE.items() if issubclass(c, DynamicElement)))
def test_what_can_read_inputs_gives_derivatives_by_them(kind):
    """By the declaration, so that an element whose examples read none does not escape."""
    cls = CONCRETE[kind]
    if cls.input_names is not DynamicElement.input_names:
        assert derivative_kernel(cls, "input_kernel") is not None, f"'{kind}' can read inputs and has no input_kernel"
        assert any(call.placement.inputs for f in examples()[kind] for call in kernel_calls(f())), kind


def test_every_example_is_of_a_known_kind():
    assert not (examples().keys() | composites().keys()) - CONCRETE.keys()


@pytest.mark.parametrize("example", CASES)
class TestKernel:
    def test_derivatives_are_differences_of_values(self, example):
        for call in kernel_calls(example()):
            for seed in SEEDS:
                check(call, call.random_point(seed))

    def test_derivatives_by_inputs_are_differences(self, example):
        for call in kernel_calls(example()):
            if call.placement.inputs and call.branch is not Sensor:
                for seed in SEEDS:
                    (assert_input_kernel if call.branch is DynamicElement else assert_constraint_by_input)(
                        call, call.random_point(seed)
                    )

    def test_derivatives_by_numbers_are_differences(self, example):
        for call in kernel_calls(example()):
            if call.slopes(call.random_point(0), "parameter_kernel") is not None:
                for seed in SEEDS:
                    assert_parameter_kernel(call, call.random_point(seed))

    def test_nothing_outside_the_pattern(self, example):
        for call in kernel_calls(example()):
            for name, derivative, allowed in call.patterned(call(call.random_point(1))):
                assert allowed.shape == derivative.shape, f"pattern of {name}: {allowed.shape} for {derivative.shape}"
                assert not np.any(derivative[~allowed]), f"{name} is non-zero outside its pattern"

    def test_level_0_gives_the_values_alone(self, example):
        for call in kernel_calls(example()):
            x = call.random_point(2)
            for k, (values, full) in enumerate(zip(call(x, 0), call(x, 1), strict=True)):
                np.testing.assert_array_equal(values, full if k < call.value_outputs else 0.0 * full)


def _spoiled(call: KernelCall, output: int) -> KernelCall:
    """The same kernel with its largest entry of one output wrong by 1e-5 of itself."""

    def kernel(*arguments: object) -> None:
        call.kernel(*arguments)
        out = arguments[len(arguments) - call.outputs + output]
        worst = np.unravel_index(np.argmax(np.abs(out)), out.shape)
        out[worst] *= 1.0 + 1e-5

    return call._replace(kernel=kernel)


@pytest.mark.parametrize(
    ("kind", "output"),
    [
        ("rigid_body", 1),
        ("rigid_body", 2),
        ("rigid_body", 3),
        ("angle_driver", 1),
        ("angle_driver", 3),
        ("angle_driver", 4),
    ],
)
def test_a_wrong_derivative_is_found(kind, output):
    call = kernel_calls(examples()[kind][0]())[0]
    x = call.random_point(0)
    check(call, x)
    with pytest.raises(AssertionError):
        check(_spoiled(call, output), x)


@pytest.mark.parametrize(
    ("kind", "attribute", "confirm"),
    [
        ("reference_filter", "input_kernel", assert_input_kernel),
        ("gravity", "parameter_kernel", assert_parameter_kernel),
    ],
)
def test_a_wrong_derivative_by_input_or_number_is_found(kind, attribute, confirm, monkeypatch):
    call = kernel_calls(examples()[kind][0]())[0]
    x = call.random_point(0)
    confirm(call, x)
    right = getattr(type(call.example.element), attribute)

    def wrong(*arguments: object) -> None:
        right(*arguments)
        arguments[-1][...] *= 1.0 + 1e-5

    monkeypatch.setattr(type(call.example.element), attribute, wrong)
    with pytest.raises(AssertionError):
        confirm(call, x)
