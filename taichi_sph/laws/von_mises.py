"""Von Mises plasticity of a shell: equivalent stress in global form, and the return to the yield surface.

Of a cross-section, m is the membrane stress, b = sigma_b / sqrt(3) with the skin stress sigma_b = 6 M / e^2 and
s the mean transverse shear stress. b works on the curvature times e / sqrt(12), the radius of gyration of the
section, so m, b and s are conjugate to strains (eps, beta, gamma) with one volume e for all. With the von Mises
product (x, y) = x11 y11 + x22 y22 + 3 x12 y12 - 1/2 (x11 y22 + x22 y11), T 2.43 to 2.47 read

    sigma_eq^2 = (m, m) + 2 c (m, b) + 3 alpha^2 (b, b) + 3 kappa s.s,      c = +- alpha / 2 with the sign of (m, b)

(Ilyushin's cross term is never negative, T 2.43 prints it without its sign). alpha is constant: T speaks of
Crisfeld's gradual hinge but gives no law for it. alpha = 2/3: M = sigma_y e^2 / 4, the full hinge; alpha = 1:
M = sigma_y e^2 / 6, yield of the skin. The flow is normal to the surface in these conjugate strains,
d(eps, beta, gamma) = dp d sigma_eq / d(m, b, s), so sigma_eq dp is the work and, in a hinge, p is the mean plastic
strain over the thickness.

**Return** (annexes B and D, in the effective stress of T 2.76, implicit instead of B.8's approximation). H and
the von Mises product share eigenvectors, and c mixes m and b alike in all of them: in the directions x, y that
diagonalise [[1, c], [c, 3 alpha^2]] = diag(g_x, g_y), the returned stress is the trial one divided by 1 + l h g,

    h = E / (2 (1 - nu)) for 11 + 22,    3 G for 11 - 22 and 12,    l = dp / sigma_y(dp)

so one scalar equation is left, sigma_eq(l) = sigma_y(lambda + (1 - D_r) dp). Its left side falls and lies between
those of the smallest and largest h g, so the root is bracketed: Newton on sigma_y / sigma_eq, which is linear for
one mode, and halving where it leaves the bracket. It cannot fail.

**Edge.** The surface has an edge at (m, b) = 0, towards which stretching drives bending. There any c between
-alpha/2 and alpha/2 is allowed, and that one is taken which returns to (m, b) = 0.
"""

from . import hardening
from ..runtime import ti


@ti.func
def product(a11, a22, a12, b11, b22, b12):
    """The von Mises product of two plane stresses."""
    return a11 * b11 + a22 * b22 + 3.0 * a12 * b12 - 0.5 * (a11 * b22 + a22 * b11)


@ti.func
def equivalent2(s: ti.template(), alpha, kappa):
    """sigma_eq^2 of s = (m11, m22, m12) or (m, b, s1, s2)."""
    result = product(s[0], s[1], s[2], s[0], s[1], s[2])
    if ti.static(s.n > 3):
        cross = product(s[0], s[1], s[2], s[3], s[4], s[5])
        result += alpha * ti.abs(cross) + 3.0 * alpha * alpha * product(s[3], s[4], s[5], s[3], s[4], s[5])
        result += 3.0 * kappa * (s[6] * s[6] + s[7] * s[7])
    return result


@ti.func
def pressure2(s: ti.template(), alpha):
    """sigma_H^2, with bending taking part as in sigma_eq: sigma_H / sigma_eq = 1/3 in uniaxial tension and bending."""
    m = s[0] + s[1]
    result = m * m
    if ti.static(s.n > 3):
        b = s[3] + s[4]
        cross = product(s[0], s[1], s[2], s[3], s[4], s[5])
        sign = 1.0
        if cross < 0.0:
            sign = -1.0
        result = ti.max(m * m + sign * alpha * m * b + 3.0 * alpha * alpha * b * b, 0.0)
    return result / 9.0


