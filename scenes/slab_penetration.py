"""A steel ogive of 15 g strikes a concrete slab at 664 m/s: how deep does it go, how wide is the crater? (P 4.2; Zhang et al. 2005)
"""

from taichi_sph.scene import (
    Box,
    Brick,
    Bullet,
    Concrete,
    Delay,
    Dimensionless,
    Grading,
    Material,
    Numerics,
    Output,
    PrescribedVelocity,
    Quality,
    Quantity,
    Rigid,
    Scene,
    Solid,
    Speed,
    Time,
    Length,
)

RADIUS, SHANK, CRH, MASS = 6.3e-3, 5e-3, 2.5, 15e-3


def scene(quality: Quality = "draft", velocity: Speed = 664.0, tau_c: Time = 8e-6, flattest: Dimensionless = 0.3, loosest: Dimensionless = 2.0, D_c: Dimensionless=0.99, d: Length = 3.15e-3, duration: Time=150e-6, viscous: bool=True, cap: float=0.0) -> Scene:
    ogive = Bullet(radius=RADIUS, length=SHANK, crh=CRH, turned=True)
    lift = SHANK + ogive.nose + 1e-5
    concrete = Material(name="concrete", source="P", young=30e9, poisson=0.22, density=2300,
        damage=Concrete(tension=19.3e6, compression=115e6, A=1, B=965, flattest=flattest, loosest=loosest), delay=Delay(a=1, tau_c=tau_c), critical_damage=D_c)
    slab = Solid(name="slab", shape=Brick(size=(0.15, 0.085, 0.15), origin=(0, 0, -0.15), graded=Grading(lo=(None, None, -0.048), hi=(0.042, 0.042, None), growth=1.2, largest=10e-3)), material=concrete, viscous=viscous)
    near = 1e-6
    return Scene(
        name="slab_penetration", title="Ogive into a concrete slab", source="P 4.2", quality=quality,
        solids=[slab],
        rigids=[Rigid(name="ogive", surface=ogive.model_copy(update={"origin": (0, 0, lift)}), mass=0.25 * MASS, velocity=(0, 0, -velocity), slides="z", spacing=1e-3)],
        motions=[PrescribedVelocity(body="slab", where=Box(hi=(near, None, None), lo=(None, near, None)), velocity=(0, None, None)),
                 PrescribedVelocity(body="slab", where=Box(hi=(None, near, None), lo=(near,None,None)), velocity=(None, 0, None)),
                 PrescribedVelocity(body="slab", where=Box(hi=(near, near, None)), velocity=(0, 0, None))],
        duration=duration, numerics=Numerics(spacing=d, contact={"tolerance": 1e-3}), output=Output(frames=30, samples=200),
    )


if __name__ == "__main__":
    from taichi_sph.cli import main

    main(scene)
