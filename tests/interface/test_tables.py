"""The tables of the C kernel, read back by an independent reader in Python."""

import struct
import zlib
from dataclasses import dataclass, field, replace

import pytest

from free_bodies import ball, with_start
from guides import rough
from kernel_library import KernelError, kernel
from many_parts import anvil, elastic, profiles
from prbm.base.errors import MechanismError
from prbm.files.mechanism_file import read_mechanism, shipped
from prbm.fmu.export import Export
from prbm.fmu.native_fmu import described
from prbm.hybrid.simulation import Simulation
from prbm.interface.tables import HEAD, VERSION, slots, tables
from prbm.interface.variables import CLOCK
from prbm.mechanics.independent import independent
from prbm.mechanics.inputs import input_names
from prbm.mechanism.description import Mechanism
from prbm.mechanism.expressions import affine
from prbm.mechanism.fields import FIELDS, fields_of
from prbm.mechanism.parts import (
    POSITIONS,
    VELOCITIES,
    FlexureType,
    body_of,
    field_of,
    value,
)
from support import SHIPPED

REQUIRED = ("thickness", "width", "youngs_modulus", "density")
TOKEN = "{0}"
STEP = 2e-3  # s, communication step of the default experiment
TYPES = {0: "Real", 1: "Integer", 2: "Boolean", 3: CLOCK}
EXPRESSIONS = """
name = "Lever"
title = "A lever whose numbers are expressions"
gravity = [0.0, -9.81]

[[geometry]]
name = "size"
value = 0.05
unit = "m"
description = "Length of the flexure"

[[flexure_types]]
name = "hinge"
model = "3R"
thickness = "size / 50"
width = 8e-3
youngs_modulus = 2e11
density = 7800.0
coefficients = {gamma1 = "7 * size", K_theta2 = 3.0}

[ground]
foot = [0.0, "-size"]
other = ["2 * size", "-size"]

[[bodies]]
name = "tip"
mass = "2 * size - 0.01"
inertia = 1e-4
centre = ["size + 0.01", 0.0]

[bodies.points]
root = ["size", "size - size"]

[[flexures]]
name = "leaf"
type = "hinge"
start = "tip.root"
end = "ground.foot"

[[flexures]]
name = "strut"
type = "hinge"
start = "ground.other"
end = "tip.root"
ends = ["clamp", "pin"]

[[stops]]
name = "wall"
body = "tip"
point = ["size", 0.01]
direction = -90.0
position = "size / 10"

[release]
body = "tip"
direction = 270.0
displacement = -0.0001
"""


@dataclass
class Reader:
    """Reader of the items of the tables, one after the other."""

    data: bytes
    at: int = HEAD
    parameters: list = field(default_factory=list)

    def take(self, form: str):
        result = struct.unpack_from(f"<{form}", self.data, self.at)
        self.at += struct.calcsize(f"<{form}")
        return result[0] if len(result) == 1 else result

    def text(self) -> str:
        length = self.take("I")
        content = self.data[self.at : self.at + length]
        assert self.data[self.at + length] == 0
        self.at += length + 1
        return content.decode()

    def expression(self):
        """Return a function of the parameters' values by name."""
        constant, count = self.take("dI")
        terms = [self.take("Id") for _ in range(count)]
        names = [(self.parameters[i], factor) for i, factor in terms]
        return lambda values: constant + sum(c * values[name] for name, c in names)

    def point(self):
        x, y = self.expression(), self.expression()
        return lambda values: (x(values), y(values))


OWN = {
    "Elastic": elastic, "Profiles": profiles,
    "Guides": lambda: rough(read_mechanism(shipped()["SliderCrank"]), 0.2),
    "Starts": lambda: with_start(ball(), "ball", start_angle=0.2, start_y=0.1, start_vx=0.3),
}  # fmt: skip


@pytest.fixture(scope="module", params=[*SHIPPED, "Lever", *OWN])
def mechanism(request, tmp_path_factory) -> Mechanism:
    if request.param in OWN:
        return OWN[request.param]()
    if request.param == "Lever":
        path = tmp_path_factory.mktemp("lever") / "lever.toml"
        path.write_text(EXPRESSIONS, encoding="utf-8")
        return read_mechanism(path)
    return read_mechanism(shipped()[request.param])


