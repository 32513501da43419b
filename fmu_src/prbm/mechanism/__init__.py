"""Description of mechanisms: frozen data, expressions, parameters and flexure models."""
