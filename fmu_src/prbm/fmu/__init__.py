"""Functional Mock-up Units: model descriptions, documentation, archives and builders."""
