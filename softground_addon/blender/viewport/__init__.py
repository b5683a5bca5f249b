"""Steps in the viewport: the overlay, and steps that are picked, changed and dragged."""
