"""Working memory of the kernel: what a function takes is free again when it returns.

A function gets the rest of the working memory as a copy, ``Scratch``, and hands copies on.  What it
takes of its copy is free again when it returns, on every path.  A ``Scratch *`` is for memory that
the caller wants.  The simulation keeps the whole rest, ``sim->scratch``, and a tangent what it has
left, ``t->scratch``.  A function that takes from a copy of them may not call another that copies
them, too: both would use the same memory.  It passes its own copy, or the simulation has a place
for the data.
"""

import re
from collections.abc import Iterator, Mapping

import pytest

from kernel_library import KERNEL

FUNCTION = re.compile(
    r"^(?:PRBM |static |EXPORTED |SHARED )[^;{}()=]*?\b(\w+)\(([^;{}]*?)\) \{\n(.*?)^\}",
    re.MULTILINE | re.DOTALL,
)
COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
LOOP = re.compile(r"(?<!\} )\b(?:for|while) \(|\bdo \{")
KEPT = {"simulation": r"\bsim(?:ulation)?->scratch\b", "tangent": r"\bt->scratch\b"}
"""Reading the rest that outlives a function, by its owner."""
HELD = {
    "simulation": (r"\b(?:Scratch|Tangent)\b", r"\bScratch \w+ = |\bt\.scratch\b"),
    "tangent": (r"\bScratch\b", r"\bScratch \w+ = t->scratch\b"),
}
"""Parameters and statements from which on a function may have taken from that rest."""


def functions(texts: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    """Return the parameters and the bodies of all functions by name."""
    return {
        name: (parameters, body)
        for text in texts.values()
        for name, parameters, body in FUNCTION.findall(COMMENT.sub("", text))
    }


def called(body: str, known: Mapping[str, object]) -> set[str]:
    """Return the functions that a text calls by their names."""
    return {name for name in re.findall(r"(?<![.>\w])(\w+)\(", body) if name in known}


def readers(known: Mapping[str, tuple[str, str]], pattern: str) -> set[str]:
    """Return the functions that read the kept rest, or call one that does."""
    found = {name for name, (_, body) in known.items() if re.search(pattern, body)}
    uses = {name: called(body, known) - {name} for name, (_, body) in known.items()}
    while more := {name for name in uses if uses[name] & found} - found:
        found |= more
    return found


def shared(texts: Mapping[str, str]) -> Iterator[str]:
    """Yield the calls after which two functions use the same memory."""
    known = functions(texts)
    for owner, pattern in KEPT.items():
        reading = readers(known, pattern)
        parameter, statement = HELD[owner]
        for name, (parameters, body) in known.items():
            first = re.search(statement, body)
            start = 0 if re.search(parameter, parameters) else first.end() if first else len(body)
            for other in sorted(called(body[start:], known) & reading - {name}):
                yield f"{name} holds memory of the {owner}, and {other} takes of it"
            if re.search(r"(?:->|\.)\w+\((?:sim|simulation|&?t)[,)]", body[start:]):
                yield f"{name} holds memory of the {owner}, and calls a function by its address"


def loops(body: str) -> Iterator[str]:
    """Yield the statements that loops repeat."""
    for match in LOOP.finditer(body):
        start, depth = body.index("{", match.start()), 0
        for end in range(start, len(body)):
            depth += {"{": 1, "}": -1}.get(body[end], 0)
            if not depth:
                yield body[start:end]
                break


def repeated(texts: Mapping[str, str]) -> Iterator[str]:
    """Yield the loops that take more memory in each turn."""
    for name, (_, body) in functions(texts).items():
        for loop in loops(body):
            inside = set(re.findall(r"\bScratch (\w+) =", loop))
            if set(re.findall(r"&(\w*scratch|inner)\b", loop)) - inside:
                yield f"{name} takes memory in a loop"


def written(texts: Mapping[str, str]) -> Iterator[str]:
    """Yield the functions that give memory back by hand, or move the kept rest."""
    for name, (_, body) in functions(texts).items():
        if re.search(r"\w*(?:scratch|inner)(?:->|\.)used\b|&(?:sim|t|simulation)->scratch", body):
            yield f"{name} changes how much memory is taken"


def mistakes(texts: Mapping[str, str]) -> list[str]:
    """Return what the functions do wrong with working memory."""
    return [*shared(texts), *repeated(texts), *written(texts)]


def sources() -> dict[str, str]:
    """Return the texts of the C files by name."""
    return {
        path.relative_to(KERNEL).as_posix(): path.read_text(encoding="utf-8")
        for path in sorted(KERNEL.rglob("*.c"))
    }


def test_no_function_can_keep_or_share_working_memory():
    known = functions(sources())
    assert len(known) > 1000
    assert len(readers(known, KEPT["simulation"])) > 100
    allowed = {f"{name} changes how much memory is taken" for name in ("take", "place_all")}
    assert set(mistakes(sources())) == allowed


RIGHT = """
static bool inner_sum(const System *system, Scratch scratch) {
    double *x = take(&scratch, 1);
    return *x > 0.0;
}

static bool reader(Simulation *sim) {
    return inner_sum(system_of(sim), sim->scratch);
}

static bool through(Simulation *sim) {
    return reader(sim);
}
"""


@pytest.mark.parametrize(
    ("wrong", "complaint"),
    [
        (
            "static bool f(Simulation *sim) {\n    Scratch scratch = sim->scratch;\n"
            "    double *x = take(&scratch, 1);\n    return *x > 0.0 && through(sim);\n}",
            "f holds memory of the simulation, and through takes of it",
        ),
        (
            "static bool f(Simulation *sim, Scratch scratch) {\n"
            "    double *x = take(&scratch, 1);\n    return *x > 0.0 && reader(sim);\n}",
            "f holds memory of the simulation, and reader takes of it",
        ),
        (
            "static bool f(Simulation *sim, Scratch scratch) {\n    return sim->call(sim);\n}",
            "f holds memory of the simulation, and calls a function by its address",
        ),
        (
            "static bool f(const Tangent *t) {\n    Scratch scratch = t->scratch;\n"
            "    return g(t);\n}\n\nstatic bool g(const Tangent *t) {\n"
            "    return inner_sum(t->eq->system, t->scratch);\n}",
            "f holds memory of the tangent, and g takes of it",
        ),
        (
            "static void f(Scratch scratch) {\n    while (true) {\n"
            "        take(&scratch, 1);\n    }\n}",
            "f takes memory in a loop",
        ),
        (
            "static void f(Simulation *sim) {\n    sim->scratch.used = 0;\n}",
            "f changes how much memory is taken",
        ),
        (
            "static void f(Simulation *sim) {\n    take(&sim->scratch, 1);\n}",
            "f changes how much memory is taken",
        ),
    ],
)
def test_mistakes_are_found(wrong, complaint):
    assert mistakes({"right.c": RIGHT}) == []
    assert complaint in mistakes({"right.c": RIGHT, "wrong.c": wrong})


def test_a_function_may_take_after_its_last_call_and_a_loop_from_its_own_copy():
    text = (
        "static void f(Simulation *sim) {\n    bool ok = through(sim);\n"
        "    Scratch scratch = sim->scratch;\n    while (ok) {\n        Scratch inner = scratch;\n"
        "        ok = inner_sum(take(&inner, 1), inner);\n    }\n}"
    )
    assert mistakes({"right.c": RIGHT, "more.c": text}) == []
