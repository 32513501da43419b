"""The functions of the standards: their arguments, and the states in which they are allowed."""

import random
from ctypes import c_bool, c_char_p, c_double, c_int, c_size_t, c_uint32, c_void_p
from pathlib import Path
from typing import Any

from native_host import DISCARD, ERROR, OK, Instance

OTHERS3 = ("Float32", "Int8", "UInt8", "Int16", "UInt16", "UInt32", "Int64", "UInt64")
TYPES3 = ("Float64", "Int32", "Boolean", "String", *OTHERS3)
TYPES2 = ("Real", "Integer", "Boolean", "String")
# Arguments after the instance: p pointer, n length, d number, b Boolean, r reference, i Integer.
SIGNATURES = {
    2: {
        **{way + kind: "pnp" for way in ("Get", "Set") for kind in TYPES2},
        "SetDebugLogging": "bnp", "SetupExperiment": "bddbd",
        "EnterInitializationMode": "", "ExitInitializationMode": "", "Terminate": "", "Reset": "",
        "GetFMUstate": "p", "SetFMUstate": "p", "FreeFMUstate": "p",
        "SerializedFMUstateSize": "pp", "SerializeFMUstate": "ppn", "DeSerializeFMUstate": "pnp",
        "GetDirectionalDerivative": "pnpnpp", "EnterEventMode": "", "NewDiscreteStates": "p",
        "EnterContinuousTimeMode": "", "CompletedIntegratorStep": "bpp", "SetTime": "d",
        "SetContinuousStates": "pn", "GetDerivatives": "pn", "GetEventIndicators": "pn",
        "GetContinuousStates": "pn", "GetNominalsOfContinuousStates": "pn",
        "SetRealInputDerivatives": "pnpp", "GetRealOutputDerivatives": "pnpp", "DoStep": "ddb",
        "CancelStep": "", "GetStatus": "ip", "GetRealStatus": "ip", "GetIntegerStatus": "ip",
        "GetBooleanStatus": "ip", "GetStringStatus": "ip",
    },
    3: {
        **{way + kind: "pnpn" for way in ("Get", "Set") for kind in TYPES3},
        "GetBinary": "pnppn", "SetBinary": "pnppn", "GetClock": "pnp", "SetClock": "pnp",
        "SetDebugLogging": "bnp", "EnterInitializationMode": "bddbd",
        "ExitInitializationMode": "", "EnterEventMode": "", "Terminate": "", "Reset": "",
        "GetNumberOfVariableDependencies": "rp", "GetVariableDependencies": "rppppn",
        "GetFMUState": "p", "SetFMUState": "p", "FreeFMUState": "p",
        "SerializedFMUStateSize": "pp", "SerializeFMUState": "ppn", "DeserializeFMUState": "pnp",
        "GetDirectionalDerivative": "pnpnpnpn", "GetAdjointDerivative": "pnpnpnpn",
        "EnterConfigurationMode": "", "ExitConfigurationMode": "",
        "GetIntervalDecimal": "pnpp", "GetIntervalFraction": "pnppp", "GetShiftDecimal": "pnp",
        "GetShiftFraction": "pnpp", "SetIntervalDecimal": "pnp", "SetIntervalFraction": "pnpp",
        "SetShiftDecimal": "pnp", "SetShiftFraction": "pnpp", "EvaluateDiscreteStates": "",
        "UpdateDiscreteStates": "pppppp", "EnterContinuousTimeMode": "",
        "CompletedIntegratorStep": "bpp", "SetTime": "d", "SetContinuousStates": "pn",
        "GetContinuousStateDerivatives": "pn", "GetEventIndicators": "pn",
        "GetContinuousStates": "pn", "GetNominalsOfContinuousStates": "pn",
        "GetNumberOfEventIndicators": "p", "GetNumberOfContinuousStates": "p",
        "EnterStepMode": "", "GetOutputDerivatives": "pnppn", "DoStep": "ddbpppp",
        "ActivateModelPartition": "rd",
    },
}  # fmt: skip
"""Functions by name without the prefix, except those that create and free instances."""

