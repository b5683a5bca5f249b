"""Relief of prints: broken edges, chunks, cracks and tread, in the heights that are shown and nowhere else."""
