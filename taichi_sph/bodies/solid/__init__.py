"""Solids: hexahedra and tetrahedra with one stress point each, as finite elements or with the wider functions of particles."""
