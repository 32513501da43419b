"""The results of the thesis, reproduced beside printed values and finite elements."""
