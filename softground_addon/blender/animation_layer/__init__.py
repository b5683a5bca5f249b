"""Keys above an animation, as a layer that can be taken off again: in the NLA, or in a copied action."""