@pytest.fixture(scope="module")
def written(mechanism) -> bytes:
    native = described(Export(mechanism), 3, clock=True)
    return tables(mechanism, native.variables, TOKEN, native.independent, STEP)


def test_the_head_contains_version_size_and_checksum(written):
    magic, version, size, check = struct.unpack_from("<4sIII", written)
    assert (magic, version, size) == (b"PRBM", VERSION, len(written))
    assert check == zlib.crc32(written[16:])


def assert_same(mechanism: Mechanism, quantity, expected) -> None:
    """Compare the values of an expression for the default parameters and for others."""
    values = mechanism.values()
    for factor in (1.0, 1.25):
        scaled = {name: factor * x for name, x in values.items()}
        assert quantity(scaled) == pytest.approx(expected(scaled), rel=1e-15)


class Comparison:
    """Comparison of the items of the tables, in the order of the format, with the mechanism."""

    def __init__(self, mechanism: Mechanism, written: bytes) -> None:
        self.mechanism, self.reader = mechanism, Reader(written)
        self.native = described(Export(mechanism), 3, clock=True)
        self.bodies = ["ground", *(b.name for b in mechanism.bodies)]
        self.bounds = [
            (part, name)
            for part in mechanism._parts()
            for name in fields_of(part)
            if isinstance(field_of(part, name), str)
        ]

    def fields(self, part) -> None:
        for name in fields_of(part):
            assert_same(
                self.mechanism, self.reader.expression(), lambda v, name=name: value(part, name, v)
            )

    def point(self, drawn) -> None:
        x, y = (affine(coordinate) for coordinate in drawn)
        assert_same(self.mechanism, self.reader.point(), lambda v: (x(v), y(v)))

    def body(self) -> str:
        return self.bodies[self.reader.take("I")]

    def between(self, part) -> None:
        for end in (part.start, part.end):
            assert self.body() == end.rpartition(".")[0]
            self.point(self.mechanism.point(end, part.name))

    def placed(self, part) -> None:
        """Compare the name, body and point of a part; the default is the centre of mass."""
        assert (self.reader.text(), self.body()) == (part.name, part.body)
        bodies = self.mechanism.bodies
        self.point(part.point or next(b for b in bodies if b.name == part.body).centre)

    def head(self) -> None:
        m, r = self.mechanism, self.reader
        assert (r.text(), r.text()) == (TOKEN, m.name)
        counts = [r.take("I") for _ in range(16)]
        parts = (
            m.bodies, m.flexure_types, m.flexures, m.joints, m.springs, m.guides, m.stops,
            m.frictions, m.forces, m.probes, m.ground,
        )  # fmt: skip
        assert counts[0] == len(m.parameters)
        assert counts[1:12] == [*map(len, parts)]
        assert counts[12:] == [
            len(self.bounds), len(self.native.variables), len(self.native.independent),
            len(input_names(m)),
        ]  # fmt: skip

    def parameters_and_inputs(self) -> None:
        m, r = self.mechanism, self.reader
        for p in m.parameters:
            r.parameters.append(p.name)
            assert (r.text(), r.text()) == (p.name, p.unit)
            assert r.take("dddI") == (p.value, p.minimum, p.maximum, p.tunable)
        assert [r.parameters[r.take("I")] for _ in range(5)] == [
            "gravity.x", "gravity.y", "solver.tolerance", "damping.zeta", "damping.beta"
        ]  # fmt: skip
        assert r.take("d") == STEP
        for name in input_names(m):
            assert (r.text(), r.take("d")) == (name, 0.0)

    def body_data(self) -> None:
        for body in self.mechanism.bodies:
            assert self.reader.text() == body.name
            given, names = self.reader.take("I"), (*POSITIONS, *VELOCITIES)
            assert [bool(given >> i & 1) for i, _ in enumerate(names)] == [
                getattr(body, name) is not None for name in names
            ]
            self.fields(body)
            self.point(body.centre)

    def flexure_types(self) -> None:
        m, r = self.mechanism, self.reader
        for kind in m.flexure_types:
            model = m.model(kind)
            assert r.text() == kind.name
            assert r.take("IIII") == (
                model.lumped, model.rate_with_gamma, kind.axial, kind.stress,
            )  # fmt: skip
            assert r.take("II") == (len(model.gamma), kind.n)
            assert r.take("II") == (model.order, model.nodes)
            assert r.take("I") == ("leaf", "taper", "notch").index(kind.profile)
            given = r.take("I")
            names = [name for name in FIELDS[FlexureType] if name not in REQUIRED]
            assert [bool(given >> i & 1) for i, _ in enumerate(names)] == [
                field_of(kind, name) is not None for name in names
            ]
            self.fields(kind)
            for c in (*model.gamma, *model.K_theta):
                given = kind.coefficients.get(c.name, 0.0)
                expression = affine(given) if isinstance(given, str) else None
                name = f"{kind.name}.{c.name}"
                assert_same(m, r.expression(), expression or (lambda v, name=name: v[name]))

    def connections(self) -> None:
        m, r = self.mechanism, self.reader
        for flexure in m.flexures:
            assert (r.text(), r.take("I")) == (
                flexure.name, [k.name for k in m.flexure_types].index(flexure.type)
            )  # fmt: skip
            self.between(flexure)
            assert r.take("II") == tuple(("clamp", "pin", "free").index(e) for e in flexure.ends)
        for joint in m.joints:
            assert r.text() == joint.name
            self.between(joint)
            given = (joint.stiffness, joint.free_angle, joint.damping)
            assert r.take("III") == tuple(field is not None for field in given)
            self.fields(joint)
        for spring in m.springs:
            assert r.text() == spring.name
            self.between(spring)
            assert r.take("I") == (spring.free_length is not None)
            assert r.take("I") == 1 + spring.side
            self.fields(spring)
        for guide in m.guides:
            assert r.text() == guide.name
            for point in (guide.point, guide.start):
                assert self.body() == body_of(point)
                self.point(m.point(point, guide.name))
            self.point(m.point(guide.end, guide.name))
            assert r.take("II") == (not guide.turning, guide.friction is not None)
            self.fields(guide)

    def contacts_and_forces(self) -> None:
        m, r = self.mechanism, self.reader
        for stop in m.stops:
            assert (r.text(), self.body(), self.body()) == (stop.name, stop.body, stop.on)
            self.point(stop.point)
            assert (r.take("d"), r.take("I")) == (stop.direction, stop.compliant)
            self.fields(stop)
        for friction in m.frictions:
            self.placed(friction)
            assert r.take("d") == friction.direction
            self.fields(friction)
        for force in m.forces:
            self.placed(force)

    def probes_and_release(self) -> None:
        m, r = self.mechanism, self.reader
        for probe in m.probes:
            assert (r.text(), self.body()) == (probe.name, probe.point.rpartition(".")[0])
            self.point(m.point(probe.point, probe.name))
        release = m.release
        assert (self.body(), r.take("d")) == (release.body, release.direction)
        self.point(release.point or next(b for b in m.bodies if b.name == release.body).centre)
        start = ("displacement", "angle", "amplitude").index(release.start)
        assert r.take("II") == (start, release.mode or 0)
        self.fields(release)
        for place in m.ground.values():
            self.point(place)

    def limits(self) -> None:
        r = self.reader
        for part, name in self.bounds:
            unit, _, minimum, maximum, *_ = FIELDS[type(part)][name]
            assert (r.text(), r.text()) == (f"{part.name}.{name}", unit)
            assert_same(self.mechanism, r.expression(), affine(field_of(part, name)))
            assert r.take("dd") == (minimum, maximum)

    def variables(self) -> None:
        r, native = self.reader, self.native
        assert tuple(r.take("I") for _ in native.independent) == native.independent
        place = slots(self.mechanism, native.independent)
        by_name = {v.name: v for v in native.variables}
        before = -1
        for _ in native.variables:
            reference, kind, slot = r.take("III")
            v = by_name.pop(r.text())
            assert before < reference == v.reference
            assert TYPES[kind] == v.type
            assert slot == place[f"{v.name}_count" if v.type == CLOCK else v.name]
            before = reference
        assert not by_name


