"""Measured data: reading of records, uncertainties, and evaluation of measurements."""
