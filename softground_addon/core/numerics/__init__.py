"""Mathematics that knows nothing of feet: rigid motions, interpolation, splines, intervals, keys of cells."""