@ti.func
def strength_of(material: ti.template(), lam):
    """(sigma_y, slope) [Pa] of the material's hardening."""
    stress, slope = material.yield_stress[0], material.yield_stress[0] * 0.0
    if ti.static(material.tabulated):
        stress, slope = hardening.table(lam, material.points, material.n_points[0])
    else:
        stress, slope = hardening.power(lam, material.yield_stress[0], material.hardening[0], material.exponent[0])
    return stress, slope


@ti.func
def multiplier(material: ti.template(), a: ti.template(), k: ti.template(), first, lam, kept, rate_factor):
    """(dp, sigma_y) that satisfy sum_j a_j / (1 + k_j dp / sigma_y)^2 = sigma_y(lam + kept dp)^2.

    a: squares of the trial stress by mode [Pa2]; k: h g of the modes [Pa]; first: sigma_y at dp = 0, below the root
    of sum a.
    """
    trial2, least, steep = a[0] * 0.0, k[0], a[0] * 0.0
    for j in ti.static(range(a.n)):
        trial2 += a[j]
        steep += a[j] * k[j]
        if a[j] > 0.0:
            least = ti.min(least, k[j])
    trial = ti.sqrt(trial2)
    low, high = first * 0.0, (trial - first) / least
    dp = ti.min((trial - first) * trial2 / steep, high)
    flow = first
    going, round = 1, 0
    if trial <= first:
        going, dp = 0, first * 0.0
    while going == 1:
        stress, slope = strength_of(material, lam + kept * dp)
        flow = rate_factor * stress
        slope *= rate_factor * kept
        reach = dp / flow  # l, and its derivative after dp
        reach_dp = (1.0 - reach * slope) / flow
        eq2, eq2_l = first * 0.0, first * 0.0
        for j in ti.static(range(a.n)):
            d = 1.0 / (1.0 + k[j] * reach)
            part = a[j] * d * d
            eq2 += part
            eq2_l -= 2.0 * k[j] * d * part
        root = ti.sqrt(eq2)
        off = flow / root - 1.0  # below the root: negative
        if off < 0.0:
            low = dp
        else:
            high = dp
        after = dp - off * root / (slope - 0.5 * flow / eq2 * eq2_l * reach_dp)
        if not (after > low and after < high):
            after = 0.5 * (low + high)
        round += 1
        if ti.abs(off) <= material.accuracy[0] or round == 60 or high - low <= material.accuracy[0] * high:
            going = 0
        else:
            dp = after
    return dp, flow


@ti.func
def return_plane(material: ti.template(), s: ti.template(), bulk, shear, first, lam, kept, rate_factor):
    """(returned stress, dp, sigma_y) of a trial stress s (m11, m22, m12) beyond the surface; bulk = E/(2(1-nu)), shear = 3G."""
    mean, half = 0.5 * (s[0] + s[1]), 0.5 * (s[0] - s[1])
    a = ti.Vector([mean * mean, 3.0 * (half * half + s[2] * s[2])])
    k = ti.Vector([bulk, shear])
    dp, flow = multiplier(material, a, k, first, lam, kept, rate_factor)
    mean /= 1.0 + bulk * dp / flow
    less = 1.0 / (1.0 + shear * dp / flow)
    return ti.Vector([mean + less * half, mean - less * half, less * s[2]]), dp, flow