def test_tables_contain_every_field_of_the_mechanism(mechanism, written):
    """Every field of every part is compared, until the last byte of the tables."""
    comparison = Comparison(mechanism, written)
    comparison.head()
    comparison.parameters_and_inputs()
    comparison.body_data()
    comparison.flexure_types()
    comparison.connections()
    comparison.contacts_and_forces()
    comparison.probes_and_release()
    comparison.limits()
    comparison.variables()
    assert comparison.reader.at == len(written)


def test_start_values_are_those_of_the_variables(mechanism):
    """The start values of a parameter and an input are changed and found in the tables."""
    changes = {"solver.tolerance": 1e-5, "base.acceleration.y": 2.5}
    native = described(Export(mechanism, changes), 2)
    written = tables(mechanism, native.variables, TOKEN, native.independent)
    for name, start in changes.items():
        at = written.index(name.encode() + b"\0") + len(name) + 1
        at += 5 if name == "solver.tolerance" else 0  # Skip the unit, an empty text.
        assert struct.unpack_from("<d", written, at) == (start,)


def test_every_output_of_the_engine_has_a_unique_slot(mechanism):
    chosen = independent(mechanism)
    place = slots(mechanism, chosen)
    assert sorted(place.values()) == [*range(len(place))]
    simulation = Simulation(mechanism)
    assert {*simulation.outputs(), *simulation.values, *simulation.given} <= place.keys()


