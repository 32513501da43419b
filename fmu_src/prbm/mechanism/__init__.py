"""The description of a mechanism: frozen data, expressions, parameters, flexure models."""
