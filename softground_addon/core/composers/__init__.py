"""What knows several stages: simulation, playhead, predictions, edited steps, plans and checks."""