@pytest.mark.parametrize(
    ("parts", "counted"),
    [("probes", "1025 probes"), ("forces", "1025 forces"), ("stops", "65 stops")],
)
def test_mechanisms_too_large_for_the_kernel_are_not_written(parts, counted):
    guide = anvil()
    one = getattr(guide, parts)[0]
    count = int(counted.split()[0])
    more = tuple(replace(one, name=f"{one.name}{k}") for k in range(count))
    large = replace(guide, **{parts: more})
    with pytest.raises(MechanismError, match=f"Anvil has {counted}; a native FMU supports at most"):
        tables(large, (), TOKEN, ())


@pytest.mark.parametrize(
    ("name", "index", "number", "message"),
    [
        ("knock", 1, 2, "a stop whose wall is on its own body"),
        ("knock", 1, 9, "an index out of range"),
        ("leaf", 4, 0, "a flexure type without a model, or with several"),
        ("leaf", 5, 3, "a flexure type without a model, or with several"),
        ("leaf", 6, 3, "a flexure type without a model, or with several"),
        ("leaf", 7, 3, "a flexure type without a model, or with several"),
        ("leaf", 6, 13, "an index out of range"),
        ("leaf", 2, 2, "an index out of range"),
        ("chain", 5, 100000, "an index out of range"),
        ("chain", 5, 200, "a wrong number of independent coordinates"),
        ("hook", 0, 1, "a part that connects a body with itself"),
        ("hook", 20, 2, "an index out of range"),
        ("tip", 0, 9, "an index out of range"),
    ],
)
def test_tables_of_an_invalid_mechanism_are_rejected(name, index, number, message):
    """The number at ``index`` after the name of a part is replaced."""
    guide = elastic()
    written = bytearray(tables(guide, (), TOKEN, independent(guide)))
    at = written.index(struct.pack("<I", len(name)) + name.encode() + b"\0") + 5 + len(name)
    struct.pack_into("<I", written, at + 4 * index, number)
    struct.pack_into("<I", written, 12, zlib.crc32(written[16:]))
    with pytest.raises(KernelError, match=message):
        kernel().mechanism_open(bytes(written), len(written))


def test_the_length_of_a_name_is_in_bytes(tmp_path):
    path = tmp_path / "mine.toml"
    text = shipped()["PRBDM"].read_text(encoding="utf-8")
    path.write_text(text.replace('"left_flexure"', '"linke_Fläche"'), "utf-8")
    mechanism = read_mechanism(path)
    native = described(Export(mechanism), 2)
    written = tables(mechanism, native.variables, TOKEN, native.independent)
    name = "linke_Fläche".encode()
    assert struct.pack("<I", len(name)) + name + b"\0" in written
