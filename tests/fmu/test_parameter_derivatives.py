"""Directional derivatives with respect to parameters, in the modes in which they may change."""

import numpy as np
import pytest

from native_host import Instance, status
from support import case

OK, ERROR = 0, 3
RTOL = 1e-6  # The differences in the FMU have an error of 1e-9 and less, those here as well.

pytestmark = [pytest.mark.fmu, pytest.mark.native]
versions = pytest.mark.parametrize("fmi", [2, 3])


def along(instance, unknowns, knowns, seed):
    numbers = ([instance.references[n] for n in names] for names in (unknowns, knowns))
    return np.array(instance.fmu.getDirectionalDerivative(*numbers, list(seed)))


@versions
def test_initial_values_have_derivatives_with_respect_to_all_parameters(native, fmi):
    """Closed forms: the gap is linear in the wall, the elastic energy in the modulus."""
    with Instance(native["PRBDM", fmi], "me").enter() as instance:
        energy, modulus = instance.get("energy.elastic", "flexure.youngs_modulus")
        found = along(
            instance, ["stop.gap", "energy.elastic"],
            ["stop.position", "flexure.youngs_modulus"], [2.0, 0.0],
        )  # fmt: skip
        np.testing.assert_allclose(found, [2.0, 0.0], rtol=RTOL, atol=1e-9)
        found = along(instance, ["energy.elastic"], ["flexure.youngs_modulus"], [1.0])
        assert found == pytest.approx([energy / modulus], rel=RTOL)
        assert instance.get("energy.elastic") == [energy]


@versions
@pytest.mark.parametrize("model", ["PRBDM", "PRBDM2R"])
def test_initial_derivatives_equal_differences_of_whole_starts(native, fmi, model):
    unknowns = ["shuttle.y", "energy.elastic", "energy.gravitational", "base.force.x"]
    changes = {"release.displacement": 1e-6, "flexure.thickness": 1e-9, "gravity.x": 1e-4}

    def start(values):
        with Instance(native[model, fmi], "me") as instance:
            assert instance.set(values) == OK
            instance.enter()
            return np.array(instance.get(*unknowns))

    with Instance(native[model, fmi], "me").enter() as instance:
        seed = list(changes.values())
        found = along(instance, unknowns, list(changes), seed)
        there = dict(zip(changes, instance.get(*changes), strict=True))
    high, low = (
        start({name: there[name] + sign * x for name, x in changes.items()}) for sign in (1, -1)
    )
    np.testing.assert_allclose(found, (high - low) / 2, rtol=1e-5)


@versions
def test_tunable_parameters_are_knowns_in_event_mode(native, fmi):
    """Accelerations are linear in the damping, which acts on the rates."""
    model = "PRBDM"
    with Instance(native[model, fmi], "me").initialize() as instance:
        instance.advance(case(model).end / 15)
        instance.fmu.enterEventMode()
        rates = [u.variable.name for u in instance.description.derivatives]
        state = instance.bytes()
        found = along(instance, [*rates, "stop.gap"], ["damping.zeta", "stop.position"], [1.0, 0.5])
        assert instance.bytes() == state
        before = np.array(instance.get(*rates))
        assert instance.set({"damping.zeta": 1.0}) == OK
        np.testing.assert_allclose(found[:-1], np.array(instance.get(*rates)) - before, rtol=RTOL)
        assert found[-1] == pytest.approx(0.5, rel=RTOL)
        numbers = [instance.references["stop.gap"]], [instance.references["shuttle.mass"]], [1.0]
        assert status(instance.fmu.getDirectionalDerivative, *numbers) == ERROR
        assert instance.logged("shuttle.mass: fixed parameters change in Initialization Mode only")


@versions
def test_a_derivative_at_a_bound_is_one_sided(native, fmi):
    """The restitution is at its maximum; the damping at its minimum, zero."""
    with Instance(native["PRBDM", fmi], "me") as instance:
        assert instance.set({"stop.restitution": 1.0}) == OK
        instance.enter()
        found = along(instance, ["stop.gap"], ["stop.restitution", "damping.zeta"], [1.0, 1.0])
        assert found == pytest.approx([0.0], abs=1e-9)
