"""Nothing is said of wetting: a fluid presses on all that it may meet, unless it is carried by pinballs alone."""

from __future__ import annotations

from ...scene.kinds import Kind

KIND = Kind("wetting", "", None, "taichi_sph.couplings.wetted.coupling:couplings", rank=0)  # before contact, which sees its forces
