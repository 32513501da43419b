"""Random impacts and contacts at rest: a solution that satisfies all laws, or an error."""

import pytest

import random_contacts

ERRORS = {"newton": 0.0, "stronge": 0.02, "several": 0.02, "rest": 0.02}
"""Largest fractions of errors.  They occur if a wall moves against a contact locked by friction."""


@pytest.mark.parametrize("engine", ["package", "kernel"])
@pytest.mark.parametrize("kind", random_contacts.SEARCHES)
def test_random_contacts_satisfy_their_laws_or_are_rejected(kind, engine):
    check(random_contacts.search(engine, kind, 300), ERRORS[kind])


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["package", "kernel"])
@pytest.mark.parametrize("kind", random_contacts.SEARCHES)
def test_100_000_random_contacts_satisfy_their_laws_or_are_rejected(kind, engine):
    check(random_contacts.search(engine, kind, 100_000, seed=1), ERRORS[kind])


def check(found, errors):
    assert found.worst < 1e-9, found
    assert sum(found.errors.values()) <= errors * found.draws, found
