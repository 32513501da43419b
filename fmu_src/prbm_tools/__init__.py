"""What a desk needs and an FMU does not: mechanism files, figures, animation, fits."""
