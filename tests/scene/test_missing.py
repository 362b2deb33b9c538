"""What users of other codes try is answered by what is not possible yet, or by where it stands."""

from __future__ import annotations

import pytest

from taichi_sph import scene as vocabulary
from taichi_sph.errors import SceneError
from taichi_sph.scene import Scene, checked
from taichi_sph.scene.missing import ELSEWHERE, NOT_YET

from .examples import spoiled


@pytest.mark.parametrize("table", [NOT_YET, ELSEWHERE])
def test_no_key_of_the_tables_exists(table):
    """A key that came to exist must leave the table, for its sentence would be false."""
    for name, keys in table.items():
        assert not set(keys) & set(getattr(vocabulary, name).model_fields), name
        assert all(why and why[-1] != "." and "\n" not in why for why in keys.values())


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("shells.0.thicknesses", [1, 2], "shells[0].thicknesses is said of sections: sections = (Section(where=..., thickness=...),)"),
        ("shells.0.friction", 0.3, "shells[0].friction is said of a pair of bodies: Meeting(between=(one, other), friction=...)"),
        ("shells.0.restitution", 0.3, "shells[0].restitution is said of a pair of bodies: Meeting(between=(one, other), restitution=...)"),
        ("shells.0.surface", {"kind": "stiffened_panel"}, "shells[0].surface.kind = 'stiffened_panel': not possible yet: three cells"),
        ("forces.0.where", {"kind": "cylinder"}, "forces[0].where.kind = 'cylinder': not possible yet: regions are boxes, balls"),
        ("temperature", 300, "temperature: not possible yet: temperature is not followed"),
        ("hinges", [], "hinges: not possible yet: bodies are joined by contact, springs and welds alone; no hinges by name: a Weld of two"),
        ("hinge", [], "hinge: not possible yet: bodies are joined by contact"),
        ("inflows", [], "inflows: not possible yet: water neither flows in nor out at a boundary"),
        ("outlet", [], "outlet: not possible yet: water neither flows in nor out at a boundary"),
        ("rivets", [], "a Spring(between=..., points=..., stiffness=..., radius=...) holds two bodies at a place"),
        ("bolt", [], "preload is its tension"),
        ("cohesive", {}, "cohesive: not possible yet: what is joined does not part"),
        ("turbulence", "les", "turbulence: not possible yet: water has no turbulence model"),
        ("remeshing", True, "remeshing: not possible yet: cells stay what they are"),
        ("airbags", [], "airbags: not possible yet: a gas keeps its mass: Gas(body=..., pressure=...)"),
        ("SpotWelds", [], "SpotWelds are welds of shells: Weld(between=(one, other), radius=...)"),
        ("spot_weld", [], "spot_weld are welds of shells"),
        ("shells.0.imperfection", 1e-3, "give a Net or a MeshFile with the imperfection"),
        ("boundary_conditions", [], "boundary_conditions are motions: PrescribedVelocity(where="),
        ("numerics.dt", 1e-6, "numerics.dt follows from the spacing"),
        ("numerics.contact", {"type": "penalty"}, "numerics.contact.type: not possible yet: there is one kind of contact"),
        ("shells.0.thicknes", 1, "unknown key 'thicknes' in shells[0]; did you mean 'thickness'?"),
    ],
)  # fmt: skip
def test_what_is_said(key, value, said):
    with pytest.raises(SceneError) as error:
        checked(Scene, lambda: Scene(**spoiled(key, value)))
    assert said in str(error.value) and "\n" not in str(error.value)