@ti.func
def return_with(material: ti.template(), s: ti.template(), c, bulk, shear, sheared, first, lam, kept, rate_factor):
    """(returned stress, dp, sigma_y) of a trial stress (m, b, s) beyond the surface, with cross coefficient c."""
    b2 = 3.0 * material.alpha[0] * material.alpha[0]
    off = 0.5 * (1.0 - b2)
    radius = ti.sqrt(off * off + c * c)
    gx, gy = 0.5 * (1.0 + b2) + radius, 0.5 * (1.0 + b2) - radius
    # direction of the larger one: (cos, sin) of half the angle of (off, c)
    cos2 = 0.5 + 0.5 * off / ti.max(radius, 1e-30)
    cos = ti.sqrt(ti.max(cos2, 0.0))
    sin = ti.sqrt(ti.max(1.0 - cos2, 0.0))
    if c < 0.0:
        sin = -sin
    m = ti.Vector([s[0], s[1], s[2]])
    b = ti.Vector([s[3], s[4], s[5]])
    x, y = cos * m + sin * b, cos * b - sin * m
    xm, xh, ym, yh = 0.5 * (x[0] + x[1]), 0.5 * (x[0] - x[1]), 0.5 * (y[0] + y[1]), 0.5 * (y[0] - y[1])
    across = 3.0 * material.kappa[0]
    a = ti.Vector(
        [
            gx * xm * xm,
            3.0 * gx * (xh * xh + x[2] * x[2]),
            gy * ym * ym,
            3.0 * gy * (yh * yh + y[2] * y[2]),
            across * (s[6] * s[6] + s[7] * s[7]),
        ]
    )
    k = ti.Vector([bulk * gx, shear * gx, bulk * gy, shear * gy, across * sheared])
    dp, flow = multiplier(material, a, k, first, lam, kept, rate_factor)
    reach = dp / flow
    xm /= 1.0 + k[0] * reach
    ym /= 1.0 + k[2] * reach
    lx, ly, ls = 1.0 / (1.0 + k[1] * reach), 1.0 / (1.0 + k[3] * reach), 1.0 / (1.0 + k[4] * reach)
    x = ti.Vector([xm + lx * xh, xm - lx * xh, lx * x[2]])
    y = ti.Vector([ym + ly * yh, ym - ly * yh, ly * y[2]])
    m, b = cos * x - sin * y, sin * x + cos * y
    return ti.Vector([m[0], m[1], m[2], b[0], b[1], b[2], ls * s[6], ls * s[7]]), dp, flow


@ti.func
def return_section(material: ti.template(), s: ti.template(), bulk, shear, sheared, first, lam, kept, rate_factor):
    """(returned stress, dp, sigma_y) of a trial stress (m, b, s) beyond the surface; `sheared` = G_s / e.

    Finds the cross coefficient t c_0, c_0 = sign (m, b) alpha / 2, with t = 1 or, where that would change the sign
    of (m, b), the t that returns to the edge.
    """
    cross = product(s[0], s[1], s[2], s[3], s[4], s[5])
    sign = 1.0
    if cross < 0.0:
        sign = -1.0
    half = 0.5 * material.alpha[0]
    low, high = -half, half
    mm = product(s[0], s[1], s[2], s[0], s[1], s[2])
    bb = product(s[3], s[4], s[5], s[3], s[4], s[5])
    # how much (m, b) falls per c, from the strain that lies beyond the surface
    excess = ti.sqrt(equivalent2(s, material.alpha[0], material.kappa[0])) / first - 1.0
    t = ti.min(ti.abs(cross) / ti.max(excess * (mm + bb), 1e-30), half)
    ended = t >= half  # whether t = 1 has been tried
    r, dp, flow = return_with(material, s, sign * t, bulk, shear, sheared, first, lam, kept, rate_factor)
    going, round = 1, 0
    while going == 1:
        left = sign * product(r[0], r[1], r[2], r[3], r[4], r[5])
        round += 1
        if ti.abs(left) <= material.edge[0] * flow * flow or (t >= half and left >= 0.0) or round == 30:
            going = 0
        else:
            if left > 0.0:
                low = t
            else:
                high = t
            rm = product(r[0], r[1], r[2], r[0], r[1], r[2])
            rb = product(r[3], r[4], r[5], r[3], r[4], r[5])
            t += left / ti.max(dp / flow * shear * (rm + rb), 1e-30)
            if t >= half and not ended:
                t, ended = half, True
            elif not (t > low and t < high):
                t = 0.5 * (low + high)
            r, dp, flow = return_with(material, s, sign * t, bulk, shear, sheared, first, lam, kept, rate_factor)
    # what the edge leaves of (m, b) is taken by B.13: exactly onto the surface
    r *= flow / ti.sqrt(equivalent2(r, material.alpha[0], material.kappa[0]))
    return r, dp, flow
