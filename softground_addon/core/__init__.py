"""The physics of SoftGround: numpy only, SI units, Z up."""
