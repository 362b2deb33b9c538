"""Johnson-Cook's influence of the strain rate: sigma_y is multiplied by 1 + C ln(rate / rate0) (T 2.104, 2.108).

Below rate0 the factor is 1. The rate is the smoothed one of T 2.106, the mean of this step's and the last one's

    v = sqrt(2/3 (d_xx^2 + d_yy^2 + d_zz^2 + 2 d_xy^2 + 1/2 (gamma_xz^2 + gamma_yz^2)))

of the total strain (T 2.107), with what T leaves out: d_zz = -(d_xx + d_yy) of plastic incompressibility (without
it a uniaxial rate reads 0.91 of itself), and bending, of which it takes the mean square over the thickness.

A solid that keeps its heat softens by 1 - T*^m, T* = (T - T_room) / (T_melt - T_room) (Johnson and Cook 1983).
"""

from ..runtime import ti


@ti.func
def square(d11, d22, d12):
    """v^2 of the plane part; d12 is the tensor component."""
    return 4.0 / 3.0 * (d11 * d11 + d22 * d22 + d11 * d22 + d12 * d12)


@ti.func
def factor(rate, C, rate0):
    """1 + C ln(rate / rate0), at least 1."""
    return 1.0 + C * ti.log(ti.max(rate / rate0, 1.0))


@ti.func
def softening(temperature, room, melting, m):
    """1 - T*^m, 1 below `room`, 0 from `melting` on."""
    above = ti.min(ti.max((temperature - room) / (melting - room), 0.0), 1.0)
    result = above * 0.0 + 1.0
    if above > 0.0:
        result -= ti.pow(above, m)
    return result
