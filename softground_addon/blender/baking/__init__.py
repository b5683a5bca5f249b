"""The bake: one generator that reads, checks, computes and writes."""
