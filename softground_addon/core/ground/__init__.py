"""The ground: its shape, its material, its cells and how they are displayed."""
