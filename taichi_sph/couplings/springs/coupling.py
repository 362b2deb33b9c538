def couplings(scene, groups):
    return []
