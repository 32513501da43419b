"""Measured data: records, uncertainties, evaluation of measurements."""
