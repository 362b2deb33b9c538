"""Ductile damage by the plastic strain of a neck, where cells are narrower than one (`damage.spread`).

A neck in a sheet is about as wide as the sheet is thick (laws/necking.py), however narrow the cells are. A shell does not know: it is
a membrane beyond its greatest pull, so that all further strain gathers in one row of cells, and the elongation of its neck is that of a
cell. So damage goes by a mean over the neck instead of the strain of the cell alone,

    dp_s = sum_j Phi_sj dp_j,   Phi_sj = W(X_j - X_s) A_j / sum_k W(X_k - X_s) A_k

over the stress points j of the same body on the undeformed shell (Pijaudier-Cabot and Bazant 1987; of the plastic strain beside a local
plastic flow, Grassl and Jirasek 2006). W is the cubic spline B3, whose h is chosen so that a line of strain that is spread has the
width e of the neck:

    int int W dx dy / int W dy = (7 pi / 10 h^2) / (3 / 2 h) = e,   h = 15 / (7 pi) e

Then a row of cells of width D that alone takes the strain p has the mean p D / e: it breaks at the elongation e eps_r, that of a neck. A
field that is even stays as it is, for the weights sum to 1. What a crack or a slit hides takes no part. Where cells are as wide as
the sheet is thick or wider, a cell is its own neighbour alone, and `necks` says what it bears.

The mean is that of the last step: every point then reads what no other one writes. It grows with the increments of what is seen
now, so that a crack, which changes the weights, damages nothing by itself. Flow and thickness stay local.
"""

import math

import numpy as np

from ...pool import Pool
from ...runtime import ti
from ..shell.build import Model, cell_spacing, spread_over_cells
from ..shell.sections import Sheet
from .links import Links, Rows, Sources
from .slits import Slits

NECK = 15.0 / (7.0 * math.pi)  # h over the width of a neck
SAME = 1e-6  # of the thickness: a cell as wide as that spreads nothing
ALONE = 0.25  # of the spacing: h of a cell that has no neighbour but itself


def narrow(model: Model) -> np.ndarray:
    """(M,) width of the necks of cells [m]; 0 where they are as wide as their sheet is thick, or spread no damage."""
    return spread_over_cells(model.bodies, [_neck(sheet) for sheet in model.material.sheets])


def _neck(sheet: Sheet) -> float:
    """Width of the neck in a sheet [m], 0 where nothing is spread: as in laws/necking.py the mean spacing of its mesh counts."""
    asked = getattr(sheet.material.damage, "spread", None)
    return sheet.thickness if asked and sheet.width < sheet.thickness * (1 - SAME) else 0.0


class Spread(Pool):
    """Neighbourhoods of stress points, one a cell, and the means over them."""

    def __init__(self, name: str, model: Model, hidden: Slits | None):
        """hidden: slits, across which nothing is seen."""
        super().__init__(name)
        self.cells = cells = model.cells
        mesh, n = model.mesh, model.cells.n
        neck = narrow(model)
        h = np.where(neck > 0, NECK * neck, ALONE * cell_spacing(mesh))
        body = np.concatenate([np.full(one.cells.n, k) for k, one in enumerate(model.bodies)])
        self.rows = Links(
            f"{name}.rows",
            Sources(cells.centre, n, cells.broken, cells.body if len(model.bodies) > 1 else None, cells.area),
            Rows.at(mesh.centres, mesh.frames, h, 0, body),
        )
        if hidden is not None:
            hidden.hide(self.rows, np.repeat(mesh.centres[:, None], 2, axis=1), mesh.centres)
        self.rows.renew_all()
        self.base = self.field("base", n, doc="p of each point when its mean was taken last", keeps=True)

    def gather(self) -> None:
        """The means of what has flowed since the last call."""
        _gather(self, self.cells.n)
        _noted(self, self.cells.n)

    def open(self, n_new: int) -> None:
        """Cells on the list `new` broke: what they hide takes no part any more."""
        self.rows.renew_touched(self.rows.cut_through(self.cells, self.cells.new, n_new))


@ti.kernel
def _gather(spread: ti.template(), n: ti.i32):
    for s in range(n):
        step = spread.base[0] * 0.0
        for k in range(spread.rows.start[s], spread.rows.start[s + 1]):
            j = spread.rows.source[k]
            step += spread.rows.coef[k] * (spread.cells.plastic[j] - spread.base[j])
        spread.cells.neck_step[s] = step
        spread.cells.neck[s] += step


@ti.kernel
def _noted(spread: ti.template(), n: ti.i32):
    for s in range(n):
        spread.base[s] = spread.cells.plastic[s]