ALWAYS2 = {
    "SetDebugLogging", "Terminate", "Reset", "GetFMUstate", "SetFMUstate", "FreeFMUstate",
    "SerializedFMUstateSize", "SerializeFMUstate", "DeSerializeFMUstate",
}  # fmt: skip
ALWAYS3 = {
    "SetDebugLogging", "Terminate", "Reset", "GetFMUState", "SetFMUState", "FreeFMUState",
    "SerializedFMUStateSize", "SerializeFMUState", "DeserializeFMUState",
}  # fmt: skip
COUNTS3 = {"GetNumberOfEventIndicators", "GetNumberOfContinuousStates"}
GET2, SET2 = {"Get" + kind for kind in TYPES2}, {"Set" + kind for kind in TYPES2}
GET3 = {"Get" + kind for kind in (*TYPES3, "Binary")}
SET3 = {"Set" + kind for kind in (*TYPES3, "Binary")}
EVALUATE2 = {
    "GetDirectionalDerivative", "GetDerivatives", "GetEventIndicators", "GetContinuousStates",
    "GetNominalsOfContinuousStates",
}  # fmt: skip
EVALUATE3 = EVALUATE2 - {"GetDerivatives"} | {"GetContinuousStateDerivatives"}
STATUS2 = {"GetStatus", "GetRealStatus", "GetIntegerStatus", "GetBooleanStatus", "GetStringStatus"}
IN_ME = {"CompletedIntegratorStep", "SetTime", "SetContinuousStates", "EnterEventMode"}
ALLOWED: dict[tuple[int, str], dict[str, set[str]]] = {
    (2, "me"): {
        "instantiated": ALWAYS2 | GET2 | SET2
        | {"SetupExperiment", "EnterInitializationMode", "GetNominalsOfContinuousStates"},
        "initialization": ALWAYS2 | GET2 | SET2 | EVALUATE2 | {"ExitInitializationMode"},
        "event": ALWAYS2 | GET2 | SET2 | EVALUATE2
        | {"EnterEventMode", "NewDiscreteStates", "EnterContinuousTimeMode", "SetTime"},
        "continuous": ALWAYS2 | GET2 | {"SetReal"} | EVALUATE2 | IN_ME,
        "terminated": ALWAYS2 | GET2 | EVALUATE2,
    },
    (2, "cs"): {
        "instantiated": ALWAYS2 | GET2 | SET2 | {"SetupExperiment", "EnterInitializationMode"},
        "initialization": ALWAYS2 | GET2 | SET2 | {"ExitInitializationMode"},
        "step": ALWAYS2 | GET2 | SET2 | STATUS2 | {"DoStep"},
        "terminated": ALWAYS2 | GET2 | STATUS2,
    },
    (3, "me"): {
        "instantiated": ALWAYS3 | COUNTS3 | GET3 | SET3 | {"EnterInitializationMode"},
        "initialization": ALWAYS3 | COUNTS3 | GET3 | SET3 | EVALUATE3 | {"ExitInitializationMode"},
        "event": ALWAYS3 | COUNTS3 | GET3 | SET3 | EVALUATE3
        | {"GetClock", "SetClock", "EvaluateDiscreteStates", "UpdateDiscreteStates",
           "EnterContinuousTimeMode", "SetTime"},
        "continuous": ALWAYS3 | COUNTS3 | GET3 | {"SetFloat32", "SetFloat64"} | EVALUATE3 | IN_ME,
        "terminated": ALWAYS3 | COUNTS3 | GET3 | EVALUATE3,
    },
    (3, "cs"): {
        "instantiated": ALWAYS3 | GET3 | SET3 | {"EnterInitializationMode"},
        "initialization": ALWAYS3 | GET3 | SET3 | {"ExitInitializationMode"},
        "step": ALWAYS3 | GET3 | SET3 | {"DoStep"},
        "terminated": ALWAYS3 | GET3,
    },
}  # fmt: skip
ALLOWED[3, "events"] = ALLOWED[3, "cs"] | {
    "step": ALLOWED[3, "cs"]["step"] | {"EnterEventMode"},
    "event": ALWAYS3 | GET3 | SET3
    | {"GetClock", "SetClock", "EvaluateDiscreteStates", "UpdateDiscreteStates", "EnterStepMode"},
}  # fmt: skip
"""Allowed functions by version and interface, then by state.  They are those of the standards; in
FMI 2.0 start values may also be read before initialization, in FMI 3.0 the time may also be set in
Event Mode."""

NOTHING = {
    "p": lambda version: c_void_p(), "n": lambda version: c_size_t(0),
    "d": lambda version: c_double(0.0), "r": lambda version: c_uint32(0),
    "i": lambda version: c_int(0),
    "b": lambda version: c_int(0) if version == 2 else c_bool(False),
}  # fmt: skip


