"""What a scene is to keep: the claims of its figure, and the ground's invariants with every option on."""

EVERY_OPTION = {
    "pressure": "CENTRE_OF_PRESSURE",
    "material.rim_bias": "0.5",
    "material.repose_angle": "0.5585",
    "material.shortest_time": "0.02",
    "material.hardening": "10",
    "material.crust_stress": "5000",
    "material.firm_depth": "0.02",
    "tilt.use": "true",
    "grounding.use": "true",
}
COARSE = 0.015  # m


def keeps_its_claims(module, scene, cell_size):
    built = module.build(scene, cell_size=cell_size)
    failed = [str(claim) for claim in module.claims(built) if not claim.holds]
    assert not failed
    for bake in built.bakes.values():
        assert bake.footprints


def keeps_the_invariants(module, scene):
    from sample_scenes import production

    built = module.build(scene, cell_size=COARSE, options=EVERY_OPTION)
    failed = [str(claim) for bake in built.bakes.values() for claim in production.invariants(bake) if not claim.holds]
    assert not failed
