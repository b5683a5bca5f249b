"""What a bake throws, as an object of points that plays by itself."""