def raw(it: Instance, name: str, *, instance: int | type | None = Instance) -> int:
    """Call a function with zeros and NULLs, without FMPy's signatures; return its status.

    The handle is that of ``it`` unless another address is given.
    """
    handle = it.fmu.component if instance is Instance else instance
    kinds = SIGNATURES[it.version][name]
    function = it.fmu.dll[f"fmi{it.version}{name}"]
    return int(function(c_void_p(handle), *(NOTHING[kind](it.version) for kind in kinds)))


def free(it: Instance, instance: int | None) -> None:
    """Free an instance by its address."""
    function = it.fmu.dll[f"fmi{it.version}FreeInstance"]
    function.restype = None
    function(c_void_p(instance))


# -- random calls --

NUMBERS = (0.0, 1e-3, -1.0, 0.5, 1e300, float("nan"), float("inf"), 1e-320)


class Caller:
    """Caller of functions of an FMU with random arguments, valid or invalid.

    Arrays are longer than any length that is passed, so only the FMU can access invalid memory.
    """

    ROOM = 4096

    def __init__(self, instance: Instance, seed: int) -> None:
        self.it, self.chance = instance, random.Random(seed)
        self.references = [*instance.references.values(), 0, 12345, 2**32 - 1]
        self.vr = (c_uint32 * self.ROOM)()
        self.numbers = [(c_double * self.ROOM)() for _ in range(8)]
        self.words = (c_char_p * self.ROOM)(*[b"logAll"] * self.ROOM)

    def pointer(self, name: str, first: bool) -> Any:
        """Return NULL, or an array of the type that the function expects."""
        if self.chance.random() < 0.1:
            return c_void_p()
        if name in ("SetDebugLogging", "SetString", "SetBinary"):
            return self.vr if first and name != "SetDebugLogging" else self.words
        if first and ("n" in SIGNATURES[self.it.version][name][1:2]) and "States" not in name:
            for k in range(16):
                self.vr[k] = self.chance.choice(self.references)
            return self.vr
        array = self.chance.choice(self.numbers)
        for k in range(16):
            array[k] = self.chance.choice(NUMBERS)
        return array

    def argument(self, kind: str, name: str, first: bool) -> Any:
        chance = self.chance
        if kind == "p":
            return self.pointer(name, first)
        if kind == "n":
            return c_size_t(chance.choice((0, 1, 1, 2, 4, 12, 16)))
        if kind == "d":
            return c_double(chance.choice((*NUMBERS, self.it.time)))
        if kind == "r":
            return c_uint32(chance.choice(self.references))
        if kind == "i":
            return c_int(chance.choice((0, 1, 2, 3, -1, 99)))
        return c_bool(chance.random() < 0.5) if self.it.version == 3 else c_int(chance.randrange(3))

    def call(self, name: str) -> int:
        function = self.it.fmu.dll[f"fmi{self.it.version}{name}"]
        kinds = SIGNATURES[self.it.version][name]
        arguments = [self.argument(kind, name, k == 0) for k, kind in enumerate(kinds)]
        return int(function(c_void_p(self.it.fmu.component), *arguments))


STATES = ("SetFMUstate", "SetFMUState", "FreeFMUstate", "FreeFMUState", "SerializedFMUstateSize",
          "SerializedFMUStateSize", "SerializeFMUstate", "SerializeFMUState",
          "GetFMUstate", "GetFMUState")  # fmt: skip
"""Functions that take the address of a state; it cannot be checked, so they are left out."""


def wrong_calls(fmu: Path, kind: str, count: int) -> int:
    """Call random functions in every state; return how many calls were rejected with a message."""
    rejected, rounds = 0, 100
    for seed in range(count // rounds):
        with Instance(fmu, kind, f"it {seed}") as instance:
            chance, caller = random.Random(seed), Caller(instance, seed)
            if seed % 4:
                instance.enter()
            if seed % 4 > 1:
                instance.begin()
            if seed % 4 > 2 and kind == "events":
                instance.fmu.enterEventMode()
            names = [name for name in SIGNATURES[instance.version] if name not in STATES]
            for _ in range(rounds):
                logged, name = len(instance.log), chance.choice(names)
                found = caller.call(name)
                if name == "SetDebugLogging":
                    assert instance.call(name, True, 0, None) == OK
                else:
                    assert found == OK or len(instance.log) > logged, name
                    assert found in (OK, DISCARD, ERROR), (name, found)
                rejected += found != OK
            instance.reset()
            instance.initialize()
            instance.advance(1e-3)
            assert instance.values()["stop.impact_count"] == 0
    return rejected
